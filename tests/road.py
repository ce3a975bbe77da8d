"""Models for tests: position and velocity on the road, for a UAV that knows its height.

An object at ground level, y = z = 0, has two degrees of freedom. With the UAV's position known,
both angle and delay measure the same position, and a delay that is far more accurate than the
angle determines the angle too. The filter is the one of the paper's state; only its models differ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.physics.measurement import measure
from echobeam.physics.polar import POLAR, POLAR_MEASUREMENT
from echobeam.tracking.life import living
from echobeam.tracking.measurement import measurement_jacobian
from echobeam.tracking.polar import PolarMeasurement
from echobeam.values import Array, BoolArray, GaussianState, StateSpace, UavState


def _finite(state: Array) -> BoolArray:
    """Return ``(...)``: whether all components are finite."""
    return np.asarray(np.isfinite(state).all(axis=-1))


ROAD = StateSpace(names=("position", "velocity"), units=("m", "m/s"), angles=(), valid=_finite)
"""State of an object on the road: distance from the road's origin, and velocity along it."""


@dataclass(frozen=True, slots=True)
class RoadMotion:
    """Constant velocity along the road.

    Attributes
    ----------
    slot_duration
        DT, s.
    position_std, velocity_std
        Standard deviations of the process noise for each slot, m and m/s.
    """

    slot_duration: float
    position_std: float
    velocity_std: float

    @property
    def space(self) -> StateSpace:
        """Position and velocity on the road."""
        return ROAD

    def step(self, state: Array, uav: UavState) -> Array:
        """Return the state one slot later, x + v DT and v."""
        position = state[..., 0] + self.slot_duration * state[..., 1]
        return np.stack([position, state[..., 1]], axis=-1)

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return the constant Jacobian of the step, ``(..., K, 2, 2)``."""
        G = np.array([[1.0, self.slot_duration], [0.0, 1.0]])
        return np.broadcast_to(G, (*state.shape, 2))

    def noise(self) -> Array:
        """Return the covariance of the process noise, ``(2, 2)``."""
        noise: Array = np.diag(np.square([self.position_std, self.velocity_std]))
        return noise


@dataclass(frozen=True, slots=True)
class RoadMeasurement:
    """Angle, delay and Doppler of an object on the road, Eqs. (17)-(19) at `polar_mean`.

    Attributes
    ----------
    carrier
        f_c, Hz.
    """

    carrier: float

    @property
    def names(self) -> tuple[str, ...]:
        """Angle, delay, Doppler."""
        return POLAR_MEASUREMENT

    def expected(self, state: Array, uav: UavState) -> Array:
        """Return the measurement of a state without noise."""
        theta, d, v = np.moveaxis(polar_mean(state, uav), -1, 0)
        return measure(theta, d, v, uav.speed, uav.heading, self.carrier)

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return its Jacobian: H of Eq. (43) by the chain rule, ``(..., K, 3, 2)``."""
        polar = polar_mean(state, uav)
        H = measurement_jacobian(polar, uav.speed, uav.heading, self.carrier)
        theta_by_x, d_by_x = _by_position(polar)
        by_x = H[..., 0] * theta_by_x[..., None] + H[..., 1] * d_by_x[..., None]
        return np.stack([by_x, H[..., 2]], axis=-1)

    def residual(self, value: Array, expected: Array) -> Array:
        """Return measured minus expected, the angle wrapped to (-pi, pi]."""
        return PolarMeasurement(self.carrier).residual(value, expected)


def polar_mean(state: Array, uav: UavState) -> Array:
    """Return angle, distance and velocity of states on the road, ``(..., 3)`` rad, m, m/s.

    theta = atan2(h, x - x^u) and d is the length of the same vector.

    Parameters
    ----------
    state
        ``(..., 2)`` m, m/s; NaN gives NaN.
    uav
        The UAV in the slot, above the road.
    """
    x, h = state[..., 0] - uav.position[0], uav.position[2]
    return np.stack([np.arctan2(h, x), np.hypot(x, h), state[..., 1]], axis=-1)


def to_polar(state: GaussianState, uav: UavState) -> GaussianState:
    """Return the same belief in angle, distance and velocity, to first order.

    Its covariance is singular, of rank 2: where the height is known, angle and distance have one
    error between them. A density in the three components does not exist, nor its NEES; one that
    needs it adds the variance of the height.

    Parameters
    ----------
    state
        Belief ``(..., K, 2)`` in the space `ROAD`; an unknown object stays unknown.
    uav
        The UAV in the slot.
    """
    mean = polar_mean(state.mean, uav)
    with np.errstate(all="ignore"):  # a UAV on the ground over the object; given up below
        theta_by_x, d_by_x = _by_position(mean)
    one, none = np.ones_like(theta_by_x), np.zeros_like(theta_by_x)
    J = np.stack([np.stack([theta_by_x, d_by_x, none]), np.stack([none, none, one])])
    cov = np.einsum("ai...,...ab,bj...->...ij", J, state.cov, J)
    return living(mean, cov, state.known, POLAR)


def _by_position(polar: Array) -> tuple[Array, Array]:
    """Return the derivatives of angle and distance by the position on the road."""
    theta, d = polar[..., 0], polar[..., 1]
    return -np.sin(theta) / d, np.cos(theta)
