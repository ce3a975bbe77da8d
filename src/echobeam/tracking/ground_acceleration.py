"""Motion on the ground with an acceleration in the state: (x, v, a, b), on a plane by axis.

A model of constant velocity has a place in the same state space, with the acceleration zero, so
that both can be mixed (`echobeam.tracking.interacting`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.tracking.ground import Axes, GroundMotion
from echobeam.values import Array, BoolArray, StateSpace, UavState


def _finite(state: Array) -> BoolArray:
    return np.asarray(np.isfinite(state).all(axis=-1))


ROAD_ACCELERATION = StateSpace(
    names=("x", "velocity", "acceleration", "altitude_error"),
    units=("m", "m/s", "m/s^2", "m"),
    angles=(),
    valid=_finite,
)
"""State of an object on one road."""

PLANE_ACCELERATION = StateSpace(
    names=(
        *("x", "y", "velocity_x", "velocity_y", "acceleration_x", "acceleration_y"),
        "altitude_error",
    ),
    units=("m", "m", "m/s", "m/s", "m/s^2", "m/s^2", "m"),
    angles=(),
    valid=_finite,
)
"""State of an object on a plane."""


def space_of(axes: Axes) -> StateSpace:
    """Return the state space with an acceleration for each axis."""
    return ROAD_ACCELERATION if axes == 1 else PLANE_ACCELERATION


@dataclass(frozen=True, slots=True)
class AcceleratedMotion:
    """Motion at constant acceleration, disturbed by a jerk that is constant in a slot.

    The jerk is white from slot to slot and changes the acceleration by `acceleration_std` in one,
    the velocity by half of that times DT and the position by a sixth times DT^2, fully correlated
    (Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
    2001, section 6.3). The altitude error does not change.

    Attributes
    ----------
    slot_duration
        DT, s.
    acceleration_std
        Standard deviation of the acceleration's change in a slot, m/s^2.
    axes
        Of the ground.
    """

    slot_duration: float
    acceleration_std: float
    axes: Axes = 1

    @property
    def space(self) -> StateSpace:
        """Position, velocity, acceleration, altitude error."""
        return space_of(self.axes)

    def step(self, state: Array, uav: UavState) -> Array:
        """Return the state one slot later; the UAV does not matter to the ground."""
        return np.asarray((self._transition() @ state[..., None])[..., 0])

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return G, the same for every state, ``(..., K, S, S)``."""
        return np.broadcast_to(self._transition(), (*state.shape, self.space.size))

    def noise(self) -> Array:
        """Return Q_s: what a random jerk does within a slot."""
        T = self.slot_duration
        return _scattered((T**2 / 6.0, T / 2.0, 1.0), self.acceleration_std, self.axes)

    def _transition(self) -> Array:
        T, G = self.slot_duration, np.eye(self.space.size)
        for axis in range(self.axes):
            x, v, a = axis, self.axes + axis, 2 * self.axes + axis
            G[x, v], G[x, a], G[v, a] = T, 0.5 * T**2, T
        return G


@dataclass(frozen=True, slots=True)
class UnacceleratedMotion:
    """Motion at constant velocity in the state space with an acceleration, which is zero after it.

    Attributes
    ----------
    motion
        The model of position, velocity and altitude error.
    """

    motion: GroundMotion

    @property
    def space(self) -> StateSpace:
        """Position, velocity, acceleration, altitude error."""
        return space_of(self.motion.axes)

    def step(self, state: Array, uav: UavState) -> Array:
        """Return the state one slot later, without an acceleration."""
        moved = state.copy()
        moved[..., self._kept] = self.motion.step(state[..., self._kept], uav)
        moved[..., 2 * self.motion.axes : -1] = 0.0
        return moved

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return G, the same for every state, ``(..., K, S, S)``."""
        inner = self.motion.jacobian(np.zeros(self.motion.space.size), uav)
        return np.broadcast_to(self._widened(inner), (*state.shape, self.space.size))

    def noise(self) -> Array:
        """Return Q_s of the model, without any on the acceleration."""
        return self._widened(self.motion.noise())

    @property
    def _kept(self) -> list[int]:
        return [*range(2 * self.motion.axes), self.space.size - 1]

    def _widened(self, matrix: Array) -> Array:
        wide = np.zeros((self.space.size, self.space.size))
        wide[np.ix_(self._kept, self._kept)] = matrix
        return wide


def _scattered(effect: tuple[float, float, float], std: float, axes: Axes) -> Array:
    """Return the covariance of an effect on position, velocity and acceleration of each axis."""
    size = 3 * axes + 1
    Q = np.zeros((size, size))
    for axis in range(axes):
        column = np.zeros(size)
        column[[axis, axes + axis, 2 * axes + axis]] = effect
        Q += std**2 * np.outer(column, column)
    return Q
