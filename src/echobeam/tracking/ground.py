"""Models of a state on the ground: position and velocity, and the error of the known height.

Road users are on the ground, and the UAV knows its height: delay and height tell the position many
times better than the angle does. How well the height is known is a component of the state: the
object lies z + b below the UAV that believes to fly at z. Components are (x, v, b) on one road,
(x, y, v_x, v_y, b) on a plane; positions are those of the ground and do not move with the UAV.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from echobeam.estimation.gaussian import wrap
from echobeam.physics.plane import GROUND
from echobeam.physics.polar import POLAR_MEASUREMENT
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, BoolArray, StateSpace, UavState

Axes = Literal[1, 2]
"""Axes of the ground: along one road, or along it and across."""


def _finite(state: Array) -> BoolArray:
    return np.asarray(np.isfinite(state).all(axis=-1))


ROAD = StateSpace(
    names=("x", "velocity", "altitude_error"), units=("m", "m/s", "m"), angles=(), valid=_finite
)
"""State of an object on one road."""

PLANE = StateSpace(
    names=("x", "y", "velocity_x", "velocity_y", "altitude_error"),
    units=("m", "m", "m/s", "m/s", "m"),
    angles=(),
    valid=_finite,
)
"""State of an object on a plane."""

PLANE_MEASUREMENT = ("u", "v", "delay", "doppler")
"""Measurement of a planar array: two direction cosines, delay, Doppler."""

Direction = tuple[float, float, float]
"""Unit vector in x, y and z (up)."""

LOOKING_DOWN: tuple[Direction, Direction] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
"""Axes of an array that looks down: rows are counted along x, columns along y."""


@dataclass(frozen=True, slots=True)
class GroundMotion:
    """Motion at constant velocity, disturbed by an acceleration that is constant in a slot.

    The acceleration is white from slot to slot and changes the velocity by `velocity_std` in one:
    it moves the position by half of that times DT, fully correlated (piecewise constant white
    acceleration, Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and
    Navigation*, 2001, section 6.3.2). The altitude error does not change.

    Attributes
    ----------
    slot_duration
        DT, s.
    velocity_std
        Standard deviation of the velocity's change in a slot, m/s.
    axes
        Of the ground.
    known_height
        Whether the UAV's height counts as known, on a plane: the state has no altitude error.
    """

    slot_duration: float
    velocity_std: float
    axes: Axes = 1
    known_height: bool = False

    @property
    def space(self) -> StateSpace:
        """Position, velocity, altitude error."""
        if self.axes == 1:
            return ROAD
        return GROUND if self.known_height else PLANE

    def step(self, state: Array, uav: UavState) -> Array:
        """Return the state one slot later; the UAV does not matter to the ground."""
        moved = state.copy()
        velocity = state[..., self.axes : 2 * self.axes]
        moved[..., : self.axes] += self.slot_duration * velocity
        return moved

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return G, the same for every state, ``(..., K, S, S)``."""
        G = np.eye(self.space.size)
        for axis in range(self.axes):
            G[axis, self.axes + axis] = self.slot_duration
        return np.broadcast_to(G, (*state.shape, self.space.size))

    def noise(self) -> Array:
        """Return Q_s: what a random acceleration does within a slot."""
        Q = np.zeros((self.space.size, self.space.size))
        for axis in range(self.axes):
            effect = np.zeros(self.space.size)
            effect[[axis, self.axes + axis]] = 0.5 * self.slot_duration, 1.0
            Q += self.velocity_std**2 * np.outer(effect, effect)
        return Q


