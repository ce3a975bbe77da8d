"""The paper's models: state (angle, distance, velocity), measurement (angle, delay, Doppler)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.estimation.gaussian import wrap
from echobeam.physics.polar import POLAR, POLAR_MEASUREMENT
from echobeam.tracking.evolution import Evolution, evolution_jacobian, evolve
from echobeam.tracking.measurement import measurement_jacobian, predict_measurement
from echobeam.values import Array, StateSpace, UavState


@dataclass(frozen=True, slots=True)
class PolarMotion:
    """Evolution of angle, distance and velocity, Eqs. (25)-(35), (40), (42).

    Attributes
    ----------
    slot_duration
        DT, s.
    angle_std, distance_std, velocity_std
        Standard deviations of the process noise for each slot, rad, m, m/s.
    evolution
        First order as in the paper (corrected), or closed form.
    """

    slot_duration: float
    angle_std: float
    distance_std: float
    velocity_std: float
    evolution: Evolution = "paper"

    @property
    def space(self) -> StateSpace:
        """Angle, distance, velocity."""
        return POLAR

    def step(self, state: Array, uav: UavState) -> Array:
        """Return the state one slot later, g(e) of Eq. (35) or the exact geometry."""
        return evolve(state, uav.speed, uav.heading, self.slot_duration, self.evolution)

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return G of Eq. (42)."""
        return evolution_jacobian(state, uav.speed, uav.heading, self.slot_duration, self.evolution)

    def noise(self) -> Array:
        """Return Q_s of Eq. (40)."""
        noise: Array = np.diag(np.square([self.angle_std, self.distance_std, self.velocity_std]))
        return noise


@dataclass(frozen=True, slots=True)
class PolarMeasurement:
    """Measurement of angle, delay and Doppler, Eqs. (17)-(19), (24), (43).

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
        """Return h(e) of Eq. (24)."""
        return predict_measurement(state, uav.speed, uav.heading, self.carrier)

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return H of Eq. (43)."""
        return measurement_jacobian(state, uav.speed, uav.heading, self.carrier)

    def residual(self, value: Array, expected: Array) -> Array:
        """Return m - h(e), the bracket of Eq. (48), with the angle wrapped to (-pi, pi]."""
        difference = value - expected
        difference[..., 0] = wrap(difference[..., 0])
        return difference
