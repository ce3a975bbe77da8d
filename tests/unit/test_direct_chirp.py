from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct import barrier
from echobeam.beamforming.direct.beams import BeamSet, beam_set, cover_phases
from echobeam.beamforming.direct.chirp import CHIRPS, MATCHED_BARRIER, start_shapes
from echobeam.physics.array import LinearArray

N_TX = 30


def _beams(halfwidth: float, ripple: float) -> BeamSet:
    angles = np.radians([[70.0, 120.0], [85.0, 140.0]])
    halfwidths = np.full(angles.shape, np.radians(halfwidth))
    phases, mask = cover_phases(angles, halfwidths, np.radians(0.1), LinearArray(1))
    return beam_set(phases, mask, N_TX, np.full(angles.shape, ripple), 8)


def test_every_start_leaves_slack_in_the_ripple_imposed() -> None:
    for chirp in CHIRPS:
        shapes = start_shapes(_beams(10.0, 1.0), chirp)
        cover = shapes.response[: shapes.cover]
        below, above = barrier.slacks(cover, shapes.ripple, shapes.power)
        assert below.min() > 0.0
        assert above.min() > 0.0
        assert np.all(shapes.ripple >= shapes.target)


def test_a_wide_start_is_complex_and_spreads_its_power() -> None:
    beams = _beams(10.0, 1.0)
    shapes = start_shapes(beams, 0.6)
    assert np.max(np.abs(shapes.coordinates[1])) > 0.1
    weights = beams.lift(shapes.coordinates)
    widest = np.abs(
        np.conj(LinearArray(N_TX).steering(np.radians([60.0, 70.0, 80.0]))) @ weights[0]
    )
    assert widest.min() > 0.3 * widest.max()


def test_where_the_cover_does_not_bind_the_start_is_the_matched_beam() -> None:
    beams = _beams(0.1, 15.0)
    shapes = start_shapes(beams, 0.6)
    assert not shapes.coordinates.any()
    np.testing.assert_array_equal(shapes.barrier, MATCHED_BARRIER)
    weights = beams.lift(shapes.coordinates)
    matched = LinearArray(N_TX).steering(np.radians([70.0]))[0] / np.sqrt(N_TX)
    np.testing.assert_allclose(np.abs(np.vdot(matched, weights[0])), 1.0, rtol=1e-12)


def test_a_good_warm_start_is_taken_and_a_bad_one_is_not() -> None:
    beams = _beams(3.0, 2.0)
    cold = start_shapes(beams, 0.6)
    warm = beams.lift(cold.coordinates) * np.exp(0.7j) * 5.0
    warm[1:] = np.nan
    shapes = start_shapes(beams, 1.0, warm)
    other = start_shapes(beams, 1.0)
    np.testing.assert_allclose(shapes.coordinates[..., 0], cold.coordinates[..., 0], atol=1e-9)
    np.testing.assert_array_equal(shapes.coordinates[..., 1:], other.coordinates[..., 1:])
    away = np.tile(LinearArray(N_TX).steering(np.radians([20.0])), (4, 1))
    np.testing.assert_array_equal(start_shapes(beams, 1.0, away).coordinates, other.coordinates)
