"""Field types of a scenario: quantities in SI that are read with a unit, and parameters."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, PlainSerializer

from echobeam.numerals import plain, whole
from echobeam.scenario.limits import (
    MOST_HEIGHT_STD,
    MOST_PULSE,
    MOST_SPACING,
    SLOWER,
    limited_quantity,
)
from echobeam.units import SPEED_OF_LIGHT, QuantityError, parse_quantity


def _reader(kind: str, most: float | None = None) -> BeforeValidator:
    return BeforeValidator(lambda value: limited_quantity(value, kind, most))


Angle = Annotated[float, _reader("angle"), Field(json_schema_extra={"kind": "angle"})]
Length = Annotated[float, _reader("length"), Field(json_schema_extra={"kind": "length"})]
Time = Annotated[float, _reader("time"), Field(json_schema_extra={"kind": "time"})]
Frequency = Annotated[float, _reader("frequency"), Field(json_schema_extra={"kind": "frequency"})]
Speed = Annotated[float, _reader("speed"), Field(json_schema_extra={"kind": "speed"})]
Acceleration = Annotated[
    float, _reader("acceleration"), Field(json_schema_extra={"kind": "acceleration"})
]
Rate = Annotated[float, _reader("rate"), Field(json_schema_extra={"kind": "rate"})]
Number = Annotated[float, _reader("number"), Field(json_schema_extra={"kind": "number"})]
Spacing = Annotated[
    float, _reader("number", MOST_SPACING), Field(json_schema_extra={"kind": "number"})
]
PulseLength = Annotated[
    float, _reader("time", MOST_PULSE), Field(json_schema_extra={"kind": "time"})
]
HeightStd = Annotated[
    float, _reader("length", MOST_HEIGHT_STD), Field(json_schema_extra={"kind": "length"})
]
"""Each is a float in SI and radians, within the limits of its kind."""


def _components(expected: str) -> BeforeValidator:
    """Return a check for lists of a certain length, such as ``"[x, y], two lengths"``."""
    size = expected.partition("]")[0].count(",") + 1

    def check(value: object) -> object:
        if not isinstance(value, list | tuple) or len(value) != size:
            raise QuantityError(f"{value!r} is not accepted; expected {expected}")
        return value

    return BeforeValidator(check)


OnPlane = Annotated[tuple[Length, Length], _components("[x, y], two lengths")]
InSpace = Annotated[tuple[Length, Length, Length], _components("[x, y, z], three lengths")]
VelocityInSpace = Annotated[
    tuple[Speed, Speed, Speed], _components("[v_x, v_y, v_z], three speeds")
]
RoadAxis = Annotated[
    tuple[Length, Length, Length, Length], _components("[x1, y1, x2, y2], four lengths")
]
Complex = Annotated[tuple[Number, Number], _components("[real, imaginary], two numbers")]


def _read_motion(value: object, kind: str) -> object:
    """Accept a quantity along the road, or a pair of them on the ground."""
    if isinstance(value, list | tuple):
        if len(value) != 2:
            raise QuantityError(f"{value!r} has {len(value)} components; expected x and y")
        return tuple(limited_quantity(item, kind) for item in value)
    return limited_quantity(value, kind)


Velocity = Annotated[
    float | tuple[float, float],
    BeforeValidator(lambda value: _read_motion(value, "speed")),
    Field(json_schema_extra={"kind": "speed"}),
]
AnyAcceleration = Annotated[
    float | tuple[float, float],
    BeforeValidator(lambda value: _read_motion(value, "acceleration")),
    Field(json_schema_extra={"kind": "acceleration"}),
]
"""Along the road, or along x and y."""
Place = Annotated[
    float | tuple[float, float],
    BeforeValidator(lambda value: _read_motion(value, "length")),
    Field(json_schema_extra={"kind": "length"}),
]
"""Position along the road, or x and y."""


def _read_facing(value: object) -> object:
    """Accept a word, or a direction in ground coordinates of any length but zero."""
    if isinstance(value, str):
        if value not in ("down", "ahead"):
            raise QuantityError(f"{value!r} is not accepted; expected {_FACING}")
        return value
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise QuantityError(f"{value!r} is not accepted; expected {_FACING}")
    direction = tuple(parse_quantity(item, "number") for item in value)
    if not any(direction):
        raise QuantityError(f"{list(direction)!r} is no direction; expected {_FACING}")
    return direction


_FACING = "'down', 'ahead', or a direction [x, y, z]"

Facing = Annotated[str | tuple[float, float, float], BeforeValidator(_read_facing)]
"""Direction that a planar array faces."""


def _in_time(points: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    """Accept points at increasing times, between which nothing moves as fast as light."""
    if not points:
        raise ValueError("no points; expected at least one")
    for before, after in pairwise(points):
        duration, way = after[0] - before[0], math.dist(before[1:], after[1:])
        if not duration > 0.0:
            raise ValueError(
                f"goes back in time, from {before[0]:g} s to {after[0]:g} s; expected times that "
                "increase"
            )
        if not way < SPEED_OF_LIGHT * duration:
            raise ValueError(f"{way:g} m in {duration:g} s; expected {SLOWER}")
    return points


_PathPoint = Annotated[
    tuple[Time, Length, Length], _components("[t, x, y], a time and two lengths")
]
_Waypoint = Annotated[
    tuple[Time, Length, Length, Length], _components("[t, x, y, z], a time and three lengths")
]

Path = Annotated[tuple[_PathPoint, ...], AfterValidator(_in_time)]
"""Points (t, x, y) of an object on the ground."""

Waypoints = Annotated[tuple[_Waypoint, ...], AfterValidator(_in_time)]
"""Points (t, x, y, z) of the UAV."""


def _read_whole(value: object) -> object:
    """Return a whole number of any kind as Python's; whatever else is refused after this."""
    number = whole(value)
    return value if number is None else number


