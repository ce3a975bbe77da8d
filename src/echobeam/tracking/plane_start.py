"""The first state of an object on the ground, from its first measurement alone."""

from __future__ import annotations

import numpy as np

from echobeam.estimation import gaussian
from echobeam.physics.plane import GROUND, offset_of
from echobeam.tracking import ground_start
from echobeam.tracking.ground import GroundMeasurement
from echobeam.tracking.life import living
from echobeam.tracking.plane import PlaneMeasurement
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, BoolArray, GaussianState, IntArray, UavState

WEAK = 1e-6
"""Weight of the prior by which matrices can be inverted."""

LEAST = 1e-13
"""Least information along any axis over the whole: less is lost in rounding."""

STEPS = 5
"""Steps of Gauss and Newton from the position that the direction and the height give."""

AHEAD = 3.0
"""Standard deviations by which each step has to be in front of the array's plane: on that plane a
cosine may not change with the position, so that the steps stop there or go anywhere."""

POINTS = 32
"""Gaussians along each axis of the posterior that takes the place of such steps."""


def first_state(
    value: Array,
    variance: Array,
    model: PlaneMeasurement,
    uav: UavState,
    velocity_std: float,
) -> GaussianState:
    """Return the belief after a first measurement: the known height makes it overdetermined.

    Direction cosines and delay are three measurements of two coordinates. The position is their
    least-squares estimate, found by Gauss-Newton steps, with the covariance (H^T R^-1 H)^-1. The
    Doppler then updates a prior N(0, velocity_std^2) of both velocities.

    Where a step comes near the plane of the array, behind which there is no echo, and where an
    array of one row or column measures one cosine, mean and covariance are those of the posterior
    of `echobeam.tracking.ground_start`, before which every position in front of the array is as
    likely, for one cosine on one side of it.

    Parameters
    ----------
    value, variance
        ``(..., K, 4)``: measurement of every object, known or not. One without a direction or a
        delay is unknown.
    model
        The measurement model.
    uav
        The UAV in the slot of the measurement.
    velocity_std
        m/s, positive.
    """
    place = model.geometry.measured_place(value)
    distance, height = 0.5 * SPEED_OF_LIGHT * value[..., 2:3], uav.position[2]
    mean = np.zeros(value.shape)
    cov = np.zeros((*value.shape, 4))
    used = np.isfinite(value) & np.isfinite(variance)
    used[..., :2] &= variance[..., :2] < 1.0  # a cosine this uncertain may be any
    known: BoolArray = used[..., 2] & used[..., :2].any(axis=-1) & (distance[..., 0] > 0.0)
    weight = np.where(used, 1.0 / np.where(used, variance, 1.0), 0.0)
    weak = WEAK * _within_reach(distance, height)
    apart = known & ~used[..., :2].all(axis=-1)
    with np.errstate(all="ignore"):  # objects that were not measured
        mean[..., :2] = uav.position[:2] + _on_ground(model, place[..., :2], distance, height)
        for _ in range(STEPS):
            H = model.jacobian(mean, uav)[..., :3, :2]
            error = np.where(used, value - model.expected(mean, uav), 0.0)[..., :3]
            information, slope = _normal(H, weight[..., :3], error)
            least = LEAST * np.trace(information, axis1=-2, axis2=-1)[..., None]
            information[..., [0, 1], [0, 1]] += np.maximum(weak, least)
            cov[..., :2, :2] = np.linalg.inv(_safe(information, known))
            apart |= known & _near_plane(mean, cov, model, uav)
            mean[..., :2] += np.einsum("...ij,...j->...i", cov[..., :2, :2], slope)
            mean[..., :2] = _reachable(mean[..., :2], uav, distance)
        apart |= known & _near_plane(mean, cov, model, uav)
        cov[..., [2, 3], [2, 3]] = velocity_std**2
        doppler = slice(3, 4)
        innovation = model.residual(value, model.expected(mean, uav))
        H = model.jacobian(mean, uav)
        mean, cov = gaussian.update(
            mean, cov, innovation[..., doppler], H[..., doppler, :], variance[..., doppler]
        )
    value = np.where(used, value, np.nan)
    for some in _pieces(apart):
        mean[some], cov[some] = _posterior(value[some], variance[some], model, uav, velocity_std)
    return living(mean, cov, known, GROUND)


