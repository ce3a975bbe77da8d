"""Laws of beam design for random problems: feasible, bounded, fair, and blind to symmetries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation.recovery import keep_coverage
from echobeam.physics.array import LinearArray

DEG = np.pi / 180.0


@st.composite
def problems(draw: st.DrawFn, most_objects: int = 3) -> BeamProblem:
    n_objects = draw(st.integers(1, most_objects))
    n_tx = draw(st.integers(1, 12))

    def vector(low: float, high: float) -> np.ndarray:
        size = {"min_size": n_objects, "max_size": n_objects}
        return np.array(draw(st.lists(st.floats(low, high), **size)))

    distances, power = vector(50.0, 200.0), 10.0 ** draw(st.floats(-3, 6))
    alone = np.log2(1.0 + power * n_tx / distances**2)
    return BeamProblem(
        angles=vector(10.0, 170.0) * DEG,
        distances=distances,
        coverage_halfwidths=vector(0.0, 12.0) * DEG,
        ripple=vector(0.1, n_tx / 2.0 + 0.5),
        min_rate=alone * draw(st.sampled_from([0.0, 0.05, 0.3, 2.0])),
        power=power,
        noise=1.0,
        n_tx=n_tx,
        axis=draw(st.sampled_from(["vertical", "horizontal"])),
        resolution=0.5 * DEG,
    )


@settings(max_examples=25)
@given(problems())
@pytest.mark.slow
def test_every_problem_has_a_feasible_answer_or_a_named_fault(problem: BeamProblem) -> None:
    answer = design_beams(problem)
    assert answer.max_violation.power <= 1e-12
    assert answer.max_violation.coverage <= 1e-6
    assert answer.objective <= answer.upper_bound
    if answer.status == "optimal":
        assert answer.max_violation.rate <= 1e-6
    else:
        assert answer.status == "fallback"
        assert "object" in answer.message


@settings(max_examples=15)
@given(problems())
def test_more_power_serves_no_worse(problem: BeamProblem) -> None:
    answer = design_beams(problem)
    richer = design_beams(_changed(problem, power=2.0 * problem.power))
    # The same beams with twice the power are feasible, and better where nothing else changes.
    if answer.status == "optimal":
        assert richer.status == "optimal"
        assert richer.upper_bound >= answer.objective


@settings(max_examples=15)
@given(problems(), st.integers(0, 10_000))
def test_no_random_feasible_design_beats_the_bound(problem: BeamProblem, seed: int) -> None:
    problem = _changed(problem, min_rate=0.0)
    answer = design_beams(problem)
    rng = np.random.default_rng(seed)
    steering = LinearArray(problem.n_tx, axis=problem.array.axis).steering(problem.angles)
    for _ in range(10):
        noise = rng.normal(size=(2, *steering.shape))
        beams = steering + rng.exponential() * (noise[0] + 1j * noise[1])
        beams = keep_coverage(problem, beams / np.linalg.norm(beams, axis=1, keepdims=True))
        shares = rng.dirichlet(np.ones(problem.n_objects))
        beams = beams * np.sqrt(problem.power * shares)[:, np.newaxis] * (1 - 1e-12)
        assert violation(problem, beams).largest <= 1e-6
        assert rates(problem, beams).sum() <= answer.upper_bound * (1 + 1e-6)


@settings(max_examples=15)
@given(problems(), st.randoms(use_true_random=False))
def test_the_order_of_the_objects_does_not_matter(problem: BeamProblem, random: object) -> None:
    order = list(range(problem.n_objects))
    random.shuffle(order)  # type: ignore[attr-defined]
    shuffled = _changed(
        problem,
        **{
            name: getattr(problem, name)[order]
            for name in ("angles", "distances", "coverage_halfwidths", "ripple", "min_rate")
        },
    )
    first, second = design_beams(problem), design_beams(shuffled)
    assert first.status == second.status
    assert abs(first.objective - second.objective) <= 1e-6 * first.objective


@settings(max_examples=15)
@given(problems())
def test_units_of_power_do_not_matter(problem: BeamProblem) -> None:
    scaled = _changed(problem, power=1e5 * problem.power, noise=1e5 * problem.noise)
    first, second = design_beams(problem), design_beams(scaled)
    assert first.status == second.status
    assert abs(first.objective - second.objective) <= 1e-6 * first.objective


def _changed(problem: BeamProblem, **changes: object) -> BeamProblem:
    names = (
        "angles", "distances", "coverage_halfwidths", "ripple", "min_rate", "power", "noise",
        "alpha0", "resolution", "array",
    )  # fmt: skip
    return BeamProblem(**{**{name: getattr(problem, name) for name in names}, **changes})  # type: ignore[arg-type]
