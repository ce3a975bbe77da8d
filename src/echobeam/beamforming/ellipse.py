"""Covers of planar arrays: ellipses in direction cosines, their grids, and nodes on the disc."""

from __future__ import annotations

from functools import cache

import numpy as np

from echobeam.values import Array, BoolArray, IntArray

EDGE_POINTS = 24
"""Points of the edge that belong to the grid."""

ON_EDGE = 1e-9
"""A lattice point this little outside, relative, counts as inside."""

RING = np.array([1.1565, -0.76535, 0.60517])
"""Coefficients of the rings' radii in terms of Chebyshev zeros, see `disc_nodes`."""


def square_root(covers: Array) -> Array:
    """Return the lower triangular L with C = L L^T of matrices C, ``(..., 2, 2)``; zero for zero.

    `numpy.linalg.cholesky` would refuse a cover that is one direction alone.
    """
    root = np.zeros(covers.shape)
    root[..., 0, 0] = np.sqrt(covers[..., 0, 0])
    some = root[..., 0, 0] > 0.0
    root[..., 1, 0] = covers[..., 1, 0] / np.where(some, root[..., 0, 0], 1.0)
    root[..., 1, 1] = np.sqrt(np.maximum(covers[..., 1, 1] - root[..., 1, 0] ** 2, 0.0))
    return root


def ellipse_steps(covers: Array, resolution: float) -> Array:
    """Return how many lattice steps the ellipses reach along each axis, ``(..., 2)``."""
    reach = np.sqrt(np.diagonal(covers, axis1=-2, axis2=-1))
    steps: Array = np.floor(reach / resolution * (1.0 + ON_EDGE))
    return steps


def ellipse_grid(directions: Array, covers: Array, resolution: float) -> tuple[Array, BoolArray]:
    """Return the points at which (38f) is imposed for elliptic covers.

    Parameters
    ----------
    directions
        ``(..., 2)``: centres, direction cosines.
    covers
        ``(..., 2, 2)``: matrices C of the ellipses x^T C^-1 x <= 1 around them.
    resolution
        Step of the square lattice.

    Returns
    -------
    grid, mask
        ``(..., G, 2)`` and ``(..., G)``: points of the edge, then those of the lattice, row by
        row; and which of them are an ellipse's own. The others, at the end, repeat its centre.
    """
    inside, steps = _lattice(covers, resolution)
    order = np.argsort(~inside, axis=-1, kind="stable")[..., : _most(inside)]
    own = np.take_along_axis(inside, order, axis=-1)
    edge = _circle() @ np.swapaxes(square_root(covers), -1, -2)
    lattice = np.where(own[..., np.newaxis], steps[order] * resolution, 0.0)
    grid = directions[..., np.newaxis, :] + np.concatenate([edge, lattice], axis=-2)
    mask = np.concatenate([np.ones((*own.shape[:-1], EDGE_POINTS), dtype=bool), own], axis=-1)
    return grid, mask


@cache
def _circle() -> Array:
    """Return the points of the unit circle that stand for an edge, ``(EDGE_POINTS, 2)``."""
    turns = 2.0 * np.pi * np.arange(EDGE_POINTS) / EDGE_POINTS
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    circle.flags.writeable = False
    return circle


