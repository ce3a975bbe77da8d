"""Constants and the reading of quantities with units.

Below the command line and the scenario file everything is SI and radians; this module is the one
place where "80 m", "60 deg" or "30 GHz" become such numbers.
"""

from __future__ import annotations

import math
import re

from echobeam.faults import InputError
from echobeam.numerals import plain

SPEED_OF_LIGHT = 299_792_458.0
"""Speed of light in vacuum, m/s (exact by definition of the metre)."""

BOLTZMANN = 1.380649e-23
"""Boltzmann's constant, J/K (exact by definition of the kelvin)."""

_DEG = math.pi / 180.0

UNITS: dict[str, dict[str, float]] = {
    "angle": {"rad": 1.0, "deg": _DEG, "mrad": 1e-3},
    "length": {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "GHz": 1e9},
    "speed": {"m/s": 1.0, "km/h": 1.0 / 3.6},
    "acceleration": {"m/s^2": 1.0, "m/s2": 1.0, "m/s²": 1.0},
    "rate": {"bit/s/Hz": 1.0},
    "number": {},
}
"""Units accepted per kind of quantity, as factors to SI."""

MOST_WHOLE = 10**300
"""Largest whole number that is read: floats end a little later."""

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S.*?)?\s*")

_DECIMAL_COMMA = re.compile(r"\s*[+-]?[\d.]*\d,\d")

_RATIOS = ("db", "dbi")

_LEVELS = {"dbm": 1e-3, "dbw": 1.0}
"""Levels of a power by their unit in small letters: what 0 is, W."""

_WATTS = {"uW": 1e-6, "mW": 1e-3, "W": 1.0, "kW": 1e3}


class QuantityError(InputError):
    """Fault of a text that is not a number with a unit of the kind asked for."""


def accepted(kind: str) -> str:
    """Return in words the units that a kind of quantity takes, for messages."""
    units = [unit for unit in UNITS[kind] if unit not in ("m/s2", "m/s²")]
    return (
        f"a number in {units[0]}, or a text with a unit ({', '.join(units)})"
        if units
        else ("a number")
    )


def parse_quantity(value: object, kind: str) -> float:
    """Return a quantity in SI units and radians.

    Parameters
    ----------
    value
        A bare number (taken as SI) or a text such as ``"80 m"``, ``"-90 deg"``, ``"30 GHz"``.
    kind
        A key of `UNITS`.

    Raises
    ------
    QuantityError
        If the value is no finite number or its unit is not of this kind.
    """
    value = plain(value)
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise QuantityError(f"{value!r} is not a quantity; expected {accepted(kind)}")
    if isinstance(value, int) and abs(value) > MOST_WHOLE:
        raise QuantityError(f"a number too large; expected {accepted(kind)}")
    if not isinstance(value, str):
        number = float(value)
    else:
        if _DECIMAL_COMMA.match(value):
            raise QuantityError(f"{value!r} is no number; decimals take a point")
        match = _QUANTITY.fullmatch(value)
        if match is None:
            raise QuantityError(f"{value!r} is not a number; expected {accepted(kind)}")
        number, unit = float(match[1]), match[2]
        if unit is not None:
            if kind == "number" and (said := _level(number, unit)):
                raise QuantityError(f"{value!r} is {said}")
            if unit not in UNITS[kind]:
                raise QuantityError(
                    f"unknown unit {unit!r} in {value!r}; expected {accepted(kind)}"
                )
            number *= UNITS[kind][unit]
    if not math.isfinite(number):
        raise QuantityError(f"{value!r} is not finite; expected {accepted(kind)}")
    return number


def _level(number: float, unit: str) -> str | None:
    """Return in words what a level or a power in watts is; None for another unit."""
    small = unit.lower()
    if small in _RATIOS:
        return (
            f"a ratio of {_ratio(number):.5g} in power; expected a plain number: powers and gains "
            "are linear"
        )
    if small in _LEVELS or unit in _WATTS:
        watts = _ratio(number) * _LEVELS[small] if small in _LEVELS else number * _WATTS[unit]
        return (
            f"a power of {watts:.5g} W; expected a plain number: radio.power, radio.noise and "
            "radar.noise are linear, in a unit of the scenario's own (echobeam describe says how "
            "many watts 1 is)"
        )
    return None


def _ratio(decibels: float) -> float:
    """Return the ratio of a level in decibels; infinite where floats end."""
    return 10.0 ** (decibels / 10.0) if decibels < 3000.0 else math.inf
