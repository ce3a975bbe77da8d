"""True motion of the UAV and of the objects in ground coordinates: exact, slot by slot.

Ground coordinates are x along the road, y across it and z above ground, m. The displacements of
Eq. (26) and Eq. (27) are differences of these positions; angle and distance of Eq. (25) and
Eq. (28) are what the UAV sees of them (`echobeam.physics.geometry`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.values import Array, UavState

MIN_HEIGHT = 1.0
"""Height at which a sinking UAV levels off, m: at the ground every angle would be 0 or 180."""


@dataclass(frozen=True, slots=True)
class Flight:
    """Flight at constant velocity in the road's vertical plane that levels off at a floor.

    In the slot in which it would cross the floor the vertical velocity is such that the slot
    ends exactly there, and zero afterwards; the horizontal velocity is kept throughout. A UAV
    that starts below the floor does not sink any further. The paper does not say what happens
    at the ground, which it would reach after 6.7 s at 15 m/s from 100 m.

    Attributes
    ----------
    height
        m above ground, at time 0; x and y are 0 there.
    speed, heading
        v^u, m/s, and theta^u, rad above the horizontal (-pi/2 sinks).
    slot_duration
        DT, s.
    floor
        m above ground.
    """

    height: float
    speed: float
    heading: float
    slot_duration: float
    floor: float = MIN_HEIGHT

    def at(self, slot: int) -> UavState:
        """Return the UAV's position and velocity in a slot, counted from 0."""
        sideways = self.speed * float(exact_cosine(self.heading))
        climb = self.speed * float(exact_sine(self.heading))
        here, there = self._height(climb, slot), self._height(climb, slot + 1)
        unbounded = self.height + climb * self.slot_duration * (slot + 1)
        bent = there != unbounded
        vertical = (there - here) / self.slot_duration if bent else climb
        return UavState(
            position=np.array([sideways * self.slot_duration * slot, 0.0, here]),
            velocity=np.array([sideways, 0.0, vertical]),
        )

    def _height(self, climb: float, slot: int) -> float:
        unbounded = self.height + climb * self.slot_duration * slot
        return unbounded if climb >= 0 else max(unbounded, min(self.floor, self.height))


def move_along_road(
    x: npt.ArrayLike, v: npt.ArrayLike, acceleration: npt.ArrayLike, slot_duration: float
) -> tuple[Array, Array]:
    """Return position and velocity along the road one slot later.

    x + v DT + a DT^2 / 2 and v + a DT: Eq. (27) with acceleration. Acceleration goes on when the
    object has come to a stop, so that it reverses.

    Parameters
    ----------
    x, v, acceleration
        ``(...)`` m, m/s, m/s^2; NaN for absent objects.
    slot_duration
        DT, s.
    """
    velocity = np.asarray(v, dtype=np.float64)
    gain = np.asarray(acceleration, dtype=np.float64) * slot_duration
    moved = np.asarray(x, dtype=np.float64) + (velocity + 0.5 * gain) * slot_duration
    return moved, velocity + gain


def initial_distance(theta: npt.ArrayLike, height: npt.ArrayLike) -> Array:
    """Return d = h / sin(theta), the distance of an object on the ground seen under an angle.

    Parameters
    ----------
    theta
        ``(...)`` rad, 0 to pi.
    height
        ``(...)`` m above ground.

    Returns
    -------
    Array
        ``(...)`` m; infinite at 0 and 180 degrees (the horizon), NaN if the height is 0 as well.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # the horizon: inf by definition
        distance: Array = np.asarray(height, dtype=np.float64) / exact_sine(theta)
    return distance
