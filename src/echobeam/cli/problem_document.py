"""Problem (38) and its answer as JSON: input and output of `echobeam beam`."""

from __future__ import annotations

import json
import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from echobeam.beamforming.answer import BeamAnswer
from echobeam.beamforming.problem import BeamProblem, ProblemError
from echobeam.physics.array import LinearArray
from echobeam.physics.planar import PlanarArray
from echobeam.units import parse_quantity

MOST_SHOWN = 60
"""Largest number of characters of a wrong value in a message."""


def _reader(kind: str, unit: float = 1.0) -> BeforeValidator:
    """Return a reader of quantities; a bare number is in the given unit, relative to SI."""

    def read(value: object) -> float:
        try:
            number = parse_quantity(value, kind)
        except OverflowError:
            raise ValueError("too large") from None
        return number if isinstance(value, str) else number * unit

    return BeforeValidator(read)


def _each(reader: BeforeValidator) -> BeforeValidator:
    """Return a reader of one number or of a list of numbers."""
    read: Any = reader.func
    return BeforeValidator(
        lambda value: [read(item) for item in value] if isinstance(value, list) else read(value)
    )


def _whole(value: object) -> object:
    """Refuse values that pydantic would convert to a whole number."""
    if isinstance(value, (bool, str)):
        raise ValueError("not a whole number")
    return value


Whole = Annotated[int, BeforeValidator(_whole), Field(ge=1)]
_DEGREES = _reader("angle", math.pi / 180.0)
Degrees = Annotated[float, _DEGREES]
Angle = Annotated[float, Field(ge=-math.pi, le=math.pi)]
HalfWidth = Annotated[float, Field(ge=0, le=math.pi / 2)]
Metres = Annotated[float, Field(gt=0)]
Number = Annotated[float, _reader("number")]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Pair = tuple[Number, Number]
Matrix = tuple[Pair, Pair]
Angles = Annotated[Angle | list[Angle], _each(_DEGREES)]
HalfWidths = Annotated[HalfWidth | list[HalfWidth], _each(_DEGREES)]
Distances = Annotated[Metres | list[Metres], _each(_reader("length"))]
Ripple = Annotated[NotNegative | list[NotNegative], _each(_reader("number"))]
Rate = Annotated[NotNegative | list[NotNegative], _each(_reader("rate"))]
Columns = list[list[Number]]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid")


class _Common(_Table):
    distances: Distances = Field(description="a positive number or a list of them, m")
    ripple: Ripple = Field(description="a number or a list of numbers, at least 0")
    min_rate: Rate = Field(description="a number or a list of numbers, at least 0, bit/s/Hz")
    power: Positive = Field(description="a positive number")
    noise: Positive = Field(description="a positive number")
    alpha0: Positive = Field(1.0, description="a positive number")
    warm_start_re: Columns | None = Field(
        None, description="one list of n_tx numbers per object, with warm_start_im"
    )
    warm_start_im: Columns | None = Field(
        None, description="one list of n_tx numbers per object, with warm_start_re"
    )


class _InAngles(_Common):
    angles_deg: Angles = Field(
        description="a number or a list of numbers from -180 to 180, degrees"
    )
    coverage_halfwidths_deg: HalfWidths = Field(
        description="a number or a list of numbers from 0 to 90, degrees"
    )
    resolution_deg: Annotated[Degrees, Field(gt=0)] = Field(
        math.radians(0.1), description="a positive number, degrees"
    )


class _Linear(_InAngles):
    n_tx: Whole = Field(description="a whole number from 1")
    spacing: Positive = Field(0.5, description="a positive number, wavelengths")
    axis: Literal["vertical", "horizontal"] = Field(
        "vertical", description='"vertical" or "horizontal"'
    )


class _Row(_Table):
    n: Whole
    spacing: Positive = 0.5
    axis: Literal["vertical", "horizontal"] = "vertical"


class _OnLinear(_InAngles):
    array: _Row = Field(
        description='a linear array, {n, spacing (0.5), axis ("vertical")}, or a planar one, '
        "{rows, columns, spacing (0.5), polarisations (1 or 2)}"
    )


