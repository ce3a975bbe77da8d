"""Geometry of the paper: the road's vertical plane, with one angle, Eqs. (17)-(35)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from echobeam.physics.geometry import polar_state
from echobeam.physics.measurement import measure, measured_place
from echobeam.physics.polar import POLAR, POLAR_MEASUREMENT, POLAR_MEASUREMENT_UNITS
from echobeam.values import Array, StateSpace, UavState


@dataclass(frozen=True, slots=True)
class RoadGeometry:
    """State (angle, distance, velocity), measurement (angle, delay, Doppler), direction the angle.

    The state is relative to the UAV, so that it is a place by itself.
    """

    @property
    def name(self) -> str:
        """Name in a scenario."""
        return "road"

    @property
    def space(self) -> StateSpace:
        """Angle, distance, velocity."""
        return POLAR

    @property
    def axes(self) -> int:
        """One angle."""
        return 1

    @property
    def measurement(self) -> tuple[str, ...]:
        """Angle, delay, Doppler."""
        return POLAR_MEASUREMENT

    @property
    def measurement_units(self) -> tuple[str, ...]:
        """Units of a measurement: rad, s, Hz."""
        return POLAR_MEASUREMENT_UNITS

    @property
    def measurement_angles(self) -> tuple[int, ...]:
        """Index of the angle."""
        return (0,)

    @property
    def errors(self) -> Mapping[str, tuple[str, ...]]:
        """Angle and distance by themselves."""
        return _ERRORS

    def state(self, position: Array, velocity: Array, uav: UavState) -> Array:
        """Return angle, distance and velocity ``(..., 3)`` seen from the UAV, Eqs. (25), (28)."""
        return polar_state(position, velocity, uav)

    def exact(self, position: Array, velocity: Array, uav: UavState) -> Array:
        """Return the state, which holds the height of the object."""
        return polar_state(position, velocity, uav)

    def place(self, state: Array, uav: UavState) -> Array:
        """Return the state, which begins with angle and distance."""
        return state

    def measured_place(self, value: Array) -> Array:
        """Return the state ``(..., 3)`` that a measurement is of, with no velocity."""
        return measured_place(value)

    def ideal(self, state: Array, uav: UavState, carrier: float) -> Array:
        """Return angle, delay and Doppler ``(..., 3)`` of a state, Eqs. (17)-(19)."""
        angle, distance, velocity = np.moveaxis(state, -1, 0)
        return measure(angle, distance, velocity, uav.speed, uav.heading, carrier)


_ERRORS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"angle": ("angle",), "distance": ("distance",)}
)

ROAD_GEOMETRY = RoadGeometry()
"""The road's geometry: it has no parameters."""
