"""Models of the ground's geometry for the extended Kalman filter: x, y and their velocities.

The height of the UAV over the ground is taken as known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.physics.plane import GROUND, GroundGeometry, approach, offset_of
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, StateSpace, UavState


@dataclass(frozen=True, slots=True)
class PlaneMotion:
    """Motion at constant velocity, disturbed by an acceleration that is constant in a slot.

    As `echobeam.tracking.ground.GroundMotion`, without the altitude error.

    Attributes
    ----------
    slot_duration
        DT, s.
    velocity_std
        Standard deviation of the change of either velocity in a slot, m/s.
    """

    slot_duration: float
    velocity_std: float

    @property
    def space(self) -> StateSpace:
        """Position and velocity."""
        return GROUND

    def step(self, state: Array, uav: UavState) -> Array:
        """Return the state one slot later; the UAV does not matter to the ground."""
        moved = state.copy()
        moved[..., :2] += self.slot_duration * state[..., 2:]
        return moved

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return G, the same for every state, ``(..., K, 4, 4)``."""
        G = np.eye(4)
        G[0, 2] = G[1, 3] = self.slot_duration
        return np.broadcast_to(G, (*state.shape, 4))

    def noise(self) -> Array:
        """Return Q_s: what a random acceleration does within a slot."""
        effect = np.array([0.5 * self.slot_duration, 1.0])
        per_axis = self.velocity_std**2 * np.outer(effect, effect)
        return np.asarray(np.kron(per_axis, np.eye(2)), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class PlaneMeasurement:
    """Measurement of two direction cosines, delay and Doppler.

    Attributes
    ----------
    geometry
        Frame of the array.
    carrier
        f_c, Hz.
    """

    geometry: GroundGeometry
    carrier: float

    @property
    def names(self) -> tuple[str, ...]:
        """Direction cosines, delay, Doppler."""
        return self.geometry.measurement

    def expected(self, state: Array, uav: UavState) -> Array:
        """Return the measurement ``(..., 4)`` of a state, without noise."""
        return self.geometry.ideal(state, uav, self.carrier)

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return H, ``(..., 4, 4)``.

        With r the vector to the object, d its length, s = r / d and w the velocity of the UAV
        relative to the object: d(d)/dr = s, d(closing speed)/dr = (w - s (s . w)) / d, and by the
        object's velocity -s.
        """
        offset, relative = offset_of(state, uav), approach(state, uav)
        distance = np.sqrt(np.sum(offset**2, axis=-1, keepdims=True))
        sight = offset / distance
        closing = np.sum(sight * relative, axis=-1, keepdims=True)
        per_speed = 2.0 * self.carrier / SPEED_OF_LIGHT
        H = np.zeros((*state.shape[:-1], 4, 4))
        H[..., :2, :2] = self.geometry.cosine_jacobian(state, uav)
        H[..., 2, :2] = 2.0 / SPEED_OF_LIGHT * sight[..., :2]
        H[..., 3, :2] = per_speed * ((relative - sight * closing) / distance)[..., :2]
        H[..., 3, 2:] = -per_speed * sight[..., :2]
        return H

    def residual(self, value: Array, expected: Array) -> Array:
        """Return measured minus expected; nothing is wrapped."""
        return value - expected
