"""Beliefs about direction cosines, of tracks on the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.estimation.sigma_points import cubature_points, moments, principal_root, root
from echobeam.physics.plane import GroundGeometry
from echobeam.values import Array, Tracks, UavState

WIDEST = 0.5
"""Standard deviation of a direction cosine beyond which no belief is taken any wider."""


@dataclass(frozen=True, slots=True)
class CosineBelief:
    """Gaussian beliefs about where objects are as a planar array sees them.

    Attributes
    ----------
    mean
        ``(T, C, 2)``: u and v.
    axes
        ``(T, C, 2, 2)``: principal axes of their covariance by row, each as long as its deviation.
    distance
        ``(T, C)`` m: mean; infinite behind the array.
    stretch
        ``(T, C, 2)``: relative change of the distance with either cosine.
    """

    mean: Array
    axes: Array
    distance: Array
    stretch: Array


def cosine_belief(tracks: Tracks, geometry: GroundGeometry, uav: UavState) -> CosineBelief:
    """Return the beliefs of tracks in (x, y, v_x, v_y), with the moments of sigma points.

    Parameters
    ----------
    tracks
        ``(T, C)``.
    geometry
        Frame of the array.
    uav
        The UAV in the slot.
    """
    centre = geometry.place(tracks.mean, uav)[..., :3]
    with np.errstate(all="ignore"):  # columns without a track, and objects behind the array
        points = np.zeros((*tracks.known.shape, 4, 4))
        points[..., :2] = cubature_points(tracks.mean[..., :2], root(tracks.cov[..., :2, :2]))
        shift, cov = moments(geometry.place(points, uav)[..., :3] - centre[..., None, :])
        mean = centre + shift
        axes = principal_root(cov[..., :2, :2])
        length = np.sqrt(np.square(axes).sum(axis=-1, keepdims=True))
        unit = axes / np.where(length > 0.0, length, 1.0)
        along = (unit @ cov[..., :2, 2:])[..., 0] / np.square(length[..., 0])
        slope = (np.where(np.isfinite(along), along, 0.0)[..., None, :] @ unit)[..., 0, :]
        stretch = slope / mean[..., 2:]
    seen = np.isfinite(mean).all(axis=-1)
    return CosineBelief(
        mean[..., :2],
        unit * np.minimum(length, WIDEST),
        np.where(seen, mean[..., 2], centre[..., 2]),
        np.where(np.isfinite(stretch), stretch, 0.0),
    )
