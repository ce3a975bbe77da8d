"""Where the coverage constraint (38f) holds: the grid of angles around each object."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, BoolArray, IntArray

WHOLE_MULTIPLE = 1e-9
"""A half-width this close (in steps) to a whole number of steps is not rounded up."""

MOST_STEPS = 2.0**53

POINTS_PER_LOBE = 4
"""Points kept per Nyquist lobe 2 pi / N of the phase: the pattern has no finer detail."""


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
