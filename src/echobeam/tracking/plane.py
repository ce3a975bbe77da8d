"""Measurement of the extended Kalman filter on the ground: of x, y and their velocities.

The height of the UAV over the ground is taken as known, as by `GroundMotion` with
``known_height``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.physics.plane import GroundGeometry, approach, offset_of
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, UavState


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
