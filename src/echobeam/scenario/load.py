"""Loader of scenarios: a built-in name or a TOML file, with overrides, all faults at once."""

from __future__ import annotations

import codecs
import difflib
import tomllib
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

from echobeam.scenario.built_in import BUILT_IN, preset_text, presets, ships
from echobeam.scenario.checking import ScenarioError, checked, override, read_value
from echobeam.scenario.model import Scenario

Source = Scenario | str | PathLike[str]
"""Scenario, a built-in scenario's name, or the path of a scenario file."""


def load_scenario(source: Source, overrides: Mapping[str, object] | Sequence[str] = ()) -> Scenario:
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
        return source.replace(dict(items))
    text, label, folder = _read(source)
    try:
        document = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, or a number of more digits than Python reads
        raise ScenarioError(f"{label}: not a TOML file: {error}") from error
    faults = [fault for item in items if (fault := override(document, *item))]
    if any(key == "trace.file" for key, _ in items):
        folder = Path()  # given on the command line: relative to where it was typed
    return checked(Scenario, document, label, faults).located(folder)


def written_schemes(source: Source, overrides: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the schemes that a source names, though it be at fault; none if it cannot be read."""
    try:
        text = source.to_toml() if isinstance(source, Scenario) else _read(source)[0]
        document = tomllib.loads(text)
        for item in _items(overrides):
            override(document, *item)
    except ValueError:  # ScenarioError and TOMLDecodeError, which `load_scenario` raises
        return ()
    schemes = document.get("schemes", ())
    names = schemes if isinstance(schemes, list | dict) else ()
    return tuple(name for name in names if isinstance(name, str))


def trace_path(scenario: Scenario) -> Path | None:
    """Return where the scenario's trace lies: a file's path, or the one that ships with us."""
    if scenario.trace is None:
        return None
    name = scenario.trace.file
    return Path(str(presets() / name)) if ships(name) else Path(name)


def _read(source: str | PathLike[str]) -> tuple[str, str, Path]:
    if isinstance(source, str) and source in BUILT_IN:
        return preset_text(source), source, Path(str(presets()))
    if not isinstance(source, str | PathLike):
        raise ScenarioError(
            f"{source!r} is no scenario; expected a Scenario, a built-in name or a file's path"
        )
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
    except UnicodeDecodeError as error:
        utf16 = error.object[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        found = "UTF-16 text; save it as UTF-8" if utf16 else "not UTF-8 text"
        raise ScenarioError(f"{source}: not a TOML file: {found}") from None
    except OSError as error:
        raise ScenarioError(f"{source}: cannot be read: {error.strerror}") from None


def _items(overrides: Mapping[str, object] | Sequence[str]) -> list[tuple[str, object]]:
    if isinstance(overrides, Mapping):
        return list(overrides.items())
    if isinstance(overrides, str):
        overrides = [overrides]
    items: list[tuple[str, object]] = []
    for text in overrides:
        key, equals, value = str(text).partition("=")
        if not equals or not key.strip():
            raise ScenarioError(f"--set {text}: expected KEY=VALUE, such as uav.height='80 m'")
        items.append((key.strip(), read_value(value.strip())))
    return items
