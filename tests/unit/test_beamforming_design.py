from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_batch, design_beams
from echobeam.beamforming.methods import METHODS
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem, ProblemBatch, ProblemError
from echobeam.physics.planar import PlanarArray

from ..problems import problem_batch

DEG = np.pi / 180.0


def _paper(**changes: object) -> BeamProblem:
    values: dict[str, object] = {
        "angles": np.array([75.0, 135.0]) * DEG,
        "distances": np.array([103.0, 141.0]),
        "coverage_halfwidths": np.array([3.0, 2.0]) * DEG,
        "ripple": 3.0,
        "min_rate": 4e-4,
        "power": 1.0,
        "noise": 1.0,
        "n_tx": 30,
    }
    return BeamProblem(**{**values, **changes})  # type: ignore[arg-type]


def test_paper_load_is_solved_and_proved_to_the_interference_that_is_left() -> None:
    answer = design_beams(_paper())
    assert (answer.status, answer.message) == ("optimal", "")
    assert answer.max_violation.largest <= 1e-6
    assert answer.objective <= answer.upper_bound
    assert answer.gap < 1e-5
    assert answer.beams.shape == (2, 30)
    assert answer.seconds > 0


def test_answer_reports_what_its_beams_do() -> None:
    problem = _paper(power=1e4, min_rate=1.0)
    answer = design_beams(problem)
    np.testing.assert_array_equal(answer.rates, rates(problem, answer.beams))
    assert answer.objective == pytest.approx(answer.rates.sum(), rel=1e-15)
    assert answer.max_violation == violation(problem, answer.beams)


@pytest.mark.parametrize("power", [1e-3, 1.0, 1e3, 1e6])
def test_one_object_without_coverage_gets_shannons_rate_of_the_matched_beam(power: float) -> None:
    problem = BeamProblem([1.1], [90.0], [0.0], 3.0, 0.0, power, 0.7, 30, alpha0=2.0)
    answer = design_beams(problem)
    expected = np.log2(1 + power * 30 * 2.0**2 / (90.0**2 * 0.7))
    assert answer.objective == pytest.approx(expected, rel=1e-12)
    assert answer.gap < 1e-9
    assert design_beams(problem, method="sdp").iterations == 0


def test_beams_without_coverage_lie_in_the_span_of_the_steering_vectors() -> None:
    problem = _paper(coverage_halfwidths=np.zeros(2), min_rate=0.0, power=1e5)
    answer = design_beams(problem)
    steering = np.exp(1j * np.pi * np.outer(np.sin(problem.angles), np.arange(30)))
    span, _ = np.linalg.qr(steering.T)
    outside = answer.beams.T - span @ (span.conj().T @ answer.beams.T)
    assert np.linalg.norm(outside) <= 1e-3 * np.linalg.norm(answer.beams)


def test_nothing_depends_on_the_scale_of_the_power() -> None:
    answers = [design_beams(_paper(power=p, noise=p, min_rate=4e-4)) for p in (1e-3, 1.0, 1e6)]
    for answer in answers:
        assert answer.objective == pytest.approx(answers[1].objective, rel=1e-9)
    np.testing.assert_allclose(answers[0].beams / 1e-3**0.5, answers[2].beams / 1e3, atol=1e-6)


def test_floors_bind_where_the_near_object_would_take_all() -> None:
    free = design_beams(_paper(min_rate=0.0))
    assert free.rates[1] < 1e-9
    held = design_beams(_paper())
    assert held.rates[1] == pytest.approx(4e-4, rel=1e-6)
    assert held.objective < free.objective


def test_no_objects_need_no_beams() -> None:
    answer = design_beams(BeamProblem([], [], [], 3.0, 0.0, 1.0, 1.0, 8))
    assert answer.beams.shape == (0, 8)
    assert (answer.objective, answer.upper_bound, answer.gap) == (0.0, 0.0, 0.0)
    assert answer.status == "optimal"
    assert answer.max_violation.largest == 0.0


def test_more_objects_than_antennas_have_an_answer() -> None:
    problem = BeamProblem(
        np.array([40.0, 70.0, 90.0, 120.0]) * DEG, [100.0] * 4, [0.05] * 4, 0.5, 0.0, 1e4, 1, 2
    )
    answer = design_beams(problem)
    assert answer.status == "optimal"
    assert answer.max_violation.largest <= 1e-6
    assert answer.objective > 0


def test_methods_are_a_registry_and_others_are_refused() -> None:
    assert {"fast", "sdp", "reference"} <= set(METHODS)
    with pytest.raises(ProblemError, match="magic"):
        design_beams(_paper(), method="magic")
    with pytest.raises(ProblemError, match="magic"):
        design_batch(_batch(), method="magic")


def _batch(**changes: object) -> ProblemBatch:
    values: dict[str, object] = {
        "angles": np.array([[75.0, 135.0], [60.0, 110.0], [75.0, 135.0], [70.0, np.nan]]) * DEG,
        "distances": np.array([[103.0, 141.0], [110.0, 105.0], [103.0, 141.0], [99.0, np.nan]]),
        "coverage_halfwidths": np.array([[3.0, 2.0], [2.0, 2.0], [3.0, 2.0], [1.0, np.nan]]) * DEG,
        "active": np.array([[True, True], [True, True], [True, True], [True, False]]),
        "ripple": np.array([3.0, 3.0]),
        "min_rate": np.array([4e-4, 4e-4]),
        "power": 1.0,
        "noise": 1.0,
        "n_tx": 12,
    }
    return problem_batch(**{**values, **changes})  # type: ignore[arg-type]


