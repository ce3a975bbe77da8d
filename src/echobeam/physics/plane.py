"""Geometry of the ground: objects on a plane, seen by a planar array in two direction cosines.

The array has a frame of unit vectors: e_u along which its rows are counted, e_v along which its
columns are, and its normal n = e_v x e_u reversed, n x e_v = e_u. With s the unit vector from the
UAV to an object, u = s . e_u and v = s . e_v; objects with s . n <= 0 are behind the array.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from echobeam.physics.element import Element, element_gain
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, BoolArray, StateSpace, UavState

Vector = tuple[float, float, float]
"""Vector in ground coordinates: x, y, z."""


def _finite(state: Array) -> BoolArray:
    return np.asarray(np.isfinite(state).all(axis=-1))


GROUND = StateSpace(
    names=("x", "y", "v_x", "v_y"), units=("m", "m", "m/s", "m/s"), angles=(), valid=_finite
)
"""State of an object on the ground; it does not move with the UAV."""

GROUND_MEASUREMENT = ("u", "v", "delay", "doppler")
"""Components of a measurement: two direction cosines, delay, Doppler."""

_ERRORS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"position": ("x", "y"), "velocity": ("v_x", "v_y")}
)


@dataclass(frozen=True, slots=True)
class GroundGeometry:
    """State (x, y, v_x, v_y), measurement (u, v, delay, Doppler), direction (u, v).

    Attributes
    ----------
    along_rows, along_columns
        Unit vectors e_u and e_v.
    normal
        Unit vector into the half-space that the array sees; None for an array on one line, which
        sees all around.
    element
        Pattern of the elements in front of the array.
    """

    along_rows: Vector = (1.0, 0.0, 0.0)
    along_columns: Vector = (0.0, 1.0, 0.0)
    normal: Vector | None = (0.0, 0.0, -1.0)
    element: Element = "isotropic"

    @property
    def name(self) -> str:
        """Name in a scenario."""
        return "ground"

    @property
    def space(self) -> StateSpace:
        """Position and velocity on the ground."""
        return GROUND

    @property
    def axes(self) -> int:
        """Two direction cosines."""
        return 2

    @property
    def measurement(self) -> tuple[str, ...]:
        """Direction cosines, delay, Doppler."""
        return GROUND_MEASUREMENT

    @property
    def measurement_units(self) -> tuple[str, ...]:
        """Units of a measurement: 1, 1, s, Hz."""
        return ("1", "1", "s", "Hz")

    @property
    def measurement_angles(self) -> tuple[int, ...]:
        """No angles."""
        return ()

    @property
    def errors(self) -> Mapping[str, tuple[str, ...]]:
        """Distances from the true position and from the true velocity."""
        return _ERRORS

    def state(self, position: Array, velocity: Array, uav: UavState) -> Array:
        """Return the horizontal components of position and velocity, ``(..., 4)``."""
        return np.concatenate([position[..., :2], velocity[..., :2]], axis=-1)

    def exact(self, position: Array, velocity: Array, uav: UavState) -> Array:
        """Return the state with the altitude error b, ``(..., 5)``: an object lies at z = -b."""
        state = self.state(position, velocity, uav)
        return np.concatenate([state, -position[..., 2:]], axis=-1)

    def place(self, state: Array, uav: UavState) -> Array:
        """Return direction cosines, distance, line of sight and velocity, ``(..., 8)``.

        The distance is the one that gives the path's gain: divided by the root of the element's
        gain, so that it acts once on the link and twice on the echo, and infinite behind the array.
        Line of sight (from the UAV, 3 components) and
        velocity (2) are what the aspect of a target depends on.
        """
        offset, distance = _sight(state, uav)
        u, v = self._cosines(offset, distance)
        seen = np.stack([u, v, self._apparent(distance, offset, u, v)], axis=-1)
        return np.concatenate([seen, offset / distance[..., None], state[..., 2:4]], axis=-1)

    def measured_place(self, value: Array) -> Array:
        """Return the place ``(..., 8)`` of a measurement, with no velocity.

        A cosine that was not measured is taken to be zero; beyond the visible region it is the
        edge, u^2 + v^2 = 1.
        """
        cosines = np.where(np.isfinite(value[..., :2]), value[..., :2], 0.0)
        cosines = visible(cosines)
        distance = 0.5 * SPEED_OF_LIGHT * value[..., 2]
        sight, still = self.sight(cosines), np.zeros_like(cosines)
        if self.normal is not None:
            inside = sight * distance[..., None]
            distance = self._scaled(distance, inside, cosines[..., 0], cosines[..., 1])
        return np.concatenate([cosines, distance[..., None], sight, still], axis=-1)

    def ideal(self, state: Array, uav: UavState, carrier: float) -> Array:
        """Return cosines, delay 2 d / c and Doppler (2 f_c / c) (-dd/dt), ``(..., 4)``."""
        offset, distance = _sight(state, uav)
        u, v = self._cosines(offset, distance)
        closing = np.sum(offset * approach(state, uav), axis=-1) / distance
        delay = 2.0 / SPEED_OF_LIGHT * distance
        return np.stack([u, v, delay, 2.0 * carrier / SPEED_OF_LIGHT * closing], axis=-1)

    def cosine_jacobian(self, state: Array, uav: UavState) -> Array:
        """Return d(u, v) / d(x, y), ``(..., 2, 2)``: (e - s (s . e)) / d of either axis."""
        offset, distance = _sight(state, uav)
        sight = offset / distance[..., None]
        rows = []
        for axis in (self.along_rows, self.along_columns):
            e = np.array(axis)
            across = e - sight * (sight @ e)[..., None]
            rows.append(across[..., :2] / distance[..., None])
        return np.stack(rows, axis=-2)

    def sight(self, cosines: Array) -> Array:
        """Return the unit vector ``(..., 3)`` of direction cosines ``(..., 2)``.

        Parameters
        ----------
        cosines
            u and v; beyond the visible region they are taken at its edge.
        """
        inside = visible(cosines)
        e_u, e_v = np.array(self.along_rows), np.array(self.along_columns)
        normal = np.cross(e_u, e_v) * -1.0 if self.normal is None else np.array(self.normal)
        out = np.sqrt(np.maximum(1.0 - np.sum(inside**2, axis=-1), 0.0))
        vector: Array = inside[..., :1] * e_u + inside[..., 1:] * e_v + out[..., None] * normal
        return vector

    def _apparent(self, distance: Array, offset: Array, u: Array, v: Array) -> Array:
        """Return the distance ``(...)`` that gives the path's gain, infinite behind the array."""
        if self.normal is None:
            return distance
        behind = offset @ np.array(self.normal) <= 0.0
        return np.where(behind, np.inf, self._scaled(distance, offset, u, v))

    def _scaled(self, distance: Array, offset: Array, u: Array, v: Array) -> Array:
        """Return a distance over the root of the element's gain."""
        if self.element == "isotropic":
            return distance
        out = offset @ np.array(self.normal)
        with np.errstate(invalid="ignore"):
            return distance / np.sqrt(element_gain(u, v, out / distance))

    def _cosines(self, offset: Array, distance: Array) -> tuple[Array, Array]:
        u: Array = offset @ np.array(self.along_rows) / distance
        v: Array = offset @ np.array(self.along_columns) / distance
        return u, v


