"""Where the coverage constraint (38f) holds: the grid of angles around each object."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.ellipse import (
    EDGE_POINTS,
    ellipse_grid,
    ellipse_neighbours,
    ellipse_steps,
)
from echobeam.physics.planar import AntennaArray, PlanarArray
from echobeam.values import Array, BoolArray, IntArray

WHOLE_MULTIPLE = 1e-9
"""A half-width this close (in steps) to a whole number of steps is not rounded up."""

MOST_STEPS = 2.0**53

POINTS_PER_LOBE = 4
"""Points kept per Nyquist lobe 2 pi / N of the phase: the pattern has no finer detail."""


def cover_grid(
    array: AntennaArray, directions: Array, covers: Array, resolution: float
) -> tuple[Array, BoolArray]:
    """Return the directions at which (38f) is imposed, for either kind of array.

    Parameters
    ----------
    array
        The transmit array.
    directions, covers
        ``(...)`` and ``(...)`` rad for a linear array, see `coverage_grid`; ``(..., 2)`` and
        ``(..., 2, 2)`` direction cosines for a planar one, see `ellipse.ellipse_grid`.
    resolution
        Step of the grid, rad or direction cosine.

    Returns
    -------
    grid, mask
        ``(..., G)`` or ``(..., G, 2)``; and ``(..., G)``: points of an object's own cover.
    """
    if isinstance(array, PlanarArray):
        return ellipse_grid(directions, covers, resolution)
    return coverage_grid(directions, covers, resolution)


def has_cover(array: AntennaArray, covers: Array) -> BoolArray:
    """Return which covers, as in `cover_grid`, are more than one direction, ``(...)``."""
    return np.asarray(covers > 0.0 if array.axes == 1 else np.any(covers != 0.0, axis=(-2, -1)))


def cover_points(array: AntennaArray, covers: Array, resolution: float) -> Array:
    """Return about how many grid points each cover takes, ``(...)``, without making them.

    Parameters
    ----------
    array, covers, resolution
        As in `cover_grid`.
    """
    if isinstance(array, PlanarArray):
        steps = ellipse_steps(covers, resolution)
        return np.asarray(np.prod(2.0 * steps + 1.0, axis=-1) + EDGE_POINTS)
    return np.asarray(2.0 * coverage_steps(covers, resolution) + 1.0, dtype=np.float64)


def cover_size(array: AntennaArray, covers: Array, resolution: float) -> float:
    """Return the largest of `cover_points`; 1 if there are no covers."""
    return float(np.max(cover_points(array, covers, resolution), initial=1.0))


def cover_lobes(array: AntennaArray, directions: Array, covers: Array, resolution: float) -> Array:
    """Return how many Nyquist lobes 2 pi / N each cover is wide, ``(...)``, along its longer axis.

    Parameters
    ----------
    array, directions, covers, resolution
        As in `cover_grid`.
    """
    if isinstance(array, PlanarArray):
        reach = np.sqrt(np.diagonal(covers, axis1=-2, axis2=-1))
        longest: Array = np.max(2.0 * reach * array.spacing * np.array(array.shape), axis=-1)
        return longest
    grid, mask = coverage_grid(directions, covers, resolution)
    phases = array.phase(grid)
    high = np.max(phases, axis=-1, where=mask, initial=-np.inf)
    low = np.min(phases, axis=-1, where=mask, initial=np.inf)
    return np.asarray((high - low) * array.n / (2.0 * np.pi))


def cover_neighbours(
    array: AntennaArray, covers: Array, resolution: float, points: int
) -> IntArray:
    """Return the neighbours of each point of `cover_grid`, ``(..., G, n)``; -1 for none.

    Parameters
    ----------
    array, covers, resolution
        As in `cover_grid`.
    points
        G.
    """
    if isinstance(array, PlanarArray):
        return ellipse_neighbours(covers, resolution)
    place = np.arange(points)
    after = np.where(place + 1 < points, place + 1, -1)
    return np.broadcast_to(np.stack([place - 1, after], axis=-1), (*covers.shape, points, 2))


def coverage_steps(halfwidths: Array, resolution: float) -> IntArray:
    """Return how many grid steps a half-width takes, rounded outward, Eq. (38f).

    Parameters
    ----------
    halfwidths
        ``(...)`` rad: l sigma_theta.
    resolution
        rad: step of the grid.
    """
    steps = np.ceil(np.asarray(halfwidths) / resolution - WHOLE_MULTIPLE)
    return np.clip(steps, 0.0, MOST_STEPS).astype(np.int64)


def coverage_grid(angles: Array, halfwidths: Array, resolution: float) -> tuple[Array, BoolArray]:
    """Return the angles theta_k + j resolution, |j| <= ceil(halfwidth / resolution), of (38f).

    Parameters
    ----------
    angles, halfwidths
        ``(...)`` rad: centre and half-width of each object's cover.
    resolution
        rad: step of the grid.

    Returns
    -------
    grid, mask
        ``(..., G)`` each, G = 2 J + 1 for the widest cover: the angles, rad, with the centre at
        index J, and which of them belong to the object's own cover. Those that do not lie in the
        same row repeat the centre.
    """
    steps = coverage_steps(halfwidths, resolution)
    widest = int(steps.max(initial=0))
    offsets = np.arange(-widest, widest + 1)
    mask = np.abs(offsets) <= steps[..., np.newaxis]
    grid = np.asarray(angles)[..., np.newaxis] + np.where(mask, offsets * resolution, 0.0)
    return grid, mask


def sparse_cover(
    phases: Array, mask: BoolArray, n_tx: int, per_lobe: int = POINTS_PER_LOBE
) -> BoolArray:
    """Select a few grid points per Nyquist lobe and the ends: a start for cuts.

    Parameters
    ----------
    phases
        ``(..., G)`` rad: phase step between neighbouring antennas at each grid angle.
    mask
        ``(..., G)``: the points of the cover.
    n_tx
        N, number of antennas.
    per_lobe
        Points per Nyquist lobe 2 pi / N of the phase.

    Returns
    -------
    BoolArray
        ``(..., G)``, a part of ``mask``; always with the ends of the cover, and with the extremes
        of the phase, which lie inside where the cover crosses the array's axis.
    """
    cell = np.floor(phases * (per_lobe * n_tx / (2.0 * np.pi)))
    chosen = np.zeros(mask.shape, dtype=bool)
    chosen[..., 1:] = cell[..., 1:] != cell[..., :-1]
    before = np.zeros(mask.shape, dtype=bool)
    before[..., 1:] = mask[..., :-1]
    after = np.zeros(mask.shape, dtype=bool)
    after[..., :-1] = mask[..., 1:]
    chosen |= ~before | ~after
    for extreme in (
        np.argmax(np.where(mask, phases, -np.inf), axis=-1),
        np.argmin(np.where(mask, phases, np.inf), axis=-1),
    ):
        np.put_along_axis(chosen, extreme[..., np.newaxis], True, axis=-1)
    return chosen & mask
