"""How the UAV and the objects really move: exact geometry, Eq. (25) to Eq. (28)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.values import Array

MIN_HEIGHT = 1.0
"""Height at which a sinking UAV levels off, m: at the ground every angle would be 0 or 180."""


@dataclass(frozen=True, slots=True, eq=False)
class UavPath:
    """The UAV's flight, slot by slot.

    Attributes
    ----------
    height, x
        ``(n,)`` m: where it is at the beginning of the slot, above ground and along the road.
    speed, heading
        ``(n,)`` m/s and rad: its velocity until the beginning of the next.
    """

    height: Array
    x: Array
    speed: Array
    heading: Array


def uav_path(
    height: float,
    speed: float,
    heading: float,
    slot_duration: float,
    n_slots: int,
    floor: float = MIN_HEIGHT,
) -> UavPath:
    """Return a flight at constant velocity that levels off at the floor.

    In the slot in which it would cross the floor the vertical velocity is such that the slot
    ends exactly there, and zero afterwards; the horizontal velocity is kept throughout. A UAV
    that starts below the floor does not sink any further. The paper does not say what happens
    at the ground, which it would reach after 6.7 s at 15 m/s from 100 m.

    Parameters
    ----------
    height
        m above ground, at time 0.
    speed, heading
        v^u, m/s, and theta^u, rad above the horizontal (-pi/2 sinks).
    slot_duration
        s.
    n_slots
        Number of slots.
    floor
        m above ground.
    """
    sideways, climb = speed * exact_cosine(heading), speed * exact_sine(heading)
    elapsed = slot_duration * np.arange(n_slots + 1)
    unbounded = height + climb * elapsed
    heights = unbounded if climb >= 0 else np.maximum(unbounded, min(floor, height))
    bent = heights[1:] != unbounded[1:]
    climbs = np.diff(heights) / slot_duration
    return UavPath(
        height=heights[:-1],
        x=sideways * elapsed[:-1],
        speed=np.where(bent, np.hypot(sideways, climbs), speed),
        heading=np.where(bent, np.arctan2(climbs, sideways), heading),
    )


def move_object(
    theta: npt.ArrayLike,
    d: npt.ArrayLike,
    v: npt.ArrayLike,
    acceleration: npt.ArrayLike,
    uav_speed: Array | float,
    uav_heading: Array | float,
    slot_duration: float,
) -> tuple[Array, Array, Array]:
    """Return an object's state one slot later, as seen from the UAV, by exact geometry.

    The displacements relative to the UAV are I = v^u sin(theta^u) DT, Eq. (26), in height and
    II = v DT + a DT^2 / 2 - v^u cos(theta^u) DT, Eq. (27) with acceleration, along the road; the
    new distance is that of Eq. (25) and Eq. (28). Acceleration goes on when the object has come to
    a stop, so that it reverses. The UAV does not go below the ground: the angle stays within 0
    to 180 degrees, and is 0 by definition when the UAV stands on the object (d = 0).

    Parameters
    ----------
    theta, d, v
        ``(...)`` rad, m, m/s (over ground, along the road); NaN for absent objects.
    acceleration
        ``(...)`` or scalar, m/s^2, along the road.
    uav_speed, uav_heading
        v^u, m/s, and theta^u, rad, during the slot.
    slot_duration
        DT, s.

    Returns
    -------
    tuple of Array
        theta, d, v, each ``(...)``.
    """
    distance, velocity = np.asarray(d, dtype=np.float64), np.asarray(v, dtype=np.float64)
    gain = np.asarray(acceleration, dtype=np.float64) * slot_duration
    rise = uav_speed * exact_sine(uav_heading) * slot_duration
    advance = (velocity + 0.5 * gain - uav_speed * exact_cosine(uav_heading)) * slot_duration
    height = np.maximum(distance * exact_sine(theta) + rise, 0.0)
    x = distance * exact_cosine(theta) + advance
    return np.arctan2(height, x), np.hypot(height, x), velocity + gain


def initial_distance(theta: npt.ArrayLike, height: npt.ArrayLike) -> Array:
    """Return d = h / sin(theta): how far an object on the ground is that is seen under an angle.

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