def ellipse_neighbours(covers: Array, resolution: float) -> IntArray:
    """Return the neighbours of every point of `ellipse_grid`, ``(..., G, 4)``; -1 for none.

    Along the edge those before and after; on the lattice those a step away along either axis.
    """
    inside, steps = _lattice(covers, resolution)
    order = np.argsort(~inside, axis=-1, kind="stable")[..., : _most(inside)]
    place = np.where(inside, np.cumsum(inside, axis=-1) - 1 + EDGE_POINTS, -1)
    wide = int(steps[:, 1].max(initial=0.0)) * 2 + 1
    box = place.reshape(*place.shape[:-1], -1, wide)
    padded = np.pad(box, [(0, 0)] * (box.ndim - 2) + [(1, 1), (1, 1)], constant_values=-1)
    beside = [padded[..., :-2, 1:-1], padded[..., 2:, 1:-1]]
    beside += [padded[..., 1:-1, :-2], padded[..., 1:-1, 2:]]
    near = np.stack([np.take_along_axis(b.reshape(place.shape), order, -1) for b in beside], -1)
    edge = np.full((EDGE_POINTS, 4), -1)
    edge[:, 0] = (np.arange(EDGE_POINTS) - 1) % EDGE_POINTS
    edge[:, 1] = (np.arange(EDGE_POINTS) + 1) % EDGE_POINTS
    around = np.broadcast_to(edge, (*near.shape[:-2], EDGE_POINTS, 4))
    return np.concatenate([around, near], axis=-2)


def _lattice(covers: Array, resolution: float) -> tuple[BoolArray, Array]:
    """Return which points of one box of lattice steps lie inside, ``(..., A)``, and ``(A, 2)``."""
    most = ellipse_steps(covers, resolution).reshape(-1, 2).max(axis=0, initial=0.0)
    axes = [np.arange(-step, step + 1.0) for step in most]
    steps = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    root = square_root(covers)
    x = steps * resolution
    first, corner, second = (root[..., i, j, np.newaxis] for i, j in ((0, 0), (1, 0), (1, 1)))
    some = (first > 0.0) & (second > 0.0)
    along = x[:, 0] / np.where(some, first, 1.0)
    across = (x[:, 1] - corner * along) / np.where(some, second, 1.0)
    inside = np.where(some, along**2 + across**2 <= (1.0 + ON_EDGE) ** 2, ~steps.any(axis=-1))
    return inside, steps


def _most(inside: BoolArray) -> int:
    """Return the number of lattice points of the largest ellipse."""
    return int(inside.sum(axis=-1).max(initial=0))


@cache
def disc_nodes(degree: int) -> Array:
    """Return points of the unit disc on which polynomials of a total degree are well determined.

    Rings of 2 n + 1, 2 n - 3, ... points as in Ramos-Lopez et al., "Optimal sampling patterns for
    Zernike polynomials", Appl. Math. Comput. 274 (2016), scaled so that the outermost is the edge.

    Parameters
    ----------
    degree
        n, from 0.

    Returns
    -------
    Array
        ``((n + 1) (n + 2) / 2, 2)``, not to be written to.
    """
    rings = np.arange(1, degree // 2 + 2)
    zeros = np.cos((2 * rings - 1) * np.pi / (2 * (degree + 1)))
    radii = zeros * (RING[0] + zeros * (RING[1] + zeros * RING[2]))
    if degree > 0:
        radii = radii / radii[0]
    nodes = []
    for ring, radius in zip(rings.tolist(), radii.tolist(), strict=True):
        count = 2 * degree + 5 - 4 * ring
        turns = 2.0 * np.pi * np.arange(count) / count
        nodes.append(radius * np.stack([np.cos(turns), np.sin(turns)], axis=-1))
    found = np.concatenate(nodes)
    found.flags.writeable = False
    return found


def spread_points(grid: Array, directions: Array, covers: Array, degree: int) -> IntArray:
    """Return the grid points nearest to the nodes of a degree, ``(..., F)``; some may be the same.

    Parameters
    ----------
    grid
        ``(..., G, 2)``, of `ellipse_grid`.
    directions, covers
        As there.
    degree
        Of `disc_nodes`.
    """
    wanted = disc_nodes(degree) @ np.swapaxes(square_root(covers), -1, -2)
    apart = grid - directions[..., np.newaxis, :]
    far = np.sum((apart[..., np.newaxis, :, :] - wanted[..., np.newaxis, :]) ** 2, axis=-1)
    return np.asarray(np.argmin(far, axis=-1))
