"""Finding schemes and parts: built in, plugged in through entry points, or in a user's file."""

from __future__ import annotations

import difflib
import importlib.util
import sys
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from echobeam.schemes.base import Scheme, SchemeError
from echobeam.schemes.doors import MARK, NO_SCHEME, as_scheme
from echobeam.schemes.failures import failure, users_traceback

ENTRY_POINT_GROUP = "echobeam.schemes"

BUILT_IN: dict[str, tuple[str, str, str]] = {
    "temporal": ("temporal", "TEMPORAL", "the paper's proposed scheme: track, predict, cover"),
    "pilot": ("pilot", "PILOT", "pilot slot, then one coverage beam per object, held"),
    "pilot-needle": ("pilot", "PILOT_NEEDLE", "pilot slot, then matched beams, held"),
    "pilot-predict": ("pilot", "PILOT_PREDICT", "pilot slot, then dead-reckoned coverage beams"),
    "water-filling": ("water_filling", "WATER_FILLING", "tracked, matched beams, water-filling"),
    "posterior": (
        "posterior",
        "POSTERIOR",
        "tracked on the ground, beams for the belief, looks when they pay",
    ),
    "genie": ("genie", "Genie", "knows the truth: an upper reference"),
    "omni": ("omni", "OMNI", "every slot omnidirectional"),
}
"""Name: module, object in it, and a description in a few words."""

PARTS: dict[str, dict[str, tuple[str, str, str]]] = {
    "frame": {
        "clocked": ("frames", "ClockedFrame", "omnidirectional slot, then directional ones"),
        "pilot": ("frames", "PilotFrame", "pilot slot without data, then directional ones"),
        "omni": ("frames", "OmniFrame", "omnidirectional slots only"),
        "adaptive": ("adaptive_frames", "AdaptiveFrame", "omnidirectional slots when they pay"),
        "probing": ("adaptive_frames", "ProbingFrame", "beams, with power spread out when it pays"),
    },
    "tracker": {
        "ekf": (
            "trackers",
            "ExtendedKalman",
            "extended Kalman filter on angle, distance, velocity",
        ),
        "held": ("trackers", "HeldEstimate", "the last measurement, held"),
        "ground": (
            "ground",
            "GroundTracker",
            "position on the ground, the known height as a sensor",
        ),
        "dead-reckoning": ("trackers", "DeadReckoning", "the last measurement, predicted on"),
    },
    "beamer": {
        "cover": ("beamers", "CoverBeamer", "problem (38): beams that cover the uncertainty"),
        "matched": ("beamers", "MatchedBeamer", "matched beams, water-filling power"),
        "posterior": (
            "posterior_beamer",
            "PosteriorBeamer",
            "largest expected sum rate over the belief",
        ),
    },
}
"""Kind of part: name, module, class, and a description in a few words."""


def available() -> dict[str, str]:
    """Return every scheme that can be run by name, with a few words or where it comes from."""
    found = {name: words for name, (_, _, words) in BUILT_IN.items()}
    for point in entry_points(group=ENTRY_POINT_GROUP):
        found.setdefault(point.name, f"plugged in: {point.value}")
    return found


def schemes() -> list[str]:
    """Return the names of the schemes that can be run, built in and plugged in."""
    return list(available())


def available_parts(kind: str) -> dict[str, str]:
    """Return every part of a kind that can be chosen by name, with a few words."""
    found = {name: words for name, (_, _, words) in PARTS[kind].items()}
    for point in entry_points(group=f"echobeam.{kind}s"):
        found.setdefault(point.name, f"plugged in: {point.value}")
    return found


def find_scheme(name: str) -> Scheme:
    """Return a scheme by its name, or from a file as ``path/to/file.py:name``.

    Raises
    ------
    SchemeError
        If there is no such scheme, or its code raises.
    """
    found, attribute = _find("scheme", name, BUILT_IN, ENTRY_POINT_GROUP, available)
    if not callable(found) and not isinstance(found, Scheme):
        raise SchemeError(f"{name}: {found!r} {NO_SCHEME}")
    return as_scheme(found, attribute)


def find_part(kind: str, name: str) -> object:
    """Return a part, ``"frame"``, ``"tracker"`` or ``"beamer"``, by its name or from a file.

    Raises
    ------
    SchemeError
        If there is no such part, its code raises, or it is not of this kind.
    """
    from echobeam.schemes.parts import Beamer, Frame, Tracker

    protocols: dict[str, type] = {"frame": Frame, "tracker": Tracker, "beamer": Beamer}
    known = partial(available_parts, kind)
    found, _ = _find(kind, name, PARTS[kind], f"echobeam.{kind}s", known)
    if isinstance(found, type):
        part = found
        found = _guarded(lambda: part(), f"making {kind} {name!r} without arguments")
    if not isinstance(found, protocols[kind]):
        calls = [call for call in vars(protocols[kind]) if not call.startswith("_")]
        raise SchemeError(
            f"{kind} {name!r} is no {kind}: {type(found).__name__}; expected an object with "
            f"{', '.join(calls)}"
        )
    return found


def _find(
    kind: str,
    name: str,
    built_in: Mapping[str, tuple[str, str, str]],
    group: str,
    available: Callable[[], Mapping[str, str]],
) -> tuple[object, str]:
    """Return a thing by its name or file, and the name to use if it does not say its own.

    What is available is asked for only where nothing is found: it takes a look at every installed
    distribution.
    """
    if name in built_in:
        module, attribute, _ = built_in[name]
        return getattr(import_module(f"echobeam.schemes.{module}"), attribute), name
    for point in entry_points(group=group):
        if point.name == name:
            return _guarded(point.load, f"loading {kind} {name!r} from {point.value}"), name
    path, colon, attribute = name.rpartition(":")
    if colon and path.endswith(".py"):
        return _from_file(kind, Path(path), attribute, name), attribute
    known = available()
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    if name.endswith(".py"):
        hint = f"of a file the {kind}'s name too, {name}:NAME; "
    raise SchemeError(
        f"unknown {kind} {name!r}; {hint}available: {', '.join(known)}, or path/to/file.py:name"
    )


def _from_file(kind: str, path: Path, attribute: str, name: str) -> object:
    if not path.is_file():
        raise SchemeError(f"{path}: no such file ({kind} {name!r})")
    module = _module(path, path.stat().st_mtime_ns)
    if hasattr(module, attribute):
        return getattr(module, attribute)
    marked = [each for each in vars(module).values() if getattr(each, MARK, None) == attribute]
    if not marked:
        raise SchemeError(f"{path}: there is no {kind} or object {attribute!r} in it")
    # objects with their parameters before the class that they were made of
    return min(marked, key=lambda candidate: isinstance(candidate, type))


@lru_cache(maxsize=32)
def _module(path: Path, changed: int) -> ModuleType:
    """Return a user's file as a module; it is run once, and again when it has changed."""
    spec = importlib.util.spec_from_file_location(f"echobeam_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise SchemeError(f"{path}: cannot be imported")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up while it is executed
    loader = spec.loader
    _guarded(lambda: loader.exec_module(module), f"importing {path}")
    return module


def _guarded(load: Callable[[], object], doing: str) -> object:
    """Run a user's code; whatever it raises becomes one message with file and line."""
    try:
        return load()
    except (KeyboardInterrupt, SchemeError):
        raise
    except BaseException as error:  # a user's file may raise anything
        raise SchemeError(f"{failure(error)} (while {doing})", users_traceback(error)) from error
