"""Covers of (38f): which directions a beam serves while the direction is uncertain."""

from __future__ import annotations

import numpy as np

from echobeam.schemes.base import System, View
from echobeam.values import Array, BoolArray, Tracks


def cover_of(tracks: Tracks, spread: Array, view: View) -> tuple[Array, BoolArray]:
    """Return the cover of each track, at most the widest asked for, and where there is one.

    The paper's sigma_theta is the bound of the last measurement; ``coverage.spread =
    "posterior"`` takes the belief's own standard deviation instead.

    Parameters
    ----------
    tracks
        ``(T, C)``.
    spread
        Standard deviation of the last measured direction, see `echobeam.schemes.beamers.Aim`.
    view
        The UAV's knowledge.

    Returns
    -------
    covered, wanted
        ``(T, C)`` rad, l sigma_theta; and whether it is finite.
    """
    covered = halfwidth(tracks, spread, view.system)
    return covered, np.isfinite(covered)


def halfwidth(prior: Tracks, spread: Array, system: System) -> Array:
    """Return ``(..., C)`` rad: l sigma_theta of (38f) of one angle."""
    coverage = system.coverage
    if coverage.spread == "posterior":
        spread = np.sqrt(np.maximum(prior.cov[..., 0, 0], 0.0))
    return np.minimum(coverage.width * spread, coverage.max_halfwidth)