Whole = Annotated[int, BeforeValidator(_read_whole), Field(strict=True)]
"""Whole number of any kind, not a truth value and not 3.0."""


def _read_polarisations(value: object) -> object:
    """Return a whole number as Python's; refuse truth values, which would pass for 0 and 1."""
    number = whole(value)
    if number is None:
        raise ValueError(f"{value!r} is not accepted; expected 1 or 2")
    return number


Polarisations = Annotated[Literal[1, 2], BeforeValidator(_read_polarisations)]
"""Number of orthogonal polarisations."""

_PER_ANTENNA = re.compile(r"(.+?)\s*N_t")


def _read_ripple(value: object) -> float | str:
    """Accept a number, or a text such as ``"0.1 N_t"`` that follows the array's size."""
    value = plain(value)
    if isinstance(value, str):
        match = _PER_ANTENNA.fullmatch(value.strip())
        if match is None:
            raise QuantityError(f"{value!r} is not a ripple; expected a number or '<number> N_t'")
        factor = limited_quantity(match[1], "number")
        if factor < 0:
            raise QuantityError(f"{value!r} is negative; expected 0 or more")
        return f"{factor!r} N_t"
    return limited_quantity(value, "number")


def _not_negative(value: float | str) -> float | str:
    if not isinstance(value, str) and value < 0:
        raise ValueError(f"{value!r} is negative; expected 0 or more")
    return value


Ripple = Annotated[float | str, BeforeValidator(_read_ripple), AfterValidator(_not_negative)]
"""B of (38f): a number, or a multiple of the number of transmit antennas."""


def ripple_value(ripple: float | str, n_tx: int) -> float:
    """Return B as a number for an array of ``n_tx`` antennas."""
    if isinstance(ripple, str):
        return float(ripple.removesuffix("N_t")) * n_tx
    return ripple


V = TypeVar("V")


class FrozenMapping(Mapping[str, V]):
    """Mapping that cannot be changed, can be hashed if its values can, and equals a dict."""

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, V]) -> None:
        self._values = dict(values)

    def __getitem__(self, key: str) -> V:
        """Return the value of a key."""
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the keys, in their order."""
        return iter(self._values)

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(self._values)

    def __hash__(self) -> int:
        """Return a hash of the items, whatever their order."""
        return hash(frozenset(self._values.items()))

    def __repr__(self) -> str:
        """Return the text of the dict that it equals."""
        return repr(self._values)


def _read_parameter(value: object) -> object:
    """Accept a value that TOML writes on its own; its scheme checks the rest."""
    value = plain(value)
    if not isinstance(value, (bool, int, float, str)):
        raise ValueError(f"{value!r} is not accepted; expected a number, a text, true or false")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value!r} is not finite; expected a finite number")
    return value


Parameter = Annotated[bool | int | float | str, BeforeValidator(_read_parameter)]

SchemeParameters = Annotated[
    Mapping[str, Annotated[Mapping[str, Parameter], AfterValidator(FrozenMapping)]],
    AfterValidator(FrozenMapping),
    PlainSerializer(lambda schemes: {name: dict(values) for name, values in schemes.items()}),
]
"""Parameters by the name of their scheme, checked for their type alone."""
