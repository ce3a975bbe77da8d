"""Flight of a UAV over the ground: straight, or past waypoints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from echobeam.values import UavState


class FlightPath(Protocol):
    """Motion of the UAV, known ahead; equal paths are one."""

    def __hash__(self) -> int:
        """Return the hash of its numbers."""

    @property
    def slot_duration(self) -> float:
        """DT, s."""

    def at(self, slot: int) -> UavState:
        """Return the UAV's position and velocity in a slot, counted from 0."""


@dataclass(frozen=True, slots=True)
class StraightFlight:
    """Flight at constant velocity.

    Attributes
    ----------
    position, velocity
        At time 0: x, y, z in m and m/s.
    slot_duration
        DT, s.
    """

    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    slot_duration: float

    def at(self, slot: int) -> UavState:
        """Return the UAV's position and velocity in a slot, counted from 0."""
        velocity = np.array(self.velocity)
        return UavState(np.array(self.position) + velocity * (self.slot_duration * slot), velocity)


@dataclass(frozen=True, slots=True)
class Waypoints:
    """Flight past waypoints, straight from one to the next.

    Before the first it waits there, and after the last. The velocity of a slot is that which
    brings it to where the next slot begins.

    Attributes
    ----------
    points
        Times, s, and places x, y, z, m, in the order of their times.
    slot_duration
        DT, s.
    """

    points: tuple[tuple[float, ...], ...]
    slot_duration: float

    def at(self, slot: int) -> UavState:
        """Return the UAV's position and velocity in a slot, counted from 0."""
        table = np.array(self.points)
        times = self.slot_duration * np.array([slot, slot + 1])
        here, there = np.stack(
            [np.interp(times, table[:, 0], table[:, axis]) for axis in (1, 2, 3)], axis=-1
        )
        return UavState(here, (there - here) / self.slot_duration)
