"""Geometry of a block of trials: own directions, covers, nodes, first points and starts.

Plain NumPy, for linear and for planar arrays; the compiled code knows phases and indices only.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.coverage import cover_lobes, cover_neighbours, coverage_steps
from echobeam.beamforming.ellipse import (
    EDGE_POINTS,
    disc_nodes,
    ellipse_grid,
    spread_points,
    square_root,
)
from echobeam.physics.array import LinearArray
from echobeam.physics.planar import AntennaArray, PlanarArray
from echobeam.values import Array, IntArray

WIDE = 2.0
"""Cover, in Nyquist lobes, from which on one node more is taken."""

EXTRA_NODES = 4

REMAINDER = 3e-4
"""Part of a steering vector that an ellipse's nodes may leave out: a beam has power there only at
the expense of its square. In 150 random problems up to two lobes the sum rate was at most 4e-8
lower than with a thousandth of it, and narrow covers took a third of the time."""

NARROW = 1.0
"""Cover of a planar array in Nyquist lobes up to which a small grid is imposed as a whole. Under
wider ones the starts led to worse beams so, by up to 5e-4 in 14 of 160 problems."""

LEAST_WIDTH = 0.5
"""Width in Nyquist lobes below which the chirp gets no slower."""

LOBE = 2.0 * np.pi


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """T trials with K objects each, d phases a direction, G grid points, and J nodes.

    Attributes
    ----------
    own
        ``(T, K, d)`` rad: phases of the objects' directions, of rows (planar arrays) and columns.
    grid
        ``(T, K, d, G)`` rad: phases of the full grid of (38f), a beam's own points first.
    count
        ``(T, K)``: number of a beam's own points.
    near
        ``(T or 1, K or 1, G, n)``: neighbours of each point; -1 for none.
    nodes
        ``(T, K, J, d)`` rad: phases whose steering vectors span a beam's cover, and one far off.
    first
        ``(T, K, m)``: indices of the grid points imposed first; the last ``spare`` are to spare.
    bow
        ``(T, K, d, m)`` rad: phases at those points of a chirp of rate one along each main axis.
    spare
        Number of points that may be replaced freely.
    """

    own: Array
    grid: Array
    count: IntArray
    near: IntArray
    nodes: Array
    first: IntArray
    bow: Array
    spare: int

    def taken(self, index: IntArray) -> Layout:
        """Return some of the trials."""
        return Layout(
            own=self.own[index],
            grid=self.grid[index],
            count=self.count[index],
            near=self.near if self.near.shape[:2] == (1, 1) else self.near[index],
            nodes=self.nodes[index],
            first=self.first[index],
            bow=self.bow[index],
            spare=self.spare,
        )

    def only(self, index: IntArray, objects: IntArray) -> Layout:
        """Return some of the trials with some of their objects, ``(J, k)``."""
        place = index[:, np.newaxis], objects
        shared = self.near.shape[:2] == (1, 1)
        return Layout(
            own=self.own[place],
            grid=self.grid[place],
            count=self.count[place],
            near=self.near if shared else self.near[place],
            nodes=self.nodes[place],
            first=self.first[place],
            bow=self.bow[place],
            spare=self.spare,
        )

    def step_work(self, n_tx: int, columns: int) -> float:
        """Return the multiplications of a Newton step on a trial: matrix and factor of each beam.

        Parameters
        ----------
        n_tx, columns
            N, and columns of a beam.
        """
        n_objects, rows = self.first.shape[1], self.first.shape[2] + self.first.shape[1] - 1
        size = 2.0 * columns * (min(n_tx, n_objects + self.nodes.shape[2]) - 1)
        return float(n_objects * (size**2 * rows + size**3 / 3.0))


def node_count(lobes: float) -> int:
    """Return how many nodes stand for a cover that is so many Nyquist lobes 2 pi / N wide."""
    count = math.ceil(lobes) + EXTRA_NODES
    return count + 1 if lobes > WIDE else count


def point_counts(nodes: int) -> tuple[int, int]:
    """Return how many points of an interval are imposed first, and how many are kept to spare.

    Over very wide covers a pattern touches its limits at so many places that too few spare points
    are passed from one to the other without end.
    """
    return max(2 * nodes + 1, 6 * nodes - 23), max(nodes + 1, 4 * nodes - 35)


def disc_degree(lobes: float) -> int:
    """Return the degree of the nodes that stand for an ellipse so many Nyquist lobes wide.

    The least at which Chebyshev's remainder of exp(j x) is below `REMAINDER`, x being the phase
    between the middle of cover and aperture and their ends; no more than a linear array takes.
    """
    phase, most = 0.25 * LOBE * lobes, node_count(lobes)
    for degree in range(1, most):
        rest = phase ** (degree + 1) / (2.0**degree * math.factorial(degree + 1))
        if rest <= REMAINDER:
            return degree
    return most


def layouts(
    array: AntennaArray, directions: Array, covers: Array, resolution: float
) -> Iterator[tuple[IntArray, Layout]]:
    """Give trials whose covers take equally many nodes and points, by index, with their layout.

    Parameters
    ----------
    array, directions, covers, resolution
        As in `cover_grid`, with ``(T, K)`` leading axes.
    """
    lobes = cover_lobes(array, directions, covers, resolution).max(axis=-1)
    planar = isinstance(array, PlanarArray)
    sizes = np.array([(disc_degree if planar else node_count)(lobe) for lobe in lobes.tolist()])
    for size in sorted(set(sizes.tolist())):
        which = np.flatnonzero(sizes == size)
        part = directions[which], covers[which], resolution, size
        if isinstance(array, PlanarArray):
            for index, layout in _planar(array, *part):
                yield which[index], layout
        else:
            yield which, _linear(array, *part)


def _phases(
    array: LinearArray, angles: Array, halfwidths: Array, resolution: float
) -> tuple[Array, IntArray]:
    """Return ``(T, K, G)`` rad, an object's own points first, and their number on either side."""
    reach = coverage_steps(halfwidths, resolution)
    offsets = np.arange(2 * int(reach.max(initial=0)) + 1) - reach[..., np.newaxis]
    offsets = np.minimum(offsets, reach[..., np.newaxis])
    return array.phase(angles[..., np.newaxis] + offsets * resolution), reach


