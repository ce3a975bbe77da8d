from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.direct import solve_batch
from echobeam.beamforming.problem import ProblemBatch

from ..problems import problem_batch


def _batch(**changes: Any) -> ProblemBatch:
    values: dict[str, Any] = {
        "angles": np.radians([[75.0, 135.0], [60.0, 100.0], [90.0, 45.0]]),
        "distances": np.array([[103.0, 141.0], [115.0, 110.0], [100.0, 140.0]]),
        "coverage_halfwidths": np.radians([[3.0, 3.0], [2.0, 2.0], [4.0, 1.0]]),
        "active": np.ones((3, 2), dtype=bool),
        "ripple": np.full(2, 3.0),
        "min_rate": np.full(2, 4e-4),
        "power": 1.0,
        "noise": 1.0,
        "n_tx": 30,
    }
    return problem_batch(**{**values, **changes})


def _alone(batch: ProblemBatch, trial: int) -> ProblemBatch:
    names = ("angles", "loss", "coverage_halfwidths", "active")
    return replace(batch, **{name: getattr(batch, name)[[trial]] for name in names})


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"axis": "horizontal"},
        {"spacing": 0.25},
        {"spacing": 1.0},
        {"ripple": np.full(2, 0.1), "min_rate": np.zeros(2)},
        {"ripple": np.full(2, 60.0)},
        {"coverage_halfwidths": np.zeros((3, 2)), "ripple": np.zeros(2)},
        {"power": 1e-3, "min_rate": np.full(2, 4e-7)},
        {"power": 1e6, "min_rate": np.ones(2)},
        {"n_tx": 2, "ripple": np.full(2, 0.5), "min_rate": np.zeros(2)},
    ],
)
def test_beams_keep_every_constraint_on_the_full_grid(changes: dict[str, Any]) -> None:
    batch = _batch(**changes)
    result = solve_batch(batch)
    assert result.converged.all()
    for trial in range(len(batch)):
        assert violation(batch.problem(trial), result.beams[trial]).largest < 1e-8


def test_a_single_antenna_is_left_to_others() -> None:
    active = np.array([[True, False], [False, False], [True, True]])
    result = solve_batch(_batch(n_tx=1, active=active))
    assert result.converged.tolist() == [False, True, False]


def test_one_object_without_coverage_gets_the_matched_beam() -> None:
    batch = _batch(coverage_halfwidths=np.zeros((3, 2)), active=np.array([[True, False]] * 3))
    result = solve_batch(batch)
    expected = np.log2(1.0 + 30.0 / batch.loss[:, 0])
    np.testing.assert_allclose(result.objective, expected, rtol=1e-8)
    assert not result.beams[:, 1].any()


def test_a_trial_does_not_depend_on_its_company() -> None:
    batch = _batch(power=1e4, min_rate=np.zeros(2), ripple=np.full(2, 2.0))
    together = solve_batch(batch)
    for trial in range(3):
        alone = solve_batch(_alone(batch, trial))
        assert alone.iterations[0] == together.iterations[trial]
        np.testing.assert_allclose(alone.objective[0], together.objective[trial], rtol=1e-10)


def test_inactive_objects_may_be_anything_and_nobody_may_be_active() -> None:
    active = np.array([[True, False], [False, False], [True, True]])
    batch = _batch(active=active)
    spoiled = replace(batch, angles=np.where(active, batch.angles, np.nan))
    result = solve_batch(spoiled)
    np.testing.assert_array_equal(result.objective, solve_batch(batch).objective)
    assert result.objective[1] == 0.0


def test_floors_too_high_are_named_and_shared_out() -> None:
    result = solve_batch(_batch(min_rate=np.ones(2)))
    assert result.floors_infeasible.all()
    assert np.all((result.floor_factor > 0.0) & (result.floor_factor < 1.0))


def test_a_warm_start_leads_to_the_same_beams() -> None:
    batch = _batch()
    cold = solve_batch(batch)
    warm = solve_batch(replace(batch, warm_start=cold.beams))
    np.testing.assert_allclose(warm.objective, cold.objective, rtol=1e-8)
    assert warm.iterations.sum() < cold.iterations.sum()


def test_no_trials_and_no_objects() -> None:
    nobody = np.zeros((3, 0))
    empty = _batch(
        angles=nobody,
        distances=nobody,
        coverage_halfwidths=nobody,
        active=np.zeros((3, 0), dtype=bool),
        ripple=np.zeros(0),
        min_rate=np.zeros(0),
    )
    assert solve_batch(empty).converged.all()


def test_an_object_that_is_not_worth_serving_does_not_hold_up_the_others() -> None:
    batch = _batch(
        angles=np.radians([[74.4, 140.9], [72.7, 134.6], [74.5, 132.7]]),
        coverage_halfwidths=np.radians([[6.3, 45.0], [4.5, 45.0], [4.5, 45.0]]),
        min_rate=np.zeros(2),
    )
    result = solve_batch(batch)
    assert result.converged.all()
    assert result.iterations.max() < 40
    alone = solve_batch(replace(batch, active=np.array([[True, False]] * 3)))
    np.testing.assert_allclose(result.objective, alone.objective, rtol=1e-8)
    for trial in range(3):
        assert violation(batch.problem(trial), result.beams[trial]).largest < 1e-6
