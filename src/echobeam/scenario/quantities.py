"""Field types of a scenario: quantities that are read with their unit and kept in SI."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from echobeam.units import QuantityError, parse_quantity


def _reader(kind: str) -> BeforeValidator:
    return BeforeValidator(lambda value: parse_quantity(value, kind))


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
"""Each is a float in SI and radians, read by `parse_quantity` with its kind of unit."""

_PER_ANTENNA = re.compile(r"(.+?)\s*N_t")


def _read_ripple(value: object) -> float | str:
    """Accept a number, or a text such as ``"0.1 N_t"`` that follows the array's size."""
    if isinstance(value, str):
        match = _PER_ANTENNA.fullmatch(value.strip())
        if match is None:
            raise QuantityError(f"{value!r} is not a ripple; expected a number or '<number> N_t'")
        factor = parse_quantity(match[1], "number")
        if factor < 0:
            raise QuantityError(f"{value!r} is negative; expected 0 or more")
        return f"{factor!r} N_t"
    return parse_quantity(value, "number")


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
