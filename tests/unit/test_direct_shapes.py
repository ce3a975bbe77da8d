"""Starts, coverage grid and imposed points of one trial's beams."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from echobeam.beamforming import subspace
from echobeam.beamforming.coverage import cover_grid
from echobeam.beamforming.direct.batch import chirps
from echobeam.physics.array import LinearArray
from echobeam.physics.planar import AntennaArray, PlanarArray

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
EVEN = np.array([[0.6]])
"""Rate of a linear array's first chirp."""

LATER = 30
"""Index from which a point is taken that is not imposed at first."""


def _covers(halfwidths: Any, ripple: float, n_tx: int) -> Any:
    return _of(LinearArray(n_tx), ANGLES, np.radians(halfwidths), RESOLUTION, ripple)


def _of(
    array: AntennaArray, directions: np.ndarray, covers: np.ndarray, step: float, ripple: float
) -> Any:
    ((_, layout),) = direct.layout.layouts(array, directions[None], covers[None], step)
    return shapes.Covers(
        own=layout.own[0],
        nodes=layout.nodes[0],
        grid=layout.grid[0],
        points=layout.count[0],
        near=layout.near[0],
        first=layout.first[0],
        bow=layout.bow[0],
        spare=layout.spare,
        ripple=np.full(len(directions), ripple / array.elements),
        n_tx=array.elements,
        columns=array.shape[1],
    )


def _impose(covers: Any, made: Any, beam: int, excess: np.ndarray) -> Any:
    one = shapes.shape_of(made, beam)
    near = covers.near[min(beam, len(covers.near) - 1)]
    grid.exchange_points(one, excess, covers.spare, covers.grid[beam], near, covers.columns)
    return one


def _weights(covers: Any, made: Any, beam: int) -> np.ndarray:
    """Weights of all columns, one after the other."""
    columns = made.response.shape[1] // 2
    weights = np.empty(columns * covers.n_tx, dtype=complex)
    steering.lift(made.basis[beam], made.z[beam], weights)
    return weights


def _slacks(made: Any, beam: int) -> np.ndarray:
    one = shapes.shape_of(made, beam)
    below, above = np.empty(one.low.size), np.empty(one.low.size)
    allowed = one.scalars[shape.RIPPLE] * shape.power_of(one.z)
    shape.slacks(one.response, allowed, below, above)
    return np.concatenate([below, above])