def test_batch_gives_what_its_members_get_alone() -> None:
    batch = _batch(min_rate=np.array([1e-4, 1e-4]))
    answers = design_batch(batch)
    assert answers.beams.shape == (4, 2, 12)
    for trial in range(4):
        alone = design_beams(batch.problem(trial))
        together = answers.beams[trial, batch.active[trial]]
        assert together.shape == alone.beams.shape
        assert violation(batch.problem(trial), together).largest <= 1e-6
        assert answers.objective[trial] == pytest.approx(alone.objective, rel=1e-9)
        assert rates(batch.problem(trial), together).sum() == pytest.approx(
            alone.objective, rel=1e-9
        )
    assert np.all(answers.beams[3, 1] == 0)
    assert not answers.fallback.any()
    assert answers.messages == {}


def test_equal_problems_of_a_batch_are_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from echobeam.beamforming.relaxation import solver as relaxation

    calls: list[BeamProblem] = []
    solve = relaxation.solve
    monkeypatch.setattr(relaxation, "solve", lambda p: calls.append(p) or solve(p))
    design_batch(_batch(), method="sdp")
    assert len(calls) == 3


@pytest.mark.parametrize("changes", [{"power": np.nan}, {"n_tx": 1}, {"resolution": -1.0}])
def test_what_the_direct_solver_cannot_take_never_reaches_it(changes: dict[str, float]) -> None:
    answers = design_batch(_batch(min_rate=np.zeros(2), **changes))
    refused = "n_tx" not in changes
    assert answers.fallback.tolist() == [refused] * 4
    assert all(next(iter(changes)) in text for text in answers.messages.values())


def test_a_bound_is_proved_when_asked_for_and_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from echobeam.beamforming.relaxation import solver as relaxation

    calls: list[float] = []
    prove = relaxation.prove
    monkeypatch.setattr(relaxation, "prove", lambda *a: calls.append(1.0) or prove(*a))
    answer = design_beams(_paper())
    assert (calls, "not asked" in repr(answer)) == ([], True)
    assert answer.upper_bound >= answer.objective
    assert answer.gap < 1e-5
    assert calls == [1.0]


def test_batch_says_which_trials_fell_back_and_why() -> None:
    answers = design_batch(_batch(min_rate=np.array([4e-4, 9e-4])))
    assert answers.fallback.tolist() == [True, False, True, False]
    assert set(answers.messages) == {0, 2}
    assert "object 1" in answers.messages[0]
    assert np.all(np.isfinite(answers.beams))


def test_a_trial_that_makes_no_problem_stops_no_other() -> None:
    angles = _batch().angles.copy()
    angles[1, 0] = np.nan
    answers = design_batch(_batch(angles=angles, min_rate=np.zeros(2)))
    assert answers.fallback.tolist() == [False, True, False, False]
    assert "angles" in answers.messages[1]
    assert np.all(answers.beams[1] == 0)
    assert np.all(np.abs(answers.beams[[0, 2]]).sum(axis=(1, 2)) > 0)


def test_empty_scenes_in_a_batch_get_nothing() -> None:
    answers = design_batch(_batch(active=np.zeros((4, 2), dtype=bool)))
    assert np.all(answers.beams == 0)
    assert np.all(answers.objective == 0)
    assert not answers.fallback.any()


def test_a_problem_with_other_values_is_checked_as_a_new_one():
    problem = BeamProblem([1.3, 2.3], [100, 140], 0.05 * np.ones(2), 3, 0, 1, 1, 16)
    louder = problem.replace(power=2, min_rate=[0.1, 0])
    assert (louder.power, louder.min_rate.tolist()) == (2.0, [0.1, 0.0])
    assert (problem.power, louder.n_tx) == (1.0, 16)
    with pytest.raises(ProblemError, match="degrees"):
        problem.replace(angles=[75, 135])
    with pytest.raises(ProblemError, match="n_tx must be a whole number"):
        BeamProblem([1.3], [100], [0.05], 3, 0, 1, 1, True)


def test_one_value_stands_for_all_objects_and_one_angle_is_one_object():
    alone = BeamProblem(1.3, 103.5, 0.05, 2, 0, 1, 1, 30)
    assert alone.n_objects == 1
    once = BeamProblem([1.3, 2.0], 103.5, 0.05, 2, 0, 1, 1, 30)
    each = BeamProblem([1.3, 2.0], [103.5] * 2, [0.05] * 2, [2] * 2, [0] * 2, 1, 1, 30)
    np.testing.assert_array_equal(design_beams(once).beams, design_beams(each).beams)
    array, cover = PlanarArray(4, 4), np.diag([0.01, 0.02])
    assert BeamProblem([0.1, 0.2], 9.0, cover, 2, 0, 1, 1, array=array).n_objects == 1
    pairs = [[0.1, 0.2], [0.0, -0.3]]
    once = BeamProblem(pairs, 9.0, cover, 2, 0, 1, 1, array=array)
    np.testing.assert_array_equal(once.coverage_halfwidths, [cover, cover])
    with pytest.raises(ProblemError, match=r"distances must be of shape \(2,\) or a scalar"):
        BeamProblem(pairs, [1.0, 2.0, 3.0], cover, 2, 0, 1, 1, array=array)
    with pytest.raises(ProblemError, match=r"angles must be of shape \(K, 2\) or \(2,\)"):
        BeamProblem(0.1, 9.0, cover, 2, 0, 1, 1, array=array)