@dataclass(frozen=True, slots=True)
class GroundMeasurement:
    """Measurement of a state on the ground: direction, delay and Doppler.

    The direction is the paper's depression angle on one road, Eqs. (17)-(19). On a plane it is
    that of a planar array: the cosines of the angles to the two axes along which it counts rows
    and columns, u = e_u . (p - p_uav) / d and v = e_v . (p - p_uav) / d.

    Attributes
    ----------
    carrier
        f_c, Hz.
    axes
        Of the ground.
    array
        e_u and e_v, orthogonal; on a plane only. The array sees the side of -(e_u x e_v).
    """

    carrier: float
    axes: Axes = 1
    array: tuple[Direction, Direction] = LOOKING_DOWN

    @property
    def names(self) -> tuple[str, ...]:
        """Components of the measurement."""
        return POLAR_MEASUREMENT if self.axes == 1 else PLANE_MEASUREMENT

    @property
    def facing(self) -> Direction:
        """Direction in which the array looks, -(e_u x e_v)."""
        x, y, z = (-float(part) for part in np.cross(*self.array))
        return x, y, z

    def expected(self, state: Array, uav: UavState) -> Array:
        """Return h(e) of Eq. (24), ``(..., M)`` for states ``(..., S)``."""
        offset, depth, distance, speed = self._seen(state, uav)
        if self.axes == 1:
            direction = [np.arctan2(depth, offset[0])]
        else:
            place = (*offset, depth)
            direction = [_along(axis, place) / distance for axis in self._downward()]
        delay = 2.0 / SPEED_OF_LIGHT * distance
        doppler = 2.0 * self.carrier / SPEED_OF_LIGHT * speed
        return np.moveaxis(np.stack([*direction, delay, doppler]), 0, -1)

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return H = dh/de, ``(..., M, S)``."""
        offset, depth, distance, speed = self._seen(state, uav)
        axes, size = self.axes, state.shape[-1]
        sight = [part / distance for part in (*offset, depth)]  # d(distance) by position and b
        place = [*range(axes), size - 1]
        H = np.zeros((len(self.names), size, *distance.shape))
        if axes == 1:
            H[0, 0], H[0, size - 1] = -sight[1] / distance, sight[0] / distance
        else:
            for row, towards in enumerate(self._downward()):
                cosine = _along(towards, sight)
                for i, column in enumerate(place):
                    H[row, column] = (towards[i] - cosine * sight[i]) / distance
        own = self._own_velocity(state, uav)
        per_speed = 2.0 * self.carrier / SPEED_OF_LIGHT
        for i, column in enumerate(place):
            H[axes, column] = 2.0 / SPEED_OF_LIGHT * sight[i]
            H[axes + 1, column] = per_speed * (own[i] - speed * sight[i]) / distance
        for axis in range(axes):
            H[axes + 1, axes + axis] = -per_speed * sight[axis]
        return np.moveaxis(H, (0, 1), (-2, -1))

    def residual(self, value: Array, expected: Array) -> Array:
        """Return m - h(e), the angle wrapped to (-pi, pi]."""
        difference = value - expected
        if self.axes == 1:
            difference[..., 0] = wrap(difference[..., 0])
        return difference

    def _downward(self) -> tuple[Direction, Direction]:
        """Return the array's axes by x, y and depth."""
        (ux, uy, uz), (vx, vy, vz) = self.array
        return (ux, uy, -uz), (vx, vy, -vz)

    def _own_velocity(self, state: Array, uav: UavState) -> list[Array]:
        """Return the velocity of the UAV relative to the object, by x (and y) and depth."""
        along = [uav.velocity[axis] - state[..., self.axes + axis] for axis in range(self.axes)]
        return [*along, np.asarray(-uav.velocity[2])]

    def _seen(self, state: Array, uav: UavState) -> tuple[list[Array], Array, Array, Array]:
        """Return the offset by axis, the depth, the distance and the closing speed."""
        offset = [state[..., axis] - uav.position[axis] for axis in range(self.axes)]
        depth = uav.position[2] + state[..., -1]
        distance = np.sqrt(sum(part * part for part in (*offset, depth)))
        own = self._own_velocity(state, uav)
        approach = sum(v * part for v, part in zip(own, (*offset, depth), strict=True))
        return offset, depth, distance, approach / distance


def _along(axis: Direction, place: Sequence[Array]) -> Array:
    """Return the scalar product of an axis and a vector given by x, y and depth."""
    return axis[0] * place[0] + axis[1] * place[1] + axis[2] * place[2]


def polar_of(state: Array, uav: UavState) -> Array:
    """Return angle, distance and velocity ``(..., 3)`` of states on one road, Eq. (25).

    Parameters
    ----------
    state
        ``(..., S)``: x, v, any others, b; NaN gives NaN.
    uav
        The UAV in the slot.
    """
    x, depth = state[..., 0] - uav.position[0], uav.position[2] + state[..., -1]
    return np.stack([np.arctan2(depth, x), np.hypot(depth, x), state[..., 1]], axis=-1)