GROUND_GEOMETRY = GroundGeometry()
"""Geometry of an array that looks down: u is the cosine to x, v that to y."""


def facing(direction: Vector, element: Element = "isotropic") -> GroundGeometry:
    """Return the geometry of an array whose normal is a direction.

    e_v = z x n / |z x n| is horizontal, y where the normal is vertical, and e_u = n x e_v: an
    array that looks down has e_u = x and e_v = y, and is turned around e_v to look ahead, along x,
    where e_u = z.

    Parameters
    ----------
    direction
        In ground coordinates, of any length but zero.
    element
        Pattern of its elements.
    """
    _, exponent = math.frexp(max(abs(part) for part in direction))
    parts = np.ldexp(np.array(direction), -exponent)  # exact, and its squares are numbers
    normal = parts / math.sqrt(sum(part * part for part in parts.tolist()))
    across = np.array([-normal[1], normal[0], 0.0])
    width = float(np.hypot(across[0], across[1]))
    e_v = across / width if width > 0.0 else np.array([0.0, 1.0, 0.0])
    e_u = np.cross(normal, e_v)
    return GroundGeometry(_vector(e_u), _vector(e_v), _vector(normal), element)


def visible(cosines: Array) -> Array:
    """Return direction cosines ``(..., 2)``, those beyond the unit circle moved to its edge."""
    length = np.sqrt(np.sum(cosines**2, axis=-1, keepdims=True))
    return np.where(length > 1.0, cosines / np.where(length > 1.0, length, 1.0), cosines)


def approach(state: Array, uav: UavState) -> Array:
    """Return the velocity of the UAV relative to objects, ``(..., 3)`` m/s."""
    own = [uav.velocity[..., axis] - state[..., 2 + axis] for axis in range(2)]
    down = np.broadcast_to(uav.velocity[..., 2], own[0].shape)
    return np.stack([*own, down], axis=-1)


def offset_of(state: Array, uav: UavState) -> Array:
    """Return the vector from the UAV to objects on the ground, ``(..., 3)`` m.

    A fifth component of a state is the altitude error: the object lies by so much deeper.
    """
    along = [state[..., axis] - uav.position[..., axis] for axis in range(2)]
    height = np.broadcast_to(-uav.position[..., 2], along[0].shape)
    if state.shape[-1] > GROUND.size:
        height = height - state[..., GROUND.size]
    return np.stack([*along, height], axis=-1)


def _sight(state: Array, uav: UavState) -> tuple[Array, Array]:
    offset = offset_of(state, uav)
    return offset, np.sqrt(np.sum(offset**2, axis=-1))


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z
