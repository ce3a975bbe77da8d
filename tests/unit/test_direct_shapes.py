"""Starts, coverage grid and imposed points of one trial's beams."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from echobeam.beamforming import subspace
from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.direct.batch import CHIRPS
from echobeam.physics.array import LinearArray

from ..interpreted import interpreted

direct = interpreted()
grid, shape, shapes, start, steering = (
    direct.grid,
    direct.shape,
    direct.shapes,
    direct.start,
    direct.steering,
)
ANGLES = np.radians([75.0, 130.0])
RESOLUTION = np.radians(0.1)
NOBODY = np.empty((0, 0), dtype=complex)


def _covers(halfwidths: Any, ripple: float, n_tx: int, angles: np.ndarray = ANGLES) -> Any:
    points, mask = coverage_grid(angles, np.radians(halfwidths), RESOLUTION)
    phases = LinearArray(1).phase(points)
    reach = np.sum(mask, axis=-1) // 2
    return shapes.Covers(phases, reach, np.full(angles.size, ripple / n_tx))


def _weights(made: Any, beam: int) -> np.ndarray:
    weights = np.empty(made.basis.shape[-1], dtype=complex)
    steering.lift(made.basis[beam], made.z[beam], weights)
    return weights


def _slacks(made: Any, beam: int) -> np.ndarray:
    one = shapes.shape_of(made, beam)
    below, above = np.empty(one.low.size), np.empty(one.low.size)
    allowed = one.scalars[shape.RIPPLE] * shape.power_of(one.z)
    shape.slacks(one.response, allowed, below, above)
    return np.concatenate([below, above])


def _excess(covers: Any, made: Any, beam: int) -> np.ndarray:
    excess = np.full(covers.phases.shape[1], np.nan)
    weights = np.empty(made.basis.shape[-1], dtype=complex)
    worst = shapes.excess_of(covers, made, beam, weights, excess)
    found = excess[: 2 * covers.reach[beam] + 1]
    assert worst == found.max()
    return np.asarray(found)


def _pattern(weights: np.ndarray, angles: np.ndarray) -> np.ndarray:
    steered = LinearArray(weights.size).steering(angles)
    return np.asarray(np.abs(np.conj(steered) @ weights) ** 2)


def _own_grid(covers: Any, beam: int) -> np.ndarray:
    reach = covers.reach[beam]
    return np.asarray(ANGLES[beam] + RESOLUTION * np.arange(-reach, reach + 1))


def test_every_start_leaves_slack_in_the_ripple_imposed() -> None:
    for chirp in CHIRPS:
        made = shapes.set_out(_covers([10.0, 10.0], 1.0, 30), 30, chirp, NOBODY)
        for beam in range(2):
            assert _slacks(made, beam).min() > 0.0
            assert made.scalars[beam, shape.RIPPLE] >= made.scalars[beam, shape.TARGET]


def test_a_wide_start_is_complex_and_spreads_its_power() -> None:
    made = shapes.set_out(_covers([10.0, 10.0], 1.0, 30), 30, 0.6, NOBODY)
    size = made.z.shape[1] // 2
    assert np.max(np.abs(made.z[:, size:])) > 0.1
    widest = _pattern(_weights(made, 0), np.radians([66.0, 75.0, 84.0]))
    assert widest.min() > 0.1 * widest.max()


def test_where_the_cover_does_not_bind_the_start_is_the_matched_beam() -> None:
    made = shapes.set_out(_covers([0.1, 0.1], 15.0, 30), 30, 0.6, NOBODY)
    assert not made.z.any()
    np.testing.assert_array_equal(made.scalars[:, shape.BARRIER], start.MATCHED_BARRIER)
    matched = LinearArray(30).steering(ANGLES[0]) / np.sqrt(30)
    np.testing.assert_allclose(np.abs(np.vdot(matched, _weights(made, 0))), 1.0, rtol=1e-12)


def test_a_good_warm_start_is_taken_and_a_bad_one_is_not() -> None:
    covers = _covers([3.0, 3.0], 2.0, 30)
    cold = shapes.set_out(covers, 30, 0.6, NOBODY)
    warm = np.array([_weights(cold, beam) for beam in range(2)]) * np.exp(0.7j) * 5.0
    warm[1] = np.nan
    made, other = (shapes.set_out(covers, 30, 1.0, given) for given in (warm, NOBODY))
    np.testing.assert_allclose(made.z[0], cold.z[0], atol=1e-9)
    np.testing.assert_array_equal(made.z[1], other.z[1])
    away = np.tile(LinearArray(30).steering(np.radians(20.0)), (2, 1))
    np.testing.assert_array_equal(shapes.set_out(covers, 30, 1.0, away).z, other.z)


def _made() -> tuple[Any, Any]:
    covers = _covers([6.0, 4.0], 2.0, 24)
    return covers, shapes.set_out(covers, 24, 0.6, NOBODY)


def test_the_excess_on_the_grid_is_that_of_the_steering_vectors() -> None:
    covers, made = _made()
    for beam in range(2):
        weights = _weights(made, beam)
        own = _pattern(weights, ANGLES[beam])
        np.testing.assert_allclose(own, 24.0, rtol=1e-10)
        ripple = np.abs(_pattern(weights, _own_grid(covers, beam)) - own)
        expected = ripple / (2.0 * np.sum(np.abs(weights) ** 2)) - 1.0
        np.testing.assert_allclose(_excess(covers, made, beam), expected, atol=1e-10)


def test_points_that_are_missed_are_imposed_and_the_first_ones_stay() -> None:
    covers, made = _made()
    size = covers.phases.shape[1]
    for beam, missed in ((0, 20), (1, 30)):
        one = shapes.shape_of(made, beam)
        reach, before = covers.reach[beam], one.points.copy()
        excess = np.full(2 * reach + 1, -0.9)
        excess[missed] = 0.3
        first = size // 2 - reach
        grid.impose(one, excess, first, made.spare, covers.phases[beam])
        assert first + missed in one.points
        kept = one.points.size - made.spare
        np.testing.assert_array_equal(one.points[:kept], before[:kept])


def test_a_first_point_gives_way_when_no_other_is_idle() -> None:
    covers, made = _made()
    one, size = shapes.shape_of(made, 0), covers.phases.shape[1]
    kept = one.points.size - made.spare
    one.points[kept:] = np.arange(31, 31 + 2 * made.spare, 2)
    excess = np.full(size, -0.9)
    excess[31 : 31 + 2 * made.spare] = 0.0
    missed = next(point for point in range(5, 28) if point not in one.points)
    excess[missed] = 0.5
    before = one.points.copy()
    assert covers.reach[0] == size // 2
    grid.impose(one, excess, 0, made.spare, covers.phases[0])
    assert missed in one.points[:kept]
    np.testing.assert_array_equal(one.points[kept:], before[kept:])


def test_new_points_have_their_rows_and_room_in_the_ripple() -> None:
    covers, made = _made()
    size = covers.phases.shape[1]
    for beam in range(2):
        one, excess = shapes.shape_of(made, beam), _excess(covers, made, beam)
        first = size // 2 - covers.reach[beam]
        grid.impose(one, excess, first, made.spare, covers.phases[beam])
        weights = _weights(made, beam)
        turns = np.exp(-1j * covers.phases[beam, one.points][:, None] * np.arange(24))
        expected = np.abs(turns @ weights) ** 2 / 24
        found = np.sum(one.response[:, : one.low.size] ** 2, axis=0)
        np.testing.assert_allclose(found, expected, atol=1e-10)
        assert _slacks(made, beam).min() > 0.0


def test_patched_beams_keep_the_grid_and_the_gain() -> None:
    covers, made = _made()
    for beam in range(2):
        grid.patch(made.z[beam], _excess(covers, made, beam).max())
        assert _excess(covers, made, beam).max() <= 1e-6
        own = _pattern(_weights(made, beam), ANGLES[beam])
        np.testing.assert_allclose(own, 24.0, rtol=1e-9)


@pytest.mark.parametrize("n_tx", [2, 7, 30])
def test_real_coordinates_are_those_of_the_reduction(n_tx: int) -> None:
    rng = np.random.default_rng(n_tx)
    vector, weights = np.empty(n_tx), np.empty(n_tx, dtype=complex)
    coordinates = rng.standard_normal(n_tx) + 1j * rng.standard_normal(n_tx)
    for phase in (0.0, 0.3, -2.5, np.pi):
        steering.fill_steering(phase, vector)
        expected = subspace.real_steering(np.array(phase), n_tx) / np.sqrt(n_tx)
        np.testing.assert_allclose(vector, expected, atol=1e-14)
    steering.to_antennas(coordinates, weights)
    np.testing.assert_allclose(weights, subspace.to_beams(coordinates), atol=1e-15)
    back = np.empty(n_tx, dtype=complex)
    steering.from_antennas(weights, back)
    np.testing.assert_allclose(back, coordinates, atol=1e-14)
