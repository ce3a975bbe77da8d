"""Branch and bound against exhaustive search where that is possible, and on known hard cases."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from echobeam.beamforming.certify.branch import certify
from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem, ProblemError
from echobeam.beamforming.relaxation import conic
from echobeam.beamforming.relaxation.recovery import keep_coverage
from echobeam.physics.array import LinearArray

DEG = np.pi / 180.0


def _problem(angles: list[float], power: float, n_tx: int = 30, **changes: object) -> BeamProblem:
    theta = np.array(angles) * DEG
    values: dict[str, object] = {
        "angles": theta,
        "distances": 100.0 / np.sin(theta),
        "coverage_halfwidths": np.full(theta.size, 3.0) * DEG,
        "ripple": 2.0,
        "min_rate": 0.0,
        "power": power,
        "noise": 1.0,
        "n_tx": n_tx,
    }
    return BeamProblem(**{**values, **changes})  # type: ignore[arg-type]


def _exhaustive(problem: BeamProblem, steps: int) -> float:
    """Return the best sum rate without coverage and floors on a grid of the dual uplink's powers.

    The SINRs that linear beams can reach are those of the uplink with the same sum power, where
    the best receiver of given powers is known: nothing but the powers is left to search.
    """
    loss = problem.loss
    channels = LinearArray(problem.n_tx).steering(problem.angles) / np.sqrt(loss)[:, None]
    shares = np.stack(np.meshgrid(*[np.linspace(0, 1, steps)] * (problem.n_objects - 1)), -1)
    shares = shares.reshape(-1, problem.n_objects - 1)
    shares = shares[shares.sum(axis=1) <= 1.0 + 1e-12]
    powers = problem.power * np.column_stack([shares, np.maximum(1 - shares.sum(axis=1), 0.0)])
    total = 0.0
    for k in range(problem.n_objects):
        other = np.arange(problem.n_objects) != k
        noise = np.einsum(
            "sk,ki,kj->sij", powers[:, other], channels[other], channels[other].conj()
        )
        heard = np.linalg.solve(np.eye(problem.n_tx) + noise, channels[k][:, None])[..., 0]
        total = total + np.log2(1 + powers[:, k] * np.real(heard @ channels[k].conj()))
    return float(np.max(total))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("angles", "n_tx", "power", "steps"),
    [
        ([70, 82], 6, 3e4, 4001),
        ([60, 66], 8, 1e5, 4001),
        ([60, 75], 7, 3e3, 4001),
        ([50, 70, 120], 6, 1e4, 61),
        ([65, 72, 80], 6, 1e5, 61),
    ],
)
def test_the_certified_answer_is_that_of_exhaustive_search(
    angles: list[float], n_tx: int, power: float, steps: int
) -> None:
    problem = _problem(angles, power, n_tx, coverage_halfwidths=np.zeros(len(angles)))
    best = _exhaustive(problem, steps)
    answer = design_beams(problem, certify=True)
    assert answer.status == "optimal"
    assert answer.upper_bound >= best * (1 - 1e-12)
    assert answer.objective >= best * (1 - 1.1e-4)
    assert answer.gap <= 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_no_beams_found_by_random_search_beat_the_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = 60.0 + np.array([0.0, rng.uniform(4, 40)])
    problem = _problem(
        angles.tolist(), 10 ** rng.uniform(2, 5), int(rng.integers(6, 9)), resolution=0.5 * DEG
    )
    answer = design_beams(problem, certify=True)
    assert answer.gap <= 1e-4
    steering = LinearArray(problem.n_tx).steering(problem.angles)
    beams, best = steering, 0.0
    for count in range(300):
        step = rng.normal(size=(2, *beams.shape)) * 10 ** rng.uniform(-3, 0.5)
        trial = beams + (step[0] + 1j * step[1]) * np.linalg.norm(beams) / 5
        trial = answer.beams + step[0] + 1j * step[1] if count == 150 else trial
        trial = keep_coverage(problem, trial / np.linalg.norm(trial, axis=1, keepdims=True))
        trial = trial * np.sqrt(problem.power * rng.dirichlet(np.ones(2)))[:, None]
        assert violation(problem, trial * (1 - 1e-12)).largest <= 1e-6
        reached = rates(problem, trial).sum()
        if reached > best:
            beams, best = trial, reached
    assert 0.5 * answer.objective < best <= answer.upper_bound * (1 + 1e-6)


def test_the_gap_that_simpler_bounds_leave_is_closed() -> None:
    problem = _problem([75, 135], 1e4)
    simple, proved = design_beams(problem), design_beams(problem, certify=True)
    assert simple.gap > 3e-4
    assert (proved.status, proved.message) == ("optimal", "")
    assert proved.gap <= 1e-6
    assert proved.objective == pytest.approx(simple.objective, rel=1e-6)


@pytest.mark.parametrize("angles", [[75, 70], [60, 57]])
def test_close_objects_are_proved_too(angles: list[float]) -> None:
    answer = design_beams(
        _problem(angles, 1e5, coverage_halfwidths=np.full(2, 1.0) * DEG), certify=True
    )
    assert answer.gap <= 1e-4
    assert answer.max_violation.largest <= 1e-6


def test_worse_beams_are_replaced_by_better_ones() -> None:
    problem = _problem([75, 135], 1e4)
    answer = design_beams(problem)
    worse = 0.5 * answer.beams
    found = certify(problem, worse, float(rates(problem, worse).sum()), 1e-4)
    assert found.beams is not None
    assert rates(problem, found.beams).sum() == pytest.approx(answer.objective, rel=1e-4)
    assert violation(problem, found.beams).largest <= 1e-6
    assert found.bound >= answer.objective


def test_a_search_that_may_not_search_says_how_far_it_is() -> None:
    problem = _problem([75, 70], 1e4)
    answer = design_beams(problem)
    found = certify(problem, answer.beams, answer.objective, 1e-4, most_boxes=0)
    assert found.boxes == 0
    assert answer.objective < found.bound < np.inf
    more = certify(problem, answer.beams, answer.objective, 1e-4, most_boxes=3)
    assert answer.objective < more.bound <= found.bound


def test_an_unreachable_gap_is_reported_and_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    from echobeam.beamforming.certify import branch

    problem = _problem([75, 70], 1e4)
    monkeypatch.setattr(branch.certify, "__defaults__", (1, branch.MOST_WORK))
    answer = design_beams(problem, certify=True)
    assert answer.gap > 1e-4
    assert "a gap of 0.0001 was not reached" in answer.message
    assert "after 1 boxes" in answer.message


@pytest.mark.slow
def test_a_solver_that_lies_cannot_make_a_bound_false(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = _problem([75, 135], 1e4, 12)
    honest = design_beams(problem, certify=True)
    solve = conic.solve

    def lying(programme: conic.Programme) -> conic.ConicAnswer:
        answer = solve(programme)
        own = [0.3 * y + 1e-3 for y in answer.own_multipliers]
        shared = 0.5 * answer.most_multipliers
        return conic.ConicAnswer(answer.matrices, own, True, True, answer.objective, shared)

    monkeypatch.setattr(conic, "solve", lying)
    found = certify(problem, honest.beams, honest.objective * 0.9, 1e-4, most_boxes=20)
    assert found.bound >= honest.objective


@pytest.mark.parametrize("gap", [0.0, -1.0, np.nan])
def test_a_gap_that_is_none_is_refused(gap: float) -> None:
    with pytest.raises(ProblemError, match="gap"):
        design_beams(_problem([75], 1.0), certify=True, gap=gap)


def test_nothing_needs_no_proof() -> None:
    nothing = design_beams(BeamProblem([], [], [], 3.0, 0.0, 1.0, 1.0, 8), certify=True)
    assert (nothing.objective, nothing.gap) == (0.0, 0.0)


def test_a_fallback_is_proved_for_the_floors_that_it_keeps() -> None:
    problem = _problem([75, 135], 1.0, min_rate=[5e-3, 1e-3])
    plain, proved = design_beams(problem), design_beams(problem, certify=True)
    assert plain.status == proved.status == "fallback"
    assert proved.gap <= 1e-4
    # Without floors more is possible: that is what the plain bound counts.
    assert plain.upper_bound >= design_beams(_problem([75, 135], 1.0)).objective
    assert plain.upper_bound > proved.upper_bound


def test_a_round_that_ends_without_power_neither_crashes_nor_spoils_the_proof() -> None:
    """In units of a sum rate of nothing the solver panicked, and what it left promised 5 bit/s."""
    problem = BeamProblem(
        angles=[2.5089191742412544, 2.0946693749564163],
        distances=[113.87307432820562, 82.23611947538575],
        coverage_halfwidths=[0.12, 0.09510753902856256],
        ripple=1.25,
        min_rate=1.0,
        power=106.70761767931793,
        noise=3.023129955372904,
        n_tx=5,
        spacing=0.25,
        axis="horizontal",
        resolution=np.radians(0.5),
    )
    answer = design_beams(problem, certify=True)
    assert answer.status == "fallback"
    assert answer.gap <= 1e-4


def test_the_command_line_certifies(tmp_path: Path) -> None:
    from echobeam.cli.beam import command

    path = tmp_path / "problem.json"
    path.write_text(
        json.dumps(
            {
                "angles_deg": [75, 135], "distances": [103.5, 141.4], "power": 1e4, "noise": 1,
                "coverage_halfwidths_deg": [3, 3], "ripple": 2, "min_rate": 0, "n_tx": 16,
            }
        )
    )  # fmt: skip
    result = CliRunner().invoke(command, [str(path), "--certify"])
    assert result.exit_code == 0
    assert json.loads(result.stdout)["gap"] <= 1e-4
