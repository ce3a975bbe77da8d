from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from echobeam.beamforming.ellipse import EDGE_POINTS, ellipse_grid
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation.model import (
    build_model,
    flattened,
    new_cuts,
    quadratic_forms,
    ripple_excess,
)
from echobeam.beamforming.relaxation.shape import best_shape
from echobeam.physics.planar import PlanarArray

DEG = np.pi / 180.0


def _beam(angle: float, halfwidth: float, ripple: float, n_tx: int):
    problem = BeamProblem(
        np.array([angle]) * DEG, [100.0], np.array([halfwidth]) * DEG, ripple, 0, 1, 1, n_tx
    )
    return build_model(problem).beams[0]


@pytest.mark.parametrize(
    ("angle", "halfwidth", "ripple", "n_tx"),
    [(75, 3, 2, 30), (135, 11, 3, 30), (60, 9, 3, 30), (85, 16, 3, 20), (30, 10, 0.3, 8)],
)
def test_best_shape_keeps_the_full_grid_and_is_proved_best(
    angle: float, halfwidth: float, ripple: float, n_tx: int
) -> None:
    beam = _beam(angle, halfwidth, ripple, n_tx)
    shape = best_shape(beam)
    assert np.trace(shape.covariance) == pytest.approx(1.0, rel=1e-9)
    assert np.linalg.eigvalsh(shape.covariance)[0] > -1e-9
    assert np.max(ripple_excess(beam, shape.covariance)) <= 2e-10
    assert shape.gain == pytest.approx(beam.own @ shape.covariance @ beam.own, rel=1e-12)
    assert shape.gain <= shape.bound <= shape.gain * (1 + 1e-7)
    assert 1.0 < shape.gain < n_tx


def test_matched_beam_is_best_where_coverage_asks_nothing() -> None:
    for halfwidth, ripple in ((0.0, 0.0), (0.3, 3.0)):
        shape = best_shape(_beam(75, halfwidth, ripple, 30))
        assert shape.gain == shape.bound == 30.0
        assert shape.solves == 0


def test_no_ripple_over_all_directions_leaves_one_antennas_gain() -> None:
    # A trigonometric polynomial that is constant on more points than it has zeros is constant.
    shape = best_shape(_beam(90, 90, 0.0, 4))
    assert shape.gain == pytest.approx(1.0, abs=1e-6)


def test_gain_grows_with_the_allowed_ripple_and_falls_with_the_cover() -> None:
    by_ripple = [best_shape(_beam(110, 5, ripple, 24)).gain for ripple in (0.1, 1, 3, 8)]
    assert by_ripple == sorted(by_ripple)
    by_cover = [best_shape(_beam(110, cover, 1, 24)).gain for cover in (8, 4, 2, 1)]
    assert by_cover == sorted(by_cover)


def test_flattening_brings_any_covariance_into_its_ripple_at_the_same_power() -> None:
    beam = _beam(140, 6, 0.4, 16)
    rng = np.random.default_rng(0)
    factor = rng.normal(size=(beam.size, 2)) + beam.own[:, np.newaxis]
    covariance = factor @ factor.T
    excess = ripple_excess(beam, covariance)
    assert excess.max() > 1
    flat = flattened(covariance, excess, beam.ripple)
    assert np.trace(flat) == pytest.approx(np.trace(covariance), rel=1e-12)
    assert ripple_excess(beam, flat).max() <= 2e-10


@dataclass
class _Near:
    """The part of a beam that cuts look at: the neighbours of its grid points."""

    near: np.ndarray


def test_cuts_are_the_peaks_above_the_tolerance_and_their_neighbours() -> None:
    excess = np.array([0.3, 0.1, 0.0, -1.0, 0.5, 0.6, 0.5, -1.0, 1e-12])
    place = np.arange(9)
    near = np.stack([place - 1, np.where(place < 8, place + 1, -1)], axis=-1)
    chosen = np.flatnonzero(new_cuts(_Near(near), excess, 1e-9))
    assert chosen.tolist() == [0, 1, 4, 5, 6]


def test_over_an_ellipse_a_peak_brings_its_neighbours_along_both_axes() -> None:
    cover = 0.0004 * np.array([[[4.0, 1.0], [1.0, 2.0]]])
    problem = BeamProblem(
        [[0.1, 0.2]], [100.0], cover, 0.5, 0, 1, 1, resolution=0.01, array=PlanarArray(4, 4)
    )
    beam = build_model(problem).beams[0]
    grid, mask = ellipse_grid(problem.angles, cover, 0.01)
    assert mask.all()
    points = np.rint((grid[0] - problem.angles) / 0.01).astype(int)
    lattice = {tuple(step): EDGE_POINTS + k for k, step in enumerate(points[EDGE_POINTS:].tolist())}
    excess = np.full(len(points), -1.0)
    excess[lattice[1, 0]], excess[lattice[2, 0]], excess[5] = 0.4, 0.3, 0.2
    chosen = set(np.flatnonzero(new_cuts(beam, excess, 1e-9)).tolist())
    around = {lattice[1 + i, j] for i, j in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))}
    assert chosen == around | {4, 5, 6}


def test_quadratic_forms_are_patterns() -> None:
    rng = np.random.default_rng(1)
    vectors, covariance = rng.normal(size=(3, 4)), np.diag([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(
        quadratic_forms(vectors, covariance), vectors**2 @ [1.0, 2.0, 3.0, 4.0]
    )
