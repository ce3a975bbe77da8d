"""Covers of (38f): which directions a beam serves while the direction is uncertain."""

from __future__ import annotations

import numpy as np

from echobeam.physics.plane import GroundGeometry
from echobeam.schemes.base import System, View
from echobeam.values import Array, BoolArray, Tracks

THINNEST = 1e-3
"""Least half-axis of a cover in direction cosines."""


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
        ``(T, C)`` rad, l sigma_theta, or the matrices ``(T, C, 2, 2)`` of `ellipse`; and whether
        it is finite.
    """
    geometry = view.system.geometry
    if not isinstance(geometry, GroundGeometry):
        covered = halfwidth(tracks, spread, view.system)
        return covered, np.isfinite(covered)
    square = np.square(spread)[..., np.newaxis] * np.eye(2)
    if view.system.coverage.spread == "posterior":
        slope = geometry.cosine_jacobian(tracks.mean, view.uav)
        square = slope @ tracks.cov[..., :2, :2] @ np.swapaxes(slope, -1, -2)
    return ellipse(square, view.system)


def predicted_spread(mean: Array, cov: Array, view: View) -> Array:
    """Return the standard deviation of a belief's direction, as `echobeam.schemes.beamers.Aim`.

    Parameters
    ----------
    mean, cov
        ``(..., S)`` and ``(..., S, S)``.
    view
        The UAV's knowledge.
    """
    geometry = view.system.geometry
    if not isinstance(geometry, GroundGeometry):
        return np.asarray(np.sqrt(np.maximum(cov[..., 0, 0], 0.0)))
    slope = geometry.cosine_jacobian(mean, view.uav)
    square = np.einsum("...ij,...jk,...ik->...i", slope, cov[..., :2, :2], slope)
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def ellipse(square: Array, system: System) -> tuple[Array, BoolArray]:
    """Return the matrices C of the covers x^T C^-1 x <= 1, l^2 times a covariance.

    Half-axes are at most the sine of the widest coverage asked for, and at least a thousandth of
    a direction cosine. An axis along which the array has one element sees no difference: the cover
    is that thin there.

    Parameters
    ----------
    square
        ``(T, C, 2, 2)``: covariance of the direction cosines.
    system
        The UAV's equipment.
    """
    coverage, array = system.coverage, system.transmitter
    single = np.array(array.shape) == 1
    kept = ~(single[:, np.newaxis] | single)
    square = np.where(kept, square, 0.0)
    wanted = np.asarray(np.isfinite(square).all(axis=(-2, -1)))
    sound = np.where(wanted[..., np.newaxis, np.newaxis], coverage.width**2 * square, np.eye(2))
    values, vectors = np.linalg.eigh(sound)
    values = np.clip(values, THINNEST**2, np.sin(coverage.max_halfwidth) ** 2)
    covers = (vectors * values[..., np.newaxis, :]) @ np.swapaxes(vectors, -1, -2)
    return 0.5 * (covers + np.swapaxes(covers, -1, -2)), wanted


def halfwidth(prior: Tracks, spread: Array, system: System) -> Array:
    """Return ``(..., C)`` rad: l sigma_theta of (38f) of one angle."""
    coverage = system.coverage
    if coverage.spread == "posterior":
        spread = np.sqrt(np.maximum(prior.cov[..., 0, 0], 0.0))
    return np.minimum(coverage.width * spread, coverage.max_halfwidth)
