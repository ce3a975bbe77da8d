"""Coordinates of a scenario: its state, its measurement, and the direction that beams take.

A `Geometry` is a choice of them. The road's vertical plane has one angle, the ground two direction
cosines. Laws of rates and variances depend on the *place* of an object alone, ``(..., A + 1)`` or
more: the direction as the array takes it, of A components, and the distance. Whatever counts on
the components of a state or of a measurement asks the geometry.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from echobeam.values import Array, StateSpace, UavState


class Geometry(Protocol):
    """Coordinates of objects and measurements, seen from one UAV."""

    @property
    def name(self) -> str:
        """Name in a scenario."""

    @property
    def space(self) -> StateSpace:
        """State of an object, of S components."""

    @property
    def axes(self) -> int:
        """A, components of a direction; a measurement has A + 2, then delay and Doppler."""

    @property
    def measurement(self) -> tuple[str, ...]:
        """Names of the components of a measurement."""

    @property
    def measurement_units(self) -> tuple[str, ...]:
        """Units of these components."""

    @property
    def measurement_angles(self) -> tuple[int, ...]:
        """Indices of the components that are angles, whose differences are wrapped."""

    @property
    def errors(self) -> Mapping[str, tuple[str, ...]]:
        """Errors that a summary states: name, and the components of the state that it is made of.

        The first of them is what beams depend on.
        """

    def state(self, position: Array, velocity: Array, uav: UavState) -> Array:
        """Return the state ``(..., S)`` of ground coordinates ``(..., 3)`` m and m/s."""

    def exact(self, position: Array, velocity: Array, uav: UavState) -> Array:
        """Return the state, and after it what else of nature places and measurements depend on."""

    def place(self, state: Array, uav: UavState) -> Array:
        """Return the place of a state ``(..., S)``: direction and distance.

        The distance is infinite where the array cannot see the object: no gain and no echo.
        """

    def measured_place(self, value: Array) -> Array:
        """Return the place that a measurement ``(..., A + 2)`` is of."""

    def ideal(self, state: Array, uav: UavState, carrier: float) -> Array:
        """Return the measurement ``(..., A + 2)`` of a state without noise; ``carrier`` in Hz."""


def cover_shape(axes: int) -> tuple[int, ...]:
    """Return the shape of a cover: a half-width of one angle, or a matrix of direction cosines."""
    return () if axes == 1 else (axes, axes)


def spread_shape(axes: int) -> tuple[int, ...]:
    """Return the shape of a direction's standard deviations, those of `direction_of`."""
    return () if axes == 1 else (axes,)


def direction_of(place: Array, axes: int) -> Array:
    """Return the direction of a place: ``(...)`` of one component, ``(..., 2)`` of two.

    The same components of a measurement and of its variance are those of the direction.
    """
    direction: Array = place[..., 0] if axes == 1 else place[..., :axes]
    return direction


def distance_of(place: Array, axes: int) -> Array:
    """Return the distance of a place, ``(...)`` m."""
    distance: Array = place[..., axes]
    return distance
