"""Checks of a table against what was written: every fault at once, with key and value."""

from __future__ import annotations

import difflib
import os
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from echobeam.faults import InputError
from echobeam.numerals import plain
from echobeam.scenario.tables import DEFAULT_SCHEMES, PARAMETERS

T = TypeVar("T", bound=BaseModel)


class ScenarioError(InputError):
    """Fault of a scenario that cannot be used; the message lists all, with file and key."""


def checked(
    table: type[T], document: Mapping[str, Any], label: str, faults: Sequence[str] = ()
) -> T:
    """Return a table made from what was written.

    Parameters
    ----------
    table
        Its class.
    document
        Keys and values, units allowed.
    label
        Begins the message.
    faults
        Those found before, told together with those found here.

    Raises
    ------
    ScenarioError
        Names every key that is at fault, its value and what is accepted.
    """
    if PARAMETERS in document and PARAMETERS in table.model_fields:
        faults = [*faults, _unknown_key(PARAMETERS, _accepted_keys((), table))]
        document = {key: value for key, value in document.items() if key != PARAMETERS}
    try:
        made = table.model_validate(document)
    except ValidationError as error:
        faults = [*faults, *(_fault(item, table) for item in error.errors())]
        raise ScenarioError(_listed(label, faults)) from None
    if faults:
        raise ScenarioError(_listed(label, faults))
    return made


def override_table(table: T, values: Mapping[str, object], label: str) -> T:
    """Return a table, such as ``scenario.filter``, with some keys replaced, see `checked`."""
    return checked(type(table), table.model_dump() | dict(values), label) if values else table


def read_value(text: str) -> object:
    """Read an override as TOML where it is TOML, and as plain text ("80 m") otherwise."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:  # TOMLDecodeError, or a number of more digits than Python reads
        return text


def override(document: dict[str, Any], key: Any, value: object) -> str | None:
    """Put a value at a dotted key; return the fault if there is no such place."""
    place: Any = document
    value = _as_read(value)
    if not isinstance(key, str):
        return f"{key!r}: no key; expected a dotted text such as 'uav.height'"
    *parents, last = key.split(".")
    if parents[:1] == ["schemes"]:
        fault = _as_tables(document, parents[1] if len(parents) > 1 else last)
        if fault:
            return fault
    for part in parents:
        if isinstance(place, list):
            if not part.isdecimal() or int(part) >= len(place):
                return f"{key}: there is no item {part!r}; expected 0 to {len(place) - 1}"
            place = place[int(part)]
        elif isinstance(place, dict):
            place = place.setdefault(part, {})
        else:
            return f"{key}: {part!r} is not a table"
    if isinstance(place, list):
        if not last.isdecimal() or int(last) >= len(place):
            return f"{key}: there is no item {last!r}; expected 0 to {len(place) - 1}"
        place[int(last)] = value
    elif isinstance(place, dict):
        place[last] = value
    else:
        return f"{key}: not a table"
    return None


def _as_read(value: object) -> object:
    """Return what Python code gives as a file would have it: plain numbers, lists and texts."""
    value = plain(value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _as_read(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_as_read(item) for item in value]
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def _as_tables(document: dict[str, Any], name: str) -> str | None:
    """Turn a list of schemes into tables of their parameters; return the fault, if any."""
    schemes = document.setdefault("schemes", list(DEFAULT_SCHEMES))
    if not isinstance(schemes, (list, dict)) or not all(isinstance(each, str) for each in schemes):
        return f"schemes.{name}: schemes is neither a list of names nor tables"
    if name not in schemes:
        return f"schemes.{name}: there is no such scheme in schemes; it has {', '.join(schemes)}"
    if isinstance(schemes, list):
        document["schemes"] = {each: {} for each in schemes}
    return None


def _listed(label: str, faults: Sequence[str]) -> str:
    if len(faults) == 1:
        return f"{label}: {faults[0]}"
    return f"{label}: {len(faults)} faults\n" + "\n".join(f"  {fault}" for fault in faults)


def _fault(error: Any, table: type[BaseModel]) -> str:
    """Return one of pydantic's findings as key, value and what is accepted."""
    place = ["schemes" if part == PARAMETERS else str(part) for part in error["loc"]]
    key = ".".join(place)
    value, kind, context = error["input"], error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        return _unknown_key(key, _accepted_keys(error["loc"][:-1], table))
    if kind == "missing":
        return f"{key}: missing"
    if kind == "value_error":
        text = str(context["error"])
        return text if not key or text.startswith(f"{key}.") else f"{key}: {text}"
    expected = _EXPECTED.get(kind, error["msg"].removeprefix("Input should be "))
    return f"{key}: {value!r} is not accepted; expected {expected}"


def _unknown_key(key: str, names: Sequence[str]) -> str:
    near = difflib.get_close_matches(key.rpartition(".")[2], names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{key}: unknown key; {hint}accepted here: {', '.join(names)}"


_EXPECTED = {
    "model_type": "a table",
    "dict_type": "a table of the scheme's parameters",
    "string_type": "a text",
    "string_too_short": "a text, not empty",
    "tuple_type": "a list",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
}


def _accepted_keys(location: Sequence[int | str], table: type[BaseModel]) -> list[str]:
    """Return the keys of the table at a location."""
    for part in location:
        if isinstance(part, int):
            continue
        annotation = table.model_fields[part].annotation
        candidates = [annotation, *getattr(annotation, "__args__", ())]
        table = next(t for t in candidates if isinstance(t, type) and issubclass(t, BaseModel))
    return [name for name in table.model_fields if name != PARAMETERS]