class _Planar(_Table):
    rows: Whole
    columns: Whole
    spacing: Positive = 0.5
    polarisations: Literal[1, 2] = 1


class _OnPlanar(_Common):
    array: _Planar = Field(
        description="a planar array: {rows, columns, spacing (0.5), polarisations (1 or 2)}"
    )
    angles: Pair | list[Pair] = Field(
        description="a pair of direction cosines [u, v] or a list of pairs"
    )
    coverage_halfwidths: Matrix | list[Matrix] = Field(
        description="a matrix [[a, b], [b, c]] of an ellipse in direction cosines, "
        "or a list of matrices"
    )
    resolution: Positive = Field(math.radians(0.1), description="a positive number")


ACCEPTED = {
    key: str(field.description)
    for table in (_Linear, _OnPlanar, _OnLinear)
    for key, field in table.model_fields.items()
}
"""Keys of a problem document and their accepted values; null omits an optional key."""


def read_problem(text: str, source: str = "problem") -> BeamProblem:
    """Return the problem (38) of a JSON text.

    Parameters
    ----------
    text
        A JSON object with the keys of `ACCEPTED`: those of `BeamProblem`, angles in degrees.
        Quantities may have units, as in ``"75 deg"``. With a planar ``array`` directions are
        direction cosines instead of angles.
    source
        Name of the file, for messages.

    Raises
    ------
    ProblemError
        If the text is not a JSON object, a key is unknown or missing, or a value is not accepted;
        all errors in one message, each with the file, the key and the value.
    """
    document = _parsed(text, source)
    table = _table(document.get("array"))
    fields = table.model_fields
    document = {
        key: value
        for key, value in document.items()
        if value is not None or (key in fields and fields[key].is_required())
    }
    faults, stated = [], None
    try:
        stated = table.model_validate(document)
    except ValidationError as error:
        faults = _faults(error, document, table)
    faults += _misfits(document, table, {fault.split(":")[0] for fault in faults})
    if stated is not None and not faults:
        try:
            return BeamProblem(**_arguments(stated))
        except ProblemError as error:
            faults = str(error).split("; ")
    raise ProblemError("\n".join(f"{source}: {fault}" for fault in faults))


def _table(array: object) -> type[_Common]:
    """Return the keys that go with an array; a linear one has ``n``."""
    if array is None:
        return _Linear
    return _OnLinear if isinstance(array, dict) and "n" in array else _OnPlanar


def answer_document(answer: BeamAnswer) -> dict[str, Any]:
    """Return an answer as a dictionary for JSON; NaN and infinity become None."""
    missed = answer.max_violation
    return {
        "beams_re": _lists(answer.beams.real),
        "beams_im": _lists(answer.beams.imag),
        "rates": _lists(answer.rates),
        "objective": _number(answer.objective),
        "upper_bound": _number(answer.upper_bound),
        "gap": _number(answer.gap),
        "status": answer.status,
        "outcome": answer.outcome,
        "message": answer.message,
        "max_violation": {
            "power": _number(missed.power),
            "rate": _number(missed.rate),
            "coverage": _number(missed.coverage),
        },
        "seconds": _number(answer.seconds),
        "iterations": int(answer.iterations),
    }


def _parsed(text: str, source: str) -> dict[str, Any]:
    doubled: list[str] = []

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        keys = [key for key, _ in pairs]
        doubled.extend(sorted({key for key in keys if keys.count(key) > 1}))
        return dict(pairs)

    try:
        document = json.loads(text.removeprefix("\ufeff"), object_pairs_hook=unique)
    except (ValueError, RecursionError) as error:  # too many digits are a plain ValueError
        raise ProblemError(f"{source}: not JSON: {error}") from None
    if not isinstance(document, dict):
        keys = ", ".join(_Linear.model_fields)
        raise ProblemError(
            f"{source}: {_shown(document)} is not a JSON object with the keys {keys}"
        )
    if doubled:
        raise ProblemError("\n".join(f"{source}: {key}: given twice" for key in doubled))
    return document


