"""Loader of scenarios: a built-in name or a TOML file, with overrides, all faults at once."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from echobeam.faults import InputError
from echobeam.scenario.model import PARAMETERS, Scenario

BUILT_IN = (
    "paper-multi",
    "paper-single",
    "paper-long",
    "paper-trajectory",
    "paper-height",
    "paper-approximation",
    "traffic",
)
"""Names of the scenarios that come with echobeam."""


T = TypeVar("T", bound=BaseModel)


class ScenarioError(InputError):
    """Fault of a scenario that cannot be used; the message lists all, with file and key."""


def preset_text(name: str) -> str:
    """Return a built-in scenario's TOML text, comments and all.

    Raises
    ------
    ScenarioError
        If there is no built-in scenario of that name.
    """
    if name not in BUILT_IN:
        raise ScenarioError(f"unknown scenario {name!r}; built in are {', '.join(BUILT_IN)}")
    return (_presets() / f"{name}.toml").read_text(encoding="utf-8")


def load_scenario(
    source: str | Path | Scenario, overrides: Mapping[str, object] | Sequence[str] = ()
) -> Scenario:
    """Load a scenario by its built-in name or from a TOML file.

    Parameters
    ----------
    source
        A name of `BUILT_IN`, the path of a TOML file, or a scenario to be changed.
    overrides
        Dotted keys and their values, as a mapping ``{"uav.height": "80 m"}`` or as texts
        ``"uav.height=80 m"``.

    Raises
    ------
    ScenarioError
        Names the file and, for every fault, the key, the value and what is accepted.
    """
    items = _items(overrides)
    if isinstance(source, Scenario):
        return replaced(source, dict(items))
    text, label, folder = _read(source)
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{label}: not a TOML file: {error}") from error
    faults = [fault for item in items if (fault := _override(document, *item))]
    if any(key == "trace.file" for key, _ in items):
        folder = Path()  # given on the command line: relative to where it was typed
    return validate(document, label, folder, faults)


def validate(
    document: Mapping[str, Any],
    label: str,
    folder: Path | None = None,
    faults: Sequence[str] = (),
) -> Scenario:
    """Validate a parsed scenario; trace files are looked for relative to ``folder``.

    Raises
    ------
    ScenarioError
        Lists the ``faults`` found before together with those found here.
    """
    if PARAMETERS in document:
        faults = [*faults, _unknown_key(PARAMETERS)]
        document = {key: value for key, value in document.items() if key != PARAMETERS}
    try:
        scenario = Scenario.model_validate(document)
    except ValidationError as error:
        found = [*faults, *(_fault(item) for item in error.errors())]
        raise ScenarioError(_listed(label, found)) from None
    if faults:
        raise ScenarioError(_listed(label, faults))
    if scenario.trace is not None and scenario.objects:
        raise ScenarioError(f"{label}: objects: not together with a trace; remove one of the two")
    if scenario.trace is None or folder is None:
        return scenario
    beside = folder / scenario.trace.file
    if _ships(scenario.trace.file) and not beside.is_file():
        return scenario
    return with_trace(scenario, beside)


def replaced(scenario: Scenario, overrides: Mapping[str, object]) -> Scenario:
    """Return a scenario with some dotted keys replaced, validated like a file.

    Raises
    ------
    ScenarioError
        Names every key that is at fault, its value and what is accepted.
    """
    document = tomllib.loads(scenario.to_toml())
    faults = [fault for item in overrides.items() if (fault := _override(document, *item))]
    folder = Path() if any(key == "trace.file" for key in overrides) else None
    return validate(document, scenario.name, folder, faults)


def override_table(table: T, values: Mapping[str, object], label: str) -> T:
    """Return a table of a scenario with some keys replaced, validated like a file.

    Parameters
    ----------
    table
        Such as ``scenario.filter``.
    values
        Keys and values, units allowed.
    label
        Begins the message.

    Raises
    ------
    ScenarioError
        Names every key that is at fault, its value and what is accepted.
    """
    if not values:
        return table
    try:
        return type(table).model_validate(table.model_dump() | dict(values))
    except ValidationError as error:
        faults = [_fault(item, type(table)) for item in error.errors()]
        raise ScenarioError(_listed(label, faults)) from None


def trace_path(scenario: Scenario) -> Path | None:
    """Return where the scenario's trace lies: a file's path, or the one that ships with us."""
    if scenario.trace is None:
        return None
    name = scenario.trace.file
    return Path(str(_presets() / name)) if _ships(name) else Path(name)


def with_trace(scenario: Scenario, path: str | Path) -> Scenario:
    """Return the scenario with its objects moved by another trace file."""
    table = scenario.trace.model_dump() if scenario.trace is not None else {}
    if scenario.trace is None and scenario.objects:
        table["max_objects"] = len(scenario.objects)
    place = str(Path(path).absolute())
    document = scenario.model_dump() | {"objects": (), "trace": table | {"file": place}}
    return Scenario.model_validate(document)


def _ships(name: str) -> bool:
    """Return whether a trace's bare name is that of a trace inside the package."""
    return Path(name).name == name and (_presets() / name).is_file()


