"""Parameters of a scheme: what can be set on it and on its parts, and the setting of it.

Three kinds: keys of the scenario's ``[filter]``, ``[coverage]`` and, without labels, ``[tracks]``
that the parts read, the parts themselves, and the plain fields (numbers, texts) of the scheme and
of its parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar, get_type_hints

from echobeam.faults import InputError
from echobeam.scenario.tables import CoverageTable, FilterTable, TracksTable
from echobeam.schemes.base import SchemeError
from echobeam.schemes.failures import failure, users_traceback
from echobeam.schemes.parts import SchemeOfParts

PARTS = ("frame", "tracker", "beamer")
"""Fields of a scheme of parts that hold its parts."""

TABLE_KEYS = (*FilterTable.model_fields, *CoverageTable.model_fields)
"""Keys of the scenario that a scheme may have values of its own for."""

_EXPECTED = {int: "a whole number", float: "a number", bool: "true or false"}

T = TypeVar("T")


def table_keys(scheme: object, *, unlabelled: bool = False) -> list[str]:
    """Return the keys of ``[filter]`` and ``[coverage]`` that a scheme reads.

    A scheme or part says so in an attribute ``parameters``; one that does not is taken to read
    them all, a frame to read none. Without labels a scheme of parts reads those of ``[filter]``
    and of ``[tracks]`` as well, by which its detections are associated.
    """
    if isinstance(scheme, SchemeOfParts):
        parts = (scheme.tracker, scheme.beamer, scheme.frame)
        read = {key for part in parts for key in _read_by(part, part is not scheme.frame)}
        if unlabelled:
            read |= {*FilterTable.model_fields, *TracksTable.model_fields}
    else:
        read = set(_read_by(scheme, True))
    return [key for key in (*TABLE_KEYS, *TracksTable.model_fields) if key in read]


def _read_by(part: object, otherwise: bool) -> tuple[str, ...]:
    return tuple(getattr(part, "parameters", TABLE_KEYS if otherwise else ()))


def road_parameters(scheme: object) -> list[str]:
    """Return the plain fields of a scheme's parts that have no meaning on the ground.

    A part says so in an attribute ``road_only``.
    """
    parts = (getattr(scheme, name) for name in part_names(scheme))
    return [key for part in parts for key in getattr(part, "road_only", ())]


def part_names(scheme: object) -> list[str]:
    """Return the parts that can be exchanged."""
    return list(PARTS) if isinstance(scheme, SchemeOfParts) else []


def own_parameters(thing: object) -> dict[str, object]:
    """Return the plain fields of a scheme and of its parts with their values."""
    found: dict[str, object] = {}
    for name, value in _fields(thing):
        if name != "name" and isinstance(value, (bool, int, float, str)):
            found.setdefault(name, value)
    for _, value in _fields(thing):
        for name, inner in own_parameters(value).items():
            found.setdefault(name, inner)
    return found


def set_parameter(thing: T, key: str, value: object, label: str) -> T:
    """Return a scheme or part with one of its `own_parameters` set.

    Parameters
    ----------
    thing
        A frozen dataclass.
    key, value
        The parameter; a text is read as what the field holds.
    label
        Begins the message.

    Raises
    ------
    SchemeError
        If the value is not accepted.
    """
    for name, old in _fields(thing):
        if name == key and isinstance(old, (bool, int, float, str)):
            return _replaced(thing, name, _read(thing, name, value, label), label)
    for name, part in _fields(thing):
        if key in own_parameters(part):
            return _replaced(thing, name, set_parameter(part, key, value, label), label)
    raise KeyError(key)


def _fields(thing: object) -> Iterator[tuple[str, Any]]:
    if is_dataclass(thing) and not isinstance(thing, type):
        for field in fields(thing):
            yield field.name, getattr(thing, field.name)


def _replaced(thing: T, name: str, value: object, label: str) -> T:
    try:
        return replace(thing, **{name: value})  # type: ignore[type-var]
    except SchemeError:
        raise
    except (InputError, ValueError, TypeError) as error:
        raise SchemeError(f"{label}: {error}") from None
    except Exception as error:  # a user's class may raise anything
        raise SchemeError(f"{label}: {name}: {failure(error)}", users_traceback(error)) from error


def _read(thing: object, name: str, value: object, label: str) -> object:
    """Return a value as the type that a field is declared with."""
    from pydantic import TypeAdapter, ValidationError

    try:
        declared = get_type_hints(type(thing)).get(name, type(getattr(thing, name)))
    except (NameError, TypeError):  # a type that is imported for type checkers only
        declared = type(getattr(thing, name))
    try:
        if isinstance(value, bool) and declared in (int, float):  # no number, unlike in Python
            return TypeAdapter(declared).validate_python(str(value))
        return TypeAdapter(declared).validate_python(value)
    except ValidationError as error:
        said = error.errors()[0]["msg"].removeprefix("Input should be ")
        expected = _EXPECTED.get(declared, said)
        raise SchemeError(
            f"{label}: {name}: {value!r} is not accepted; expected {expected}"
        ) from None