def _faults(error: ValidationError, document: dict[str, Any], table: type[BaseModel]) -> list[str]:
    """Return one message for each key that pydantic rejects."""
    found: dict[str, str] = {}
    for item in error.errors():
        key = str(item["loc"][0])
        if key not in table.model_fields:
            text = f"no such key; accepted are {', '.join(table.model_fields)}"
        elif item["type"] == "missing" and len(item["loc"]) == 1:
            text = f"missing; expected {ACCEPTED[key]}"
        else:
            text = f"{_shown(document[key])} is not {ACCEPTED[key]}"
        found.setdefault(key, f"{key}: {text}")
    return list(found.values())


def _misfits(document: dict[str, Any], table: type[BaseModel], faulty: set[str]) -> list[str]:
    """Return a message for each list whose length differs from the number of angles."""
    angles = "angles" if "angles" in table.model_fields else "angles_deg"
    if angles not in document or angles in faulty:
        return []
    pairs = document[angles]
    listed = isinstance(pairs, list) and (angles == "angles_deg" or _nested(pairs))
    n_objects = len(pairs) if listed else 1
    keys = ("distances", "coverage_halfwidths", "coverage_halfwidths_deg", "ripple", "min_rate")
    found = [
        f"{key}: {_shown(document[key])} has {len(document[key])} values, "
        f"expected {n_objects} as in {angles}"
        for key in keys
        if key not in faulty
        and isinstance(document.get(key), list)
        and not (key == "coverage_halfwidths" and _matrix(document[key]))
        and len(document[key]) != n_objects
    ]
    return found + _warm_misfits(document, faulty, n_objects)


def _warm_misfits(document: dict[str, Any], faulty: set[str], n_objects: int) -> list[str]:
    parts = ("warm_start_re", "warm_start_im")
    given = [key for key in parts if key in document]
    if not given or faulty & {*parts, "n_tx", "array"}:
        return []
    found = [f"{key}: missing; expected {ACCEPTED[key]}" for key in parts if key not in given]
    stated = document.get("array", {})
    if "rows" in stated:
        size = _Planar.model_validate(stated)
        n_tx = size.rows * size.columns * size.polarisations
    else:
        n_tx = int(stated.get("n", document.get("n_tx", 0)))
    return found + [
        f"{key}: expected {n_objects} lists of {n_tx} numbers"
        for key in given
        if n_tx and [len(row) for row in document[key]] != [n_tx] * n_objects
    ]


def _arguments(stated: _Common) -> dict[str, Any]:
    """Return the arguments of `BeamProblem`."""
    arguments = {
        key.removesuffix("_deg"): getattr(stated, key)
        for key in type(stated).model_fields
        if not key.startswith("warm_start_")
    }
    if isinstance(stated, _OnPlanar):
        arguments["array"] = PlanarArray(**stated.array.model_dump())
        if not stated.angles:  # an empty list says nothing of pairs and matrices
            arguments["angles"] = np.empty((0, 2))
        if not stated.coverage_halfwidths:
            arguments["coverage_halfwidths"] = np.empty((0, 2, 2))
    elif isinstance(stated, _OnLinear):
        arguments["array"] = LinearArray(**stated.array.model_dump())
    if stated.warm_start_re is not None:
        real, imaginary = np.array(stated.warm_start_re), np.array(stated.warm_start_im)
        arguments["warm_start"] = real + 1j * imaginary
    return arguments


def _nested(values: list[Any]) -> bool:
    """Return whether a list is one of lists, or empty."""
    return all(isinstance(value, list) for value in values)


def _matrix(values: list[Any]) -> bool:
    """Return whether a list of lists is one matrix of numbers, for all objects."""
    return all(isinstance(row, list) and not _nested(row) for row in values)


def _shown(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 3] + "..."


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _lists(values: Any) -> Any:
    """Return an array as nested lists, with None for NaN and infinity."""
    if values.ndim > 1:
        return [_lists(row) for row in values]
    return [_number(item) for item in values.tolist()]
