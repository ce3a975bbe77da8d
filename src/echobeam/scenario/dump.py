"""Text of a scenario: the complete TOML file that reads back to the same numbers."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Container, Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from echobeam.numerals import plain
from echobeam.scenario.geometry import meaningless_keys
from echobeam.scenario.tables import PARAMETERS
from echobeam.units import UNITS, parse_quantity

_PREFERRED = {
    "angle": ("deg",),
    "length": ("m",),
    "time": ("s", "ms", "us"),
    "frequency": ("GHz", "MHz", "kHz", "Hz"),
    "speed": ("m/s",),
    "acceleration": ("m/s^2",),
    "rate": ("bit/s/Hz",),
}

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def dump_scenario(scenario: BaseModel) -> str:
    """Return a scenario's complete TOML text; loading it gives an equal one, bit for bit."""
    parameters: Mapping[str, Mapping[str, Any]] = getattr(scenario, PARAMETERS)
    lines = _assignments(scenario, without=("schemes",) if parameters else ())
    meaningless = meaningless_keys(scenario)
    for name in type(scenario).model_fields:
        value, without = getattr(scenario, name), meaningless.get(name, ())
        if isinstance(value, BaseModel):
            lines += ["", f"[{name}]", *_assignments(value, without)]
        elif name == "objects":
            for item in value:
                lines += ["", f"[[{name}]]", *_assignments(item, without)]
    for name, table in parameters.items():
        lines += ["", f"[schemes.{_key(name)}]"]
        lines += [f"{_key(key)} = {_text(value, '')}" for key, value in table.items()]
    return "\n".join(lines) + "\n"


def _assignments(table: BaseModel, without: Container[str] = ()) -> list[str]:
    lines = []
    for name, field in type(table).model_fields.items():
        value = getattr(table, name)
        if name in without:
            continue
        if value is None or isinstance(value, BaseModel) or name in ("objects", PARAMETERS):
            continue
        lines.append(f"{name} = {_text(value, _kind(field))}")
    return lines


def _kind(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    return str(extra.get("kind", "number")) if isinstance(extra, dict) else "number"


def _text(value: Any, kind: str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return "[" + ", ".join(_timed(item) for item in value) + "]"
    if isinstance(value, tuple):
        return "[" + ", ".join(_text(item, kind) for item in value) + "]"
    if isinstance(value, int) or kind not in _PREFERRED:
        return repr(value)
    return _quantity(value, kind)


def _timed(point: tuple[float, ...]) -> str:
    """Return a point of a path: its time, then its coordinates."""
    time, *place = point
    items = [_quantity(time, "time"), *(_quantity(item, "length") for item in place)]
    return f"[{', '.join(items)}]"


def _quantity(value: float, kind: str) -> str:
    """Return the shortest text with a unit that reads back exactly, else the bare SI number."""
    texts = []
    for unit in _PREFERRED[kind]:
        number = value / UNITS[kind][unit]
        texts += [f"{number:.{digits}g} {unit}" for digits in (6, 12)]
    exact = [text for text in texts if parse_quantity(text, kind) == value]
    return _quoted(min(exact, key=len)) if exact else repr(value)


def _quoted(text: str) -> str:
    r"""Return a basic string of TOML: that of JSON, but for the one more character it escapes.

    Bytes of a file's name that are no UTF-8 are written as ``\udcxx``: no TOML can hold them.
    """
    text = text.encode("utf-8", "backslashreplace").decode("utf-8")
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _quoted(name)


def key_texts(table: BaseModel) -> dict[str, str]:
    """Return the keys of a table that have a value, with the value as it would be written."""
    return dict(tuple(line.split(" = ", 1)) for line in _assignments(table))  # type: ignore[misc]


def value_text(value: object) -> str:
    """Return a value of Python code as TOML would hold it, NumPy's and tables included.

    Raises
    ------
    TypeError
        If no file can hold it.
    """
    value = plain(value)
    if isinstance(value, Mapping):
        items = (f"{_key(str(key))} = {value_text(item)}" for key, item in value.items())
        return f"{{{', '.join(items)}}}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, bool | int | float | str):
        return _text(value, "")
    raise TypeError(f"{value!r} is no value of a scenario")