def _presets() -> Traversable:
    return resources.files("echobeam.scenario") / "presets"


def _read(source: str | Path) -> tuple[str, str, Path]:
    if isinstance(source, str) and source in BUILT_IN:
        return preset_text(source), source, Path(str(_presets()))
    path = Path(source)
    try:
        return path.read_text(encoding="utf-8-sig"), str(source), path.parent
    except FileNotFoundError:
        near = difflib.get_close_matches(str(source), BUILT_IN, n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        raise ScenarioError(
            f"{source}: no such file, and no built-in scenario of that name{hint}; "
            f"built in are {', '.join(BUILT_IN)}"
        ) from None
    except UnicodeDecodeError:
        raise ScenarioError(f"{source}: not a TOML file: not UTF-8 text") from None
    except OSError as error:
        raise ScenarioError(f"{source}: cannot be read: {error.strerror}") from None


def _items(overrides: Mapping[str, object] | Sequence[str]) -> list[tuple[str, object]]:
    if isinstance(overrides, Mapping):
        return list(overrides.items())
    items: list[tuple[str, object]] = []
    for text in overrides:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise ScenarioError(f"--set {text}: expected KEY=VALUE, such as uav.height='80 m'")
        items.append((key.strip(), read_value(value.strip())))
    return items


def read_value(text: str) -> object:
    """Read an override as TOML where it is TOML, and as plain text ("80 m") otherwise."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _override(document: dict[str, Any], key: str, value: object) -> str | None:
    """Put a value at a dotted key; return the fault if there is no such place."""
    place: Any = document
    value = value.item() if isinstance(value, np.generic) else value
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


def _as_tables(document: dict[str, Any], name: str) -> str | None:
    """Turn a list of schemes into tables of their parameters; return the fault, if any."""
    schemes = document.setdefault("schemes", list(Scenario.model_fields["schemes"].default))
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


def _fault(error: Any, table: type[BaseModel] = Scenario) -> str:
    """Return one of pydantic's findings as key, value and what is accepted."""
    place = ["schemes" if part == PARAMETERS else str(part) for part in error["loc"]]
    key = ".".join(place)
    value, kind, context = error["input"], error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        return _unknown_key(key, _accepted_keys(error["loc"][:-1], table))
    if kind == "missing":
        return f"{key}: missing"
    if kind == "value_error":
        return f"{key}: {context['error']}" if key else str(context["error"])
    expected = _EXPECTED.get(kind, error["msg"].removeprefix("Input should be "))
    return f"{key}: {value!r} is not accepted; expected {expected}"


def _unknown_key(key: str, names: Sequence[str] | None = None) -> str:
    names = _accepted_keys((), Scenario) if names is None else names
    near = difflib.get_close_matches(key.rpartition(".")[2], names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{key}: unknown key; {hint}accepted here: {', '.join(names)}"


_EXPECTED = {
    "model_type": "a table",
    "dict_type": "a table of the scheme's parameters",
    "string_type": "a text",
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
