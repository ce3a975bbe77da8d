"""Report of a belief on the road: angle, distance and velocity with the moments of the belief."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.sigma_points import cubature_points, moments, root
from echobeam.physics.polar import POLAR, physical
from echobeam.tracking.ground import polar_of
from echobeam.tracking.road_shape import POINTS, Shape
from echobeam.values import Array, GaussianState, IntArray, Status, Tracks, UavState


def reported(
    state: GaussianState,
    uav: UavState,
    id: IntArray,
    shape: Shape | None = None,
    *,
    one_side: bool = False,
) -> Tracks:
    """Return a belief on the road as tracks in angle, distance and velocity.

    Mean and covariance are those of sigma points, so that they hold the altitude error and the
    bend of the coordinates. Those of a belief with a shape are sums over positions: two places,
    left and right of the UAV, are at one distance.

    Parameters
    ----------
    state
        ``(T, K)`` objects: x, v, any others, b; NaN where one is unknown.
    uav
        The UAV in the slot.
    id
        ``(T, K)``: identities.
    shape
        Shape of the position's density; None if all are Gaussian.
    one_side
        Whether a belief with a shape is reported on its likelier side of the UAV alone, what is on
        the other being mirrored there.
    """
    with np.errstate(invalid="ignore"):
        centre = polar_of(state.mean, uav)
        points = polar_of(cubature_points(state.mean, root(state.cov)), uav)
        shift, cov = moments(points - centre[..., None, :])
    mean = centre + shift
    if shape is not None:
        bent = state.known & shape.bent
        mean[bent], cov[bent] = _bent(state.mean[bent], state.cov[bent], shape[bent], uav, one_side)
    known = np.asarray(state.known & physical(mean))
    return Tracks(
        np.where(known[..., None], mean, np.nan),
        np.where(known[..., None, None], cov, np.nan),
        np.where(known, Status.CONFIRMED, 0).astype(np.int8),
        id,
    )


def _bent(
    mean: Array, cov: Array, shape: Shape, uav: UavState, one_side: bool
) -> tuple[Array, Array]:
    """Return the polar moments of ``M`` beliefs with a shape.

    Velocity and altitude error are Gaussian given the position, and taken to first order.
    """
    u = shape.reach[:, None] * np.linspace(-1.0, 1.0, POINTS)
    log = shape.log_ratio - 0.5 * u**2
    weight = np.exp(log - log.max(axis=-1, keepdims=True))
    weight /= weight.sum(axis=-1, keepdims=True)
    std = np.sqrt(cov[:, 0, 0])
    gain = cov[:, :, 0] / std[:, None]
    state = mean[:, None, :] + u[..., None] * gain[:, None, :]
    if one_side:
        off = state[..., 0] - uav.position[0]
        side = np.where((weight * (off > 0.0)).sum(axis=-1, keepdims=True) >= 0.5, 1.0, -1.0)
        state[..., 0] = uav.position[0] + side * np.abs(off)
    left = cov[:, 1:, 1:] - gain[:, 1:, None] * gain[:, None, 1:]
    seen = polar_of(state, uav)
    x, depth = state[..., 0] - uav.position[0], uav.position[2] + state[..., -1]
    effect = np.zeros((*seen.shape, left.shape[-1]))  # of velocity and altitude error
    effect[..., 0, -1], effect[..., 1, -1] = x / seen[..., 1] ** 2, depth / seen[..., 1]
    effect[..., POLAR.size - 1, 0] = 1.0
    centre = (weight[..., None] * seen).sum(axis=1)
    off = seen - centre[:, None, :]
    within = effect @ left[:, None] @ np.swapaxes(effect, -1, -2)
    outer = np.swapaxes(weight[..., None] * off, -1, -2) @ off
    return centre, outer + (weight[..., None, None] * within).sum(axis=1)
