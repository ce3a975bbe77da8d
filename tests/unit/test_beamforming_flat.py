from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.flat import flat_powers, problem_lobes
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem


def _problem(ripple: float, halfwidth: float, floor: float = 0.0) -> BeamProblem:
    return BeamProblem(
        angles=np.radians([75.0, 135.0]),
        distances=np.array([103.5, 141.4]),
        coverage_halfwidths=np.radians(np.full(2, halfwidth)),
        ripple=ripple,  # type: ignore[arg-type]
        min_rate=floor,  # type: ignore[arg-type]
        power=1e4,
        noise=1.0,
        n_tx=30,
    )


@pytest.mark.parametrize(
    ("ripple", "halfwidth", "floor"),
    [
        *[(0.0, halfwidth, floor) for halfwidth in (40.0, 90.0) for floor in (0.0, 0.2, 5.0)],
        pytest.param(1e-4, 90.0, 0.2, marks=pytest.mark.slow),
        pytest.param(1e-4, 40.0, 5.0, marks=pytest.mark.slow),
    ],
)
def test_hardly_any_ripple_over_a_wide_cover_is_answered_and_the_message_says_how(
    ripple: float, halfwidth: float, floor: float
) -> None:
    problem = _problem(ripple, halfwidth, floor)
    answer = design_beams(problem)
    assert answer.outcome in (
        ("flat",) if ripple == 0.0 else ("flat", "unproved", "floors lowered")
    )
    assert "object" in answer.message
    missed = violation(problem, answer.beams)
    assert max(missed.power, missed.coverage) <= 1e-6
    assert missed.rate <= 1e-9 or "scaled" in answer.message
    assert answer.objective <= answer.upper_bound < np.inf


def test_no_powers_of_flat_beams_do_better() -> None:
    rng = np.random.default_rng(0)
    loss, floors = np.array([0.8, 1.3, 2.0]), np.array([0.1, 0.05, 0.2])
    powers, factor = flat_powers(loss, floors)
    assert factor == 1.0

    def reached(share: np.ndarray) -> np.ndarray:
        heard = np.sum(share, axis=-1, keepdims=True) - share
        return np.asarray(np.log2(1.0 + share / (loss + heard)))

    np.testing.assert_allclose(powers.sum(), 1.0)
    assert np.all(reached(powers) >= floors * (1.0 - 1e-12))
    others = reached(rng.dirichlet(np.ones(3), 20_000))
    kept = np.all(others >= floors, axis=1)
    assert kept.sum() > 100
    assert others[kept].sum(axis=1).max() <= reached(powers).sum()


def test_floors_out_of_reach_are_met_to_the_same_part_with_all_the_power() -> None:
    loss, floors = np.array([0.8, 1.3]), np.array([2.0, 3.0])
    powers, factor = flat_powers(loss, floors)
    found = np.log2(1.0 + powers / (loss + powers[::-1]))
    np.testing.assert_allclose(found, factor * floors, rtol=1e-9)
    np.testing.assert_allclose(powers.sum(), 1.0)


def test_lobes_of_a_cover_are_its_phases_over_those_of_one_lobe() -> None:
    found = problem_lobes(_problem(0.0, 90.0))[0]
    # The sine over 165 degrees each way of 75 degrees runs from -sin 15 degrees to one.
    np.testing.assert_allclose(found, 15.0 * (1.0 + np.sin(np.radians(15.0))), rtol=1e-9)


@pytest.mark.slow
def test_a_little_ripple_is_used_where_the_search_ends_unfinished() -> None:
    problem = _problem(1e-4, 30.0)
    answer = design_beams(problem)
    flat = np.log2(1.0 + problem.power / problem.distances[0] ** 2)
    assert "object" in answer.message
    assert answer.objective > 1.5 * flat
    assert answer.max_violation.largest <= 1e-6


def test_flat_beams_reach_every_object_alike() -> None:
    problem = _problem(0.0, 90.0)
    beams = np.zeros((2, 30), dtype=complex)
    beams[0, 0] = np.sqrt(problem.power)
    alone = np.log2(1.0 + problem.power / problem.distances[0] ** 2)
    np.testing.assert_allclose(rates(problem, beams), [alone, 0.0])
    np.testing.assert_allclose(design_beams(problem).objective, alone)