def _ends(phases: Array) -> tuple[Array, Array]:
    return np.min(phases, axis=-1), np.max(phases, axis=-1)


def _linear(
    array: LinearArray, angles: Array, halfwidths: Array, resolution: float, nodes: int
) -> Layout:
    phases, reach = _phases(array, angles, halfwidths, resolution)
    low, high = (end[..., np.newaxis] for end in _ends(phases))
    middle = 0.5 * (low + high)
    site = 0.5 - 0.5 * np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
    site = (site - site[0]) / (site[-1] - site[0])
    count, spare = point_counts(nodes)
    centre = reach[..., np.newaxis]
    chosen = np.rint(centre * np.linspace(-1.0, 1.0, count)).astype(np.int64)
    chosen[..., 1:] = np.where(chosen[..., 1:] == chosen[..., :-1], 0, chosen[..., 1:])
    extra = np.zeros((*reach.shape, spare), dtype=np.int64)
    first = centre + np.concatenate([chosen, extra], axis=-1)
    own = array.phase(angles)[..., np.newaxis]
    imposed = np.take_along_axis(phases, first, axis=-1)
    width = np.maximum(high - low, LEAST_WIDTH * LOBE / array.n)
    bow = 0.5 * array.n / width * ((imposed - middle) ** 2 - (own - middle) ** 2)
    near = cover_neighbours(array, halfwidths[:1, :1], resolution, phases.shape[-1])
    return Layout(
        own=own,
        grid=phases[..., np.newaxis, :],
        count=2 * reach + 1,
        near=near,
        nodes=np.concatenate([low + (high - low) * site, middle + np.pi], axis=-1)[..., np.newaxis],
        first=first,
        bow=bow[..., np.newaxis, :],
        spare=spare,
    )


def _planar(
    array: PlanarArray, directions: Array, covers: Array, resolution: float, degree: int
) -> Iterator[tuple[IntArray, Layout]]:
    """Give trials with small grids by the size of these, and those with large ones together."""
    grid, mask = ellipse_grid(directions, covers, resolution)
    count = np.sum(mask, axis=-1)
    most = count.max(axis=-1)
    small = (most <= _imposed(degree)) & (degree <= node_count(NARROW))
    few = np.where(small, most, 0)
    for points in sorted(set(few.tolist())):
        which = np.flatnonzero(few == points)
        size = points or int(most[which].max())
        part = directions[which], covers[which], grid[which, :, :size], count[which]
        if points:
            first, spare = np.arange(size) * (np.arange(size) < part[3][..., np.newaxis]), 0
            near = np.empty((1, 1, size, 0), dtype=np.int64)
        else:
            first, spare = _some_points(*part[:3], degree)
            near = cover_neighbours(array, part[1], resolution, size)
        yield which, _over_disc(array, part, degree, (first, near, spare))


def _imposed(degree: int) -> int:
    """Return how many grid points of an ellipse are imposed at a time: those of `_some_points`."""
    return len(disc_nodes(2 * degree)) + len(disc_nodes(degree)) + 1


def _some_points(
    directions: Array, covers: Array, grid: Array, degree: int
) -> tuple[IntArray, int]:
    """Return the points of large grids that are imposed first, and how many are to spare."""
    first = spread_points(grid, directions, covers, 2 * degree)
    centre = spread_points(grid[..., EDGE_POINTS:, :], directions, covers, 0) + EDGE_POINTS
    spare = len(disc_nodes(degree)) + 1
    return np.concatenate([first, np.repeat(centre, spare, axis=-1)], axis=-1), spare


def _over_disc(
    array: PlanarArray,
    part: tuple[Array, Array, Array, IntArray],
    degree: int,
    points: tuple[IntArray, IntArray, int],
) -> Layout:
    """Return the layout of directions, covers, grid and its sizes, and of `Layout`'s points."""
    directions, covers, grid, count = part
    first, near, spare = points
    around = disc_nodes(degree) @ np.swapaxes(square_root(covers), -1, -2)
    nodes = array.phases(directions[..., np.newaxis, :] + around)
    own = array.phases(directions)
    imposed = np.take_along_axis(grid, first[..., np.newaxis], axis=-2)
    return Layout(
        own=own,
        grid=np.swapaxes(array.phases(grid), -1, -2),
        count=count,
        near=near,
        nodes=np.concatenate([nodes, own[..., np.newaxis, :] + np.pi], axis=-2),
        first=first,
        bow=_bow(array, imposed - directions[..., np.newaxis, :], covers),
        spare=spare,
    )


def _bow(array: PlanarArray, offsets: Array, covers: Array) -> Array:
    """Return the phases ``(..., 2, m)`` of chirps along the main axes of ellipses, in lobes.

    The gradient of the phase takes the ellipse to the aperture, as that of a linear array's chirp
    takes the interval to its length.
    """
    scale = LOBE * array.spacing * np.array(array.shape)
    squares, axes = np.linalg.eigh(covers * scale[:, np.newaxis] * scale)
    reach = np.maximum(np.sqrt(np.maximum(squares, 0.0)), 0.5 * LEAST_WIDTH * LOBE)
    along = (offsets * scale) @ axes
    return np.swapaxes(along**2 / (4.0 * reach[..., np.newaxis, :]), -1, -2)
