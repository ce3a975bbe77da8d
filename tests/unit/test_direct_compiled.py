"""The compiled solver takes the steps that NumPy takes; all the rest beside it is NumPy's."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from echobeam.beamforming import subspace
from echobeam.beamforming.certificate import violation
from echobeam.beamforming.direct import solve_batch
from echobeam.beamforming.fast import FEASIBLE
from echobeam.beamforming.problem import ProblemBatch

from ..problems import problem_batch

pytest.importorskip("numba", reason="the compiled solver needs Numba: pip install 'echobeam[fast]'")


def _batch(seed: int, n_tx: int, count: int, trials: int = 6, **changes: Any) -> ProblemBatch:
    rng = np.random.default_rng(seed)
    shape = (trials, count)
    values: dict[str, Any] = {
        "angles": np.radians(rng.uniform(20.0, 160.0, shape)),
        "distances": rng.uniform(100.0, 200.0, shape),
        "coverage_halfwidths": np.radians(3.0 * rng.uniform(0.1, 1.5, shape)),
        "active": np.ones(shape, dtype=bool),
        "ripple": np.exp(rng.uniform(np.log(0.5), np.log(n_tx / 2), count)),
        "min_rate": np.zeros(count),
        "power": 10.0 ** rng.uniform(0.0, 4.0),
        "noise": 1.0,
        "n_tx": n_tx,
    }
    return problem_batch(**{**values, **changes})


CASES = {
    "two antennas": _batch(0, 2, 1, ripple=np.array([0.5])),
    "one object": _batch(1, 30, 1),
    "two objects": _batch(2, 30, 2, power=1.0),
    "an odd array": _batch(3, 17, 3, power=10.0),
    "four objects": _batch(4, 64, 4, power=100.0),
    "a wide cover": _batch(5, 30, 2, coverage_halfwidths=np.full((6, 2), 0.25), power=1.0),
    "no cover": _batch(6, 30, 3, coverage_halfwidths=np.zeros((6, 3))),
    "floors": _batch(7, 30, 2, power=100.0, min_rate=np.full(2, 0.02)),
    "floors out of reach": _batch(8, 30, 2, power=1.0, min_rate=np.full(2, 3.0)),
    "objects that come and go": _batch(
        9,
        30,
        3,
        active=np.array([[1, 1, 0], [0, 0, 0], [1, 1, 1], [0, 0, 1], [1, 0, 1], [1] * 3]) > 0,
    ),
    "the array's axis": _batch(10, 30, 1, angles=np.full((6, 1), np.pi / 2)),
    "nearly as many objects as antennas": _batch(
        11, 8, 6, power=10.0, coverage_halfwidths=np.radians(np.full((6, 6), 0.5))
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_both_ways_find_the_same_beams(name: str) -> None:
    batch = CASES[name]
    compiled, plain = solve_batch(batch, compiled=True), solve_batch(batch, compiled=False)
    np.testing.assert_array_equal(compiled.converged, plain.converged)
    np.testing.assert_array_equal(compiled.floors_infeasible, plain.floors_infeasible)
    np.testing.assert_allclose(compiled.objective, plain.objective, rtol=1e-7)
    np.testing.assert_allclose(compiled.floor_factor, plain.floor_factor, rtol=1e-7)
    # Where a matrix is hardly definite, rounding decides how a step is taken.
    assert np.median(np.abs(compiled.iterations - plain.iterations)) == 0.0
    for trial in np.flatnonzero(compiled.converged):
        if compiled.floors_infeasible[trial]:
            continue
        problem = batch.problem(trial)
        beams = compiled.beams[trial, batch.active[trial]]
        assert violation(problem, beams).largest <= FEASIBLE


def test_a_warm_start_ends_in_the_same_beams_sooner() -> None:
    batch = CASES["two objects"]
    cold = solve_batch(batch, compiled=True)
    warm = solve_batch(replace(batch, warm_start=cold.beams), compiled=True)
    np.testing.assert_allclose(warm.objective, cold.objective, rtol=1e-8)
    assert warm.iterations.sum() < cold.iterations.sum()
    unknown = np.full_like(cold.beams, np.nan)
    again = solve_batch(replace(batch, warm_start=unknown), compiled=True)
    np.testing.assert_array_equal(again.beams, cold.beams)


def test_a_trial_does_not_depend_on_the_others() -> None:
    batch = CASES["four objects"]
    together = solve_batch(batch, compiled=True)
    alone = solve_batch(batch.taken(np.array([4])), compiled=True)
    np.testing.assert_array_equal(alone.beams[0], together.beams[4])


@pytest.mark.parametrize("n_tx", [2, 7, 30])
def test_real_coordinates_are_those_of_the_reduction(n_tx: int) -> None:
    from echobeam.beamforming.direct.compiled import steering

    rng = np.random.default_rng(n_tx)
    vector, weights = np.empty(n_tx), np.empty(n_tx, dtype=complex)
    coordinates = rng.standard_normal(n_tx) + 1j * rng.standard_normal(n_tx)
    for phase in (0.0, 0.3, -2.5, np.pi):
        steering.fill_steering.py_func(phase, vector)
        expected = subspace.real_steering(np.array(phase), n_tx) / np.sqrt(n_tx)
        np.testing.assert_allclose(vector, expected, atol=1e-14)
    steering.to_antennas.py_func(coordinates, weights)
    np.testing.assert_allclose(weights, subspace.to_beams(coordinates), atol=1e-15)
    back = np.empty(n_tx, dtype=complex)
    steering.from_antennas.py_func(weights, back)
    np.testing.assert_allclose(back, coordinates, atol=1e-14)


@pytest.mark.parametrize(("count", "length"), [(3, 8), (8, 8), (9, 5)])
def test_householder_directions_are_orthonormal_and_span_the_rows(count: int, length: int) -> None:
    from echobeam.beamforming.direct.compiled import linear

    rows = np.random.default_rng(count).standard_normal((count, length))
    rows[1] = 2.0 * rows[0]  # Dependent rows leave arbitrary directions.
    basis = linear.orthonormal.py_func(rows.copy())
    size = min(count, length)
    np.testing.assert_allclose(basis @ basis.T, np.eye(size), atol=1e-13)
    np.testing.assert_allclose((rows[:size] @ basis.T) @ basis, rows[:size], atol=1e-12)


@pytest.fixture
def slow_compiler() -> Iterator[Any]:
    from echobeam.beamforming.direct.compiled import trials

    def run() -> None:
        time.sleep(0.2)

    before, trials.PATIENCE = trials.PATIENCE, 0.05
    yield trials._patient(run)
    trials.PATIENCE = before


def test_a_long_first_call_says_what_it_does(
    slow_compiler: Any, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, logger="echobeam"):
        slow_compiler()
        slow_compiler()
    assert [record.message for record in caplog.records] == [
        "compiling the beam solver; it is kept for later runs (about half a minute)"
    ]