def _near_plane(mean: Array, cov: Array, model: PlaneMeasurement, uav: UavState) -> BoolArray:
    """Return whether positions are near the array's plane by their covariances, or behind it."""
    if model.geometry.normal is None:
        return np.zeros(mean.shape[:-1], dtype=bool)
    normal = np.array(model.geometry.normal)
    variance = np.einsum("i,...ij,j->...", normal[:2], cov[..., :2, :2], normal[:2])
    near: BoolArray = offset_of(mean, uav) @ normal <= AHEAD * np.sqrt(variance)
    return near


def _pieces(chosen: BoolArray) -> list[tuple[IntArray, ...]]:
    """Return the places where a mask is true, a few at a time: one posterior takes 1 MB."""
    places = np.nonzero(chosen)
    count = len(places[0])
    return [tuple(each[at : at + 256] for each in places) for at in range(0, count, 256)]


def _posterior(
    value: Array, variance: Array, model: PlaneMeasurement, uav: UavState, velocity_std: float
) -> tuple[Array, Array]:
    """Return mean ``(n, 4)`` and covariance of the posterior of measurements ``(n, 4)``."""
    geometry = model.geometry

    def law(state: Array) -> Array:
        stated = np.broadcast_to(variance[:, None, :], (*state.shape[:-1], variance.shape[-1]))
        if geometry.normal is None:
            return stated
        behind = offset_of(state, uav) @ np.array(geometry.normal) <= 0.0
        return np.where(behind[..., None], np.inf, stated)

    axes = geometry.along_rows, geometry.along_columns
    found = ground_start.first_state(
        value,
        variance,
        law,
        GroundMeasurement(model.carrier, 2, axes),
        uav,
        (velocity_std, velocity_std, 0.0),
        POINTS,
    )
    return found.mean[:, : GROUND.size], found.cov[:, : GROUND.size, : GROUND.size]


def _on_ground(model: PlaneMeasurement, cosines: Array, distance: Array, height: float) -> Array:
    """Return the offset on the ground, ``(..., 2)`` m, along the measured direction.

    It is as far as delay and height say, sqrt(d^2 - z^2), and at most twice the distance that the
    direction says.
    """
    along = model.geometry.sight(cosines)[..., :2] * distance
    length = np.sqrt(np.sum(along**2, axis=-1, keepdims=True))
    reach = np.sqrt(np.maximum(distance**2 - height**2, 0.0))
    scale = np.where(length > 0.0, reach / np.where(length > 0.0, length, 1.0), 0.0)
    offset: Array = along * np.minimum(scale, 2.0)
    return offset


def _within_reach(distance: Array, height: float) -> Array:
    """Return the information of a prior as wide as delay and height allow, ``(..., 1)`` 1/m^2."""
    square = np.where(np.isfinite(distance), distance**2, 1.0)
    return 1.0 / np.maximum(square - height**2, 1e-4 * square)


def _reachable(position: Array, uav: UavState, distance: Array) -> Array:
    """Return positions ``(..., 2)``, no farther from below the UAV than the delay says."""
    offset = position - uav.position[:2]
    length = np.sqrt(np.sum(offset**2, axis=-1, keepdims=True))
    beyond = length > distance
    scale = np.where(beyond, distance / np.where(beyond, length, 1.0), 1.0)
    reached: Array = uav.position[:2] + offset * scale
    return reached


def _normal(H: Array, weight: Array, error: Array) -> tuple[Array, Array]:
    """Return H^T R^-1 H and H^T R^-1 e."""
    weighted = H * weight[..., None]
    information = np.swapaxes(weighted, -1, -2) @ H
    return information, np.einsum("...mi,...m->...i", weighted, error)


def _safe(information: Array, known: BoolArray) -> Array:
    """Return matrices that can be inverted; those of unknown objects are the identity."""
    sound = known & np.asarray(np.isfinite(information).all(axis=(-2, -1)))
    return np.where(sound[..., None, None], information, np.eye(2))
