from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct import cuts
from echobeam.beamforming.direct.barrier import Shapes
from echobeam.beamforming.direct.beams import BeamSet, beam_set, cover_phases
from echobeam.beamforming.direct.chirp import start_shapes
from echobeam.physics.array import LinearArray

ANGLES = np.radians([[75.0, 130.0]])
HALFWIDTHS = np.radians([[6.0, 4.0]])
RESOLUTION = np.radians(0.1)
N_TX, RIPPLE = 24, 2.0


def _beams() -> tuple[BeamSet, Shapes]:
    phases, mask = cover_phases(ANGLES, HALFWIDTHS, RESOLUTION, LinearArray(1))
    beams = beam_set(phases, mask, N_TX, np.full((1, 2), RIPPLE), 7)
    return beams, start_shapes(beams, 0.6)


def _pattern(weights: np.ndarray, angles: np.ndarray) -> np.ndarray:
    return np.asarray(np.abs(np.conj(LinearArray(N_TX).steering(angles)) @ weights) ** 2)


def test_grid_excess_is_that_of_the_steering_vectors() -> None:
    beams, shapes = _beams()
    weights = beams.lift(shapes.coordinates)
    excess = cuts.grid_excess(beams, weights)
    steps = np.arange(-60, 61)
    for beam in range(2):
        reach = round(float(HALFWIDTHS[0, beam] / RESOLUTION))
        angles = ANGLES[0, beam] + RESOLUTION * np.clip(steps, -reach, reach)
        angles = np.where(np.abs(steps) > reach, ANGLES[0, beam], angles)
        pattern = _pattern(weights[beam], angles)
        own = _pattern(weights[beam], ANGLES[0, beam])
        np.testing.assert_allclose(own, N_TX, rtol=1e-10)
        np.testing.assert_allclose(excess[:, beam], np.abs(pattern - own) / N_TX, atol=1e-10)


def test_relative_excess_is_zero_where_the_ripple_is_just_kept() -> None:
    beams, shapes = _beams()
    weights = beams.lift(shapes.coordinates)
    power = np.sum(np.abs(weights) ** 2, axis=1)
    expected = N_TX * cuts.grid_excess(beams, weights) / (RIPPLE * power) - 1.0
    np.testing.assert_allclose(cuts.relative_excess(beams, shapes), expected, atol=1e-10)


def test_points_that_are_missed_are_imposed_and_the_first_ones_stay() -> None:
    beams, shapes = _beams()
    before = beams.points.copy()
    excess = np.full((beams.phases.shape[1], 2), -0.9)
    excess[20, 0], excess[50, 1] = 0.3, 0.2
    cuts.impose(beams, shapes, excess)
    assert 20 in beams.points[0]
    assert 50 in beams.points[1]
    first = before.shape[1] - beams.spare
    np.testing.assert_array_equal(beams.points[:, :first], before[:, :first])


def test_a_first_point_gives_way_when_no_other_is_idle() -> None:
    beams, shapes = _beams()
    first = beams.points.shape[1] - beams.spare
    beams.points[:, first:] = np.arange(31, 31 + 2 * beams.spare, 2)
    excess = np.full((beams.phases.shape[1], 2), -0.9)
    excess[31 : 31 + 2 * beams.spare] = 0.0
    missed = next(point for point in range(5, 28) if point not in beams.points)
    excess[missed] = 0.5
    before = beams.points.copy()
    cuts.impose(beams, shapes, excess)
    assert np.any(beams.points[0] == missed)
    np.testing.assert_array_equal(beams.points[:, first:], before[:, first:])


def test_new_points_have_their_rows_and_room_in_the_ripple() -> None:
    beams, shapes = _beams()
    excess = cuts.relative_excess(beams, shapes)
    cuts.impose(beams, shapes, excess)
    imposed = np.take_along_axis(beams.phases, beams.points, axis=1)
    weights = beams.lift(shapes.coordinates)
    turns = np.exp(-1j * imposed[..., np.newaxis] * np.arange(N_TX))
    response = np.abs(np.einsum("sjn,sn->js", turns, weights)) ** 2 / N_TX
    found = np.sum(shapes.response[: shapes.cover] ** 2, axis=1)
    np.testing.assert_allclose(found, response, atol=1e-10)
    assert np.all(np.abs(found - 1.0) < shapes.ripple * shapes.power)


def test_patched_beams_keep_the_grid_and_the_gain() -> None:
    beams, shapes = _beams()
    excess = cuts.relative_excess(beams, shapes)
    weights, power = cuts.patched(beams, shapes, excess)
    np.testing.assert_allclose(np.sum(np.abs(weights) ** 2, axis=1), power, rtol=1e-12)
    left = N_TX * cuts.grid_excess(beams, weights) - RIPPLE * power
    assert left.max() <= 1e-6 * RIPPLE * power.max()
    for beam in range(2):
        np.testing.assert_allclose(_pattern(weights[beam], ANGLES[0, beam]), N_TX, rtol=1e-9)
