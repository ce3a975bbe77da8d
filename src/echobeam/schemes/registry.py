"""Finding schemes: built in, plugged in through entry points, or in a file of the user's."""

from __future__ import annotations

import difflib
import importlib.util
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from echobeam.schemes.base import Scheme, SchemeError
from echobeam.schemes.doors import as_scheme

ENTRY_POINT_GROUP = "echobeam.schemes"

BUILT_IN: dict[str, tuple[str, str, str]] = {
    "temporal": ("temporal", "Temporal", "the paper's proposed scheme: track, predict, cover"),
    "pilot": ("pilot", "Pilot", "pilot slot, then one coverage beam per object, held"),
    "pilot-needle": ("pilot", "PilotNeedle", "pilot slot, then matched beams, held"),
    "pilot-predict": ("pilot", "PilotPredict", "pilot slot, then dead-reckoned coverage beams"),
    "water-filling": ("water_filling", "WaterFilling", "tracked, matched beams, water-filling"),
    "genie": ("genie", "Genie", "knows the truth: an upper reference"),
    "omni": ("omni", "Omni", "every slot omnidirectional"),
}
"""Name: module, class, and what it does in a few words."""


def available() -> dict[str, str]:
    """Return every scheme that can be run by name, with a few words or where it comes from."""
    found = {name: words for name, (_, _, words) in BUILT_IN.items()}
    for point in entry_points(group=ENTRY_POINT_GROUP):
        found.setdefault(point.name, f"plugged in: {point.value}")
    return found


def find_scheme(name: str) -> Scheme:
    """Return a scheme by its name, or from a file as ``path/to/file.py:name``.

    Raises
    ------
    SchemeError
        If there is no such scheme, or its code raises.
    """
    if name in BUILT_IN:
        module, cls, _ = BUILT_IN[name]
        return as_scheme(getattr(import_module(f"echobeam.schemes.{module}"), cls))
    for point in entry_points(group=ENTRY_POINT_GROUP):
        if point.name == name:
            return as_scheme(_guarded(point.load, f"scheme {name!r} ({point.value})"), name)
    path, colon, attribute = name.rpartition(":")
    if colon and path.endswith(".py"):
        return _from_file(Path(path), attribute, name)
    near = difflib.get_close_matches(name, available(), n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise SchemeError(
        f"unknown scheme {name!r}; {hint}available: {', '.join(available())}, "
        "or path/to/file.py:name"
    )


def _from_file(path: Path, attribute: str, name: str) -> Scheme:
    if not path.is_file():
        raise SchemeError(f"{path}: no such file (scheme {name!r})")
    spec = importlib.util.spec_from_file_location(f"echobeam_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise SchemeError(f"{path}: cannot be imported (scheme {name!r})")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up while it is executed
    loader = spec.loader
    _guarded(lambda: loader.exec_module(module), f"{path}")
    if hasattr(module, attribute):
        return as_scheme(getattr(module, attribute), attribute)
    marked = [
        candidate
        for candidate in vars(module).values()
        if getattr(candidate, "__echobeam_scheme__", None) == attribute
    ]
    if not marked:
        raise SchemeError(f"{path}: there is no scheme or object {attribute!r} in it")
    # objects with their parameters before the class that they were made of
    return as_scheme(min(marked, key=lambda candidate: isinstance(candidate, type)), attribute)


def _guarded(load: Callable[[], object], label: str) -> object:
    """Run a user's code; whatever it raises becomes one clear message."""
    try:
        return load()
    except (Exception, SystemExit) as error:  # a user's file may raise anything
        raise SchemeError(f"{label}: raised {type(error).__name__}: {error}") from error
