"""Covers of planar arrays against an enumeration of their points, one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from echobeam.beamforming.coverage import cover_grid, cover_lobes, cover_size, has_cover
from echobeam.beamforming.ellipse import (
    EDGE_POINTS,
    disc_nodes,
    ellipse_grid,
    ellipse_neighbours,
    ellipse_steps,
    spread_points,
    square_root,
)
from echobeam.physics.planar import PlanarArray

RESOLUTION = 0.02


def _ellipse(long: float, short: float, turn: float) -> np.ndarray:
    """Matrix of an ellipse from its half-axes and the angle of the longer one."""
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return np.asarray(axes @ np.diag([long**2, short**2]) @ axes.T)


ELLIPSES = {
    "a circle": _ellipse(0.1, 0.1, 0.0),
    "along u": _ellipse(0.15, 0.05, 0.0),
    "along v": _ellipse(0.05, 0.15, 0.0),
    "turned": _ellipse(0.17, 0.06, 0.7),
    "turned the other way": _ellipse(0.13, 0.03, -1.0),
    "thin": _ellipse(0.2, 0.002, 0.3),
    "smaller than a step": _ellipse(0.013, 0.007, 0.4),
    "reaching to lattice points": _ellipse(5 * RESOLUTION, 3 * RESOLUTION, 0.0),
}
CENTRE = np.array([0.21, -0.34])
DEGREES = range(13)


def _enumerated(cover: np.ndarray) -> list[tuple[int, int]]:
    """All lattice steps (i, j) in an ellipse, row by row; those on its edge are in it."""
    inverse, most = np.linalg.inv(cover), 30
    return [
        (i, j)
        for i in range(-most, most + 1)
        for j in range(-most, most + 1)
        if RESOLUTION**2 * np.array([i, j]) @ inverse @ np.array([i, j]) <= 1.0 + 1e-8
    ]


def _steps(grid: np.ndarray, centre: np.ndarray = CENTRE) -> list[tuple[int, int]]:
    steps = np.rint((grid - centre) / RESOLUTION)
    np.testing.assert_allclose(grid, centre + steps * RESOLUTION, atol=1e-12)
    return [(int(i), int(j)) for i, j in steps]


@pytest.mark.parametrize("name", ELLIPSES)
def test_the_grid_has_every_lattice_point_of_the_ellipse_row_by_row(name: str) -> None:
    grid, mask = ellipse_grid(CENTRE, ELLIPSES[name], RESOLUTION)
    assert mask.all()
    assert _steps(grid[EDGE_POINTS:]) == _enumerated(ELLIPSES[name])


@pytest.mark.parametrize("name", ELLIPSES)
def test_the_grid_has_24_points_of_the_edge_one_after_the_other(name: str) -> None:
    cover = ELLIPSES[name]
    grid, _ = ellipse_grid(CENTRE, cover, RESOLUTION)
    edge = grid[:EDGE_POINTS] - CENTRE
    assert EDGE_POINTS == 24
    on_edge = np.einsum("gi,ij,gj->g", edge, np.linalg.inv(cover), edge)
    np.testing.assert_allclose(on_edge, 1.0, rtol=1e-8)
    # Seen from where the ellipse is a circle, they are evenly spaced.
    circle = edge @ np.linalg.inv(np.linalg.cholesky(cover)).T
    turns = np.unwrap(np.arctan2(circle[:, 1], circle[:, 0]))
    np.testing.assert_allclose(np.diff(turns), 2.0 * np.pi / 24, rtol=1e-6)


@pytest.mark.parametrize("name", ELLIPSES)
def test_neighbours_are_those_before_and_after_on_the_edge_and_a_step_away_on_the_lattice(
    name: str,
) -> None:
    near = ellipse_neighbours(ELLIPSES[name], RESOLUTION)
    inside = _enumerated(ELLIPSES[name])
    place = {step: EDGE_POINTS + number for number, step in enumerate(inside)}
    assert near.shape == (EDGE_POINTS + len(inside), 4)
    for point in range(EDGE_POINTS):
        beside = {(point - 1) % EDGE_POINTS, (point + 1) % EDGE_POINTS}
        assert set(near[point].tolist()) - {-1} == beside
    for (i, j), point in place.items():
        beside = {(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)} & set(inside)
        found = near[point][near[point] >= 0].tolist()
        assert sorted(found) == sorted(place[step] for step in beside)


def test_members_of_a_batch_have_the_grid_and_the_neighbours_that_they_have_alone() -> None:
    covers = np.array([*ELLIPSES.values()]).reshape(2, 4, 2, 2).copy()
    covers[1, 2] = 0.0
    centres = np.random.default_rng(0).uniform(-0.5, 0.5, (2, 4, 2))
    grid, mask = ellipse_grid(centres, covers, RESOLUTION)
    near = ellipse_neighbours(covers, RESOLUTION)
    assert grid.shape == (*mask.shape, 2)
    assert near.shape == (*mask.shape, 4)
    for t in range(2):
        for k in range(4):
            own = int(mask[t, k].sum())
            alone, all_own = ellipse_grid(centres[t, k], covers[t, k], RESOLUTION)
            assert all_own.all()
            assert mask[t, k, :own].all()  # an ellipse's own points come first
            np.testing.assert_array_equal(grid[t, k, :own], alone)
            np.testing.assert_array_equal(near[t, k, :own], ellipse_neighbours(covers[t, k], 0.02))
            repeated = np.broadcast_to(centres[t, k], grid[t, k, own:].shape)
            np.testing.assert_array_equal(grid[t, k, own:], repeated)
    assert mask.all(axis=-1).any()


def test_a_cover_of_nothing_is_its_direction_alone() -> None:
    grid, mask = ellipse_grid(CENTRE, np.zeros((2, 2)), RESOLUTION)
    np.testing.assert_array_equal(grid, np.broadcast_to(CENTRE, (EDGE_POINTS + 1, 2)))
    assert mask.all()
    near = ellipse_neighbours(np.zeros((2, 2)), RESOLUTION)
    assert near.shape == (EDGE_POINTS + 1, 4)
    assert np.all(near[-1] == -1)


def test_nobodys_covers_have_an_empty_grid() -> None:
    grid, mask = ellipse_grid(np.zeros((0, 2)), np.zeros((0, 2, 2)), RESOLUTION)
    assert grid.shape == (0, EDGE_POINTS, 2)
    assert mask.shape == (0, EDGE_POINTS)


@pytest.mark.parametrize("name", ELLIPSES)
def test_the_root_is_the_triangular_one_of_cholesky(name: str) -> None:
    np.testing.assert_allclose(
        square_root(ELLIPSES[name]), np.linalg.cholesky(ELLIPSES[name]), atol=1e-12
    )


def test_the_root_of_nothing_is_nothing_and_that_of_a_line_is_a_line() -> None:
    line = np.array([[0.04, 0.02], [0.02, 0.01]])
    covers = np.stack([np.zeros((2, 2)), line, np.diag([0.0, 0.09]), ELLIPSES["turned"]])
    root = square_root(covers)
    np.testing.assert_allclose(root @ np.swapaxes(root, -1, -2), covers, atol=1e-15)
    assert not root[:, 0, 1].any()


@pytest.mark.parametrize("name", ELLIPSES)
def test_steps_reach_as_far_as_the_lattice_points_of_the_box_around_an_ellipse(name: str) -> None:
    reach = np.sqrt(np.diagonal(ELLIPSES[name]))
    turns = np.linspace(0.0, 2.0 * np.pi, 10_001)
    edge = np.linalg.cholesky(ELLIPSES[name]) @ np.stack([np.cos(turns), np.sin(turns)])
    np.testing.assert_allclose(edge.max(axis=1), reach, rtol=1e-6)
    steps = ellipse_steps(ELLIPSES[name], RESOLUTION)
    assert np.all(steps * RESOLUTION <= reach * (1.0 + 1e-8))
    assert np.all((steps + 1.0) * RESOLUTION > reach)
    assert np.all(np.abs(np.array(_enumerated(ELLIPSES[name]))).max(axis=0) <= steps)


def test_the_size_of_a_grid_is_not_less_than_its_points() -> None:
    array, covers = PlanarArray(4, 4), np.array([*ELLIPSES.values()])
    for cover in [*covers, np.zeros((2, 2))]:
        points = len(ellipse_grid(CENTRE, cover, RESOLUTION)[0])
        assert points <= cover_size(array, cover, RESOLUTION) < np.inf
    assert cover_size(array, covers, RESOLUTION) == max(
        cover_size(array, cover, RESOLUTION) for cover in covers
    )


def test_planar_arrays_have_ellipses_for_covers() -> None:
    array, covers = PlanarArray(4, 6), np.array([*ELLIPSES.values()])
    centres = np.broadcast_to(CENTRE, (len(covers), 2))
    found = cover_grid(array, centres, covers, RESOLUTION)
    for one, other in zip(found, ellipse_grid(centres, covers, RESOLUTION), strict=True):
        np.testing.assert_array_equal(one, other)
    assert has_cover(array, np.array([ELLIPSES["thin"], np.zeros((2, 2))])).tolist() == [
        True,
        False,
    ]


def test_lobes_are_the_phases_across_an_ellipse_over_those_of_one_lobe() -> None:
    array = PlanarArray(4, 6)
    # 0.3 x 0.1 full width: 2 pi 0.5 u turns rows by 4 times that, columns by 6 times.
    found = cover_lobes(array, CENTRE, _ellipse(0.15, 0.05, 0.0), RESOLUTION)
    np.testing.assert_allclose(found, max(4 * 0.5 * 0.3, 6 * 0.5 * 0.1))
    found = cover_lobes(array, CENTRE, _ellipse(0.15, 0.05, np.pi / 2), RESOLUTION)
    np.testing.assert_allclose(found, max(4 * 0.5 * 0.1, 6 * 0.5 * 0.3))


@pytest.mark.parametrize("degree", DEGREES)
def test_nodes_on_the_disc_determine_polynomials_of_their_degree(degree: int) -> None:
    nodes = disc_nodes(degree)
    terms = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    assert nodes.shape == (len(terms), 2)
    assert np.hypot(*nodes.T).max() <= 1.0 + 1e-12
    if degree:
        assert np.hypot(*nodes.T).max() == pytest.approx(1.0)

    def monomials(points: np.ndarray) -> np.ndarray:
        return np.stack([points[:, 0] ** i * points[:, 1] ** j for i, j in terms], axis=-1)

    assert np.linalg.matrix_rank(monomials(nodes)) == len(terms)
    # With a basis that is orthonormal on the disc, values at the nodes say it with few digits lost.
    lattice = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 61)] * 2), axis=-1).reshape(-1, 2)
    disc = lattice[np.hypot(*lattice.T) <= 1.0]
    _, mixed = np.linalg.qr(monomials(disc))
    assert np.linalg.cond(monomials(nodes) @ np.linalg.inv(mixed)) < 50.0


@pytest.mark.parametrize("degree", [0, 2, 5, 8])
@pytest.mark.parametrize("name", ELLIPSES)
def test_spread_points_are_the_grid_points_nearest_to_the_nodes(name: str, degree: int) -> None:
    cover = ELLIPSES[name]
    grid, _ = ellipse_grid(CENTRE, cover, RESOLUTION)
    found = spread_points(grid, CENTRE, cover, degree)
    wanted = CENTRE + disc_nodes(degree) @ np.linalg.cholesky(cover).T
    assert found.shape == (len(wanted),)
    for place, node in zip(found, wanted, strict=True):
        far = np.hypot(*(grid - node).T)
        assert far[place] == pytest.approx(far.min(), abs=1e-12)


def test_spread_points_of_a_batch_are_its_own_and_no_others() -> None:
    covers: Any = np.array([*ELLIPSES.values()])
    centres = np.random.default_rng(1).uniform(-0.5, 0.5, (len(covers), 2))
    grid, mask = ellipse_grid(centres, covers, RESOLUTION)
    found = spread_points(grid, centres, covers, 6)
    for k, cover in enumerate(covers):
        alone, _ = ellipse_grid(centres[k], cover, RESOLUTION)
        chosen = spread_points(alone, centres[k], cover, 6)
        np.testing.assert_allclose(grid[k, found[k]], alone[chosen], atol=1e-12)
        assert mask[k, found[k]].all()