def _excess(covers: Any, made: Any, beam: int) -> np.ndarray:
    excess = np.full(covers.grid.shape[2], np.nan)
    weights = np.empty(covers.n_tx * made.response.shape[1] // 2, dtype=complex)
    worst = shapes.excess_of(covers, made, beam, weights, excess)
    found = excess[: covers.points[beam]]
    assert worst == found.max()
    assert np.isnan(excess[covers.points[beam] :]).all()
    return np.asarray(found)


def _pattern(weights: np.ndarray, angles: np.ndarray) -> np.ndarray:
    steered = LinearArray(weights.size).steering(angles)
    return np.asarray(np.abs(np.conj(steered) @ weights) ** 2)


def _own_grid(covers: Any, beam: int) -> np.ndarray:
    reach = covers.points[beam] // 2
    return np.asarray(ANGLES[beam] + RESOLUTION * np.arange(-reach, reach + 1))


def test_every_start_leaves_slack_in_the_ripple_imposed() -> None:
    for chirp in chirps(LinearArray(30)):
        made = shapes.start_shapes(_covers([10.0, 10.0], 1.0, 30), chirp, NOBODY)
        for beam in range(2):
            assert _slacks(made, beam).min() > 0.0
            assert made.scalars[beam, shape.RIPPLE] >= made.scalars[beam, shape.TARGET]


def test_a_wide_start_is_complex_and_spreads_its_power() -> None:
    covers = _covers([10.0, 10.0], 1.0, 30)
    made = shapes.start_shapes(covers, EVEN, NOBODY)
    size = made.z.shape[1] // 2
    assert np.max(np.abs(made.z[:, size:])) > 0.1
    widest = _pattern(_weights(covers, made, 0), np.radians([66.0, 75.0, 84.0]))
    assert widest.min() > 0.1 * widest.max()


def test_where_the_cover_does_not_bind_the_start_is_the_matched_beam() -> None:
    covers = _covers([0.1, 0.1], 15.0, 30)
    made = shapes.start_shapes(covers, EVEN, NOBODY)
    assert not made.z.any()
    np.testing.assert_array_equal(made.scalars[:, shape.BARRIER], start.MATCHED_BARRIER)
    matched = LinearArray(30).steering(ANGLES[0]) / np.sqrt(30)
    np.testing.assert_allclose(np.abs(np.vdot(matched, _weights(covers, made, 0))), 1.0, rtol=1e-12)


def test_a_good_warm_start_is_taken_and_a_bad_one_is_not() -> None:
    covers = _covers([3.0, 3.0], 2.0, 30)
    cold = shapes.start_shapes(covers, EVEN, NOBODY)
    warm = np.array([_weights(covers, cold, beam) for beam in range(2)]) * np.exp(0.7j) * 5.0
    warm[1] = np.nan
    with np.errstate(invalid="ignore"):  # as the compiled solver is called
        made = shapes.start_shapes(covers, np.ones((1, 1)), warm)
    other = shapes.start_shapes(covers, np.ones((1, 1)), NOBODY)
    np.testing.assert_allclose(made.z[0], cold.z[0], atol=1e-9)
    np.testing.assert_array_equal(made.z[1], other.z[1])
    away = np.tile(LinearArray(30).steering(np.radians(20.0)), (2, 1))
    np.testing.assert_array_equal(shapes.start_shapes(covers, np.ones((1, 1)), away).z, other.z)


def _made() -> tuple[Any, Any]:
    covers = _covers([6.0, 4.0], 2.0, 24)
    return covers, shapes.start_shapes(covers, EVEN, NOBODY)


def test_the_excess_on_the_grid_is_that_of_the_steering_vectors() -> None:
    covers, made = _made()
    for beam in range(2):
        weights = _weights(covers, made, beam)
        own = _pattern(weights, ANGLES[beam])
        np.testing.assert_allclose(own, 24.0, rtol=1e-10)
        ripple = np.abs(_pattern(weights, _own_grid(covers, beam)) - own)
        expected = ripple / (2.0 * np.sum(np.abs(weights) ** 2)) - 1.0
        np.testing.assert_allclose(_excess(covers, made, beam), expected, atol=1e-10)


def test_points_that_are_missed_are_imposed_and_the_first_ones_stay() -> None:
    covers, made = _made()
    for beam, missed in ((0, 20), (1, 30)):
        before = made.points[beam].copy()
        excess = np.full(covers.points[beam], -0.9)
        excess[missed] = 0.3
        one = _impose(covers, made, beam, excess)
        assert missed in one.points
        kept = one.points.size - covers.spare
        np.testing.assert_array_equal(one.points[:kept], before[:kept])


def test_a_first_point_gives_way_when_no_other_is_idle() -> None:
    covers, made = _made()
    one, size = shapes.shape_of(made, 0), covers.grid.shape[2]
    assert covers.points[0] == size
    kept = one.points.size - covers.spare
    one.points[kept:] = np.arange(31, 31 + 2 * covers.spare, 2)
    excess = np.full(size, -0.9)
    excess[31 : 31 + 2 * covers.spare] = 0.0
    missed = next(point for point in range(5, 28) if point not in one.points)
    excess[missed] = 0.5
    before = one.points.copy()
    _impose(covers, made, 0, excess)
    assert missed in one.points[:kept]
    np.testing.assert_array_equal(one.points[kept:], before[kept:])


def test_new_points_have_their_rows_and_room_in_the_ripple() -> None:
    covers, made = _made()
    for beam in range(2):
        before = made.points[beam].copy()
        excess = _excess(covers, made, beam)
        missed = next(point for point in range(LATER, excess.size) if point not in before)
        excess[missed] = 0.3
        one = _impose(covers, made, beam, excess)
        assert missed in one.points
        weights = _weights(covers, made, beam)
        turns = np.exp(-1j * covers.grid[beam, 0, one.points][:, None] * np.arange(24))
        expected = np.abs(turns @ weights) ** 2 / 24
        found = np.sum(one.response[:, : one.low.size] ** 2, axis=0)
        np.testing.assert_allclose(found, expected, atol=1e-10)
        assert _slacks(made, beam).min() > 0.0


def test_patched_beams_keep_the_grid_and_the_gain() -> None:
    covers, made = _made()
    for beam in range(2):
        grid.repair_coverage(made.z[beam], _excess(covers, made, beam).max())
        assert _excess(covers, made, beam).max() <= 1e-6
        own = _pattern(_weights(covers, made, beam), ANGLES[beam])
        np.testing.assert_allclose(own, 24.0, rtol=1e-9)


DIRECTIONS = np.array([[0.1, 0.2], [-0.3, 0.4]])
ELLIPSES = np.array([[[0.03, 0.01], [0.01, 0.02]], [[0.008, 0.0], [0.0, 0.02]]])


def _planar(polarisations: int) -> tuple[PlanarArray, Any, Any]:
    array = PlanarArray(4, 5, polarisations=polarisations)
    covers = _of(array, DIRECTIONS, ELLIPSES, 0.03, 1.0)
    return array, covers, shapes.start_shapes(covers, chirps(array)[0], NOBODY)


def _own_pattern(array: PlanarArray, weights: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Power of all columns together, element by element."""
    total = np.zeros(len(directions))
    for column in weights.reshape(-1, array.elements):
        for place, (u, v) in enumerate(directions):
            phases = [np.pi * (i * u + j * v) for i in range(4) for j in range(5)]
            total[place] += abs(np.exp(-1j * np.array(phases)) @ column) ** 2
    return total


@pytest.mark.parametrize("polarisations", [1, 2])
def test_the_excess_over_an_ellipse_is_that_of_all_columns(polarisations: int) -> None:
    array, covers, made = _planar(polarisations)
    points, mask = cover_grid(array, DIRECTIONS, ELLIPSES, 0.03)
    for beam in range(2):
        weights = _weights(covers, made, beam)
        assert weights.size == array.n
        assert np.all(np.linalg.norm(weights.reshape(polarisations, -1), axis=1) > 0.01)
        own = _own_pattern(array, weights, DIRECTIONS[[beam]])
        np.testing.assert_allclose(own, 20.0, rtol=1e-10)
        ripple = np.abs(_own_pattern(array, weights, points[beam, mask[beam]]) - own)
        expected = ripple / np.sum(np.abs(weights) ** 2) - 1.0
        np.testing.assert_allclose(_excess(covers, made, beam), expected, atol=1e-10)


@pytest.mark.parametrize("polarisations", [1, 2])
def test_new_points_of_an_ellipse_have_their_rows_and_room_in_the_ripple(
    polarisations: int,
) -> None:
    array, covers, made = _planar(polarisations)
    points, _ = cover_grid(array, DIRECTIONS, ELLIPSES, 0.03)
    for beam in range(2):
        before = made.points[beam].copy()
        excess = _excess(covers, made, beam)
        missed = next(point for point in range(LATER, excess.size) if point not in before)
        excess[missed] = 0.3
        one = _impose(covers, made, beam, excess)
        assert missed in one.points
        weights = _weights(covers, made, beam)
        expected = _own_pattern(array, weights, points[beam, one.points]) / 20.0
        found = np.sum(one.response[:, : one.low.size] ** 2, axis=0)
        np.testing.assert_allclose(found, expected, atol=1e-10)
        assert _slacks(made, beam).min() > 0.0


@pytest.mark.parametrize("polarisations", [1, 2])
def test_a_warm_start_over_an_ellipse_is_taken_whatever_its_phase_and_polarisation(
    polarisations: int,
) -> None:
    array, covers, made = _planar(polarisations)
    rng = np.random.default_rng(2)
    turn, _ = np.linalg.qr(rng.normal(size=(polarisations, polarisations, 2)) @ [1.0, 1.0j])
    warm = np.stack([_weights(covers, made, beam) for beam in range(2)])
    turned = np.einsum("pq,bqn->bpn", turn, warm.reshape(2, polarisations, -1)).reshape(2, -1)
    again = shapes.start_shapes(covers, chirps(array)[1], 3.0 * turned)
    for beam in range(2):
        before, after = (_weights(covers, m, beam) for m in (made, again))
        assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before), rel=1e-9)
        points = DIRECTIONS[beam] + 0.3 * rng.uniform(-1.0, 1.0, (20, 2))
        np.testing.assert_allclose(
            _own_pattern(array, after, points), _own_pattern(array, before, points), atol=1e-8
        )


@pytest.mark.parametrize("n_tx", [2, 7, 30])
def test_real_coordinates_are_those_of_the_reduction(n_tx: int) -> None:
    rng = np.random.default_rng(n_tx)
    vector, weights = np.empty(n_tx), np.empty(n_tx, dtype=complex)
    coordinates = rng.standard_normal(n_tx) + 1j * rng.standard_normal(n_tx)
    for phase in (0.0, 0.3, -2.5, np.pi):
        steering.fill_steering(np.array([phase]), n_tx, vector)
        expected = subspace.real_steering(np.array([phase]), (1, n_tx)) / np.sqrt(n_tx)
        np.testing.assert_allclose(vector, expected, atol=1e-14)
    steering.to_antennas(coordinates, weights)
    np.testing.assert_allclose(weights, subspace.to_beams(coordinates), atol=1e-15)
    back = np.empty(n_tx, dtype=complex)
    steering.from_antennas(weights, back)
    np.testing.assert_allclose(back, coordinates, atol=1e-14)


@pytest.mark.parametrize("size", [(1, 6), (6, 1), (2, 2), (3, 3), (4, 5), (5, 4), (3, 7), (8, 8)])
def test_planar_steering_is_that_of_the_reduction(size: tuple[int, int]) -> None:
    vector = np.empty(size[0] * size[1])
    for phases in np.random.default_rng(3).uniform(-np.pi, np.pi, (5, 2)):
        steering.fill_steering(phases, size[1], vector)
        expected = subspace.real_steering(phases, size) / np.sqrt(vector.size)
        np.testing.assert_allclose(vector, expected, atol=1e-14)


@pytest.mark.parametrize("lobes", [0.1, 0.3, 0.55, 0.8])
def test_nodes_of_an_ellipse_span_the_steering_vectors_of_all_of_it(lobes):
    array, rng = PlanarArray(8, 8), np.random.default_rng(4)
    reach = lobes / (2.0 * array.spacing * array.rows)
    centre, cover = np.array([0.2, -0.3]), np.diag([reach, 0.7 * reach]) ** 2
    problem = array, centre[None, None], cover[None, None], 0.02
    ((_, layout),) = direct.layout.layouts(*problem)
    span = subspace.real_steering(layout.nodes[0, 0, :-1], array.shape)
    turn, radius = rng.uniform(0.0, 2.0 * np.pi, 400), np.sqrt(rng.uniform(0.0, 1.0, 400))
    inside = radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1) * [1.0, 0.7] * reach
    wanted = subspace.real_steering(array.phases(centre + inside), array.shape)
    basis = np.linalg.qr(span.T)[0]
    left = np.linalg.norm(wanted - (wanted @ basis) @ basis.T, axis=1)
    norm = np.linalg.norm(wanted, axis=1)
    assert np.max(left / norm) < 2.0 * direct.layout.REMAINDER  # two axes


@pytest.mark.parametrize(("halfwidth", "whole"), [(0.035, True), (0.3, False)])
def test_a_small_grid_is_imposed_as_a_whole_and_only_once(halfwidth, whole):
    array, cover = PlanarArray(8, 8), halfwidth**2 * np.eye(2)
    ((_, layout),) = direct.layout.layouts(array, np.zeros((1, 1, 2)), cover[None, None], 0.02)
    imposed = layout.first[0, 0]
    if whole:
        assert sorted(imposed) == list(range(layout.count[0, 0]))
        assert layout.spare == 0
    else:
        assert imposed.size < layout.count[0, 0]
        assert layout.spare > 0
