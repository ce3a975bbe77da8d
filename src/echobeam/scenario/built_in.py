"""Scenarios and the traces that come with echobeam."""

from __future__ import annotations

from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from echobeam.scenario.checking import ScenarioError

BUILT_IN = (
    "paper-multi",
    "paper-single",
    "paper-long",
    "paper-trajectory",
    "paper-height",
    "paper-approximation",
    "paper-signal",
    "arrivals",
    "crossing",
    "ground",
    "traffic",
    "ground-traffic",
)
"""Names of the scenarios that come with echobeam."""


def scenarios() -> list[str]:
    """Return the names of the built-in scenarios."""
    return list(BUILT_IN)


def preset_text(name: str) -> str:
    """Return a built-in scenario's TOML text, comments and all.

    Raises
    ------
    ScenarioError
        If there is no built-in scenario of that name.
    """
    if name not in BUILT_IN:
        raise ScenarioError(f"unknown scenario {name!r}; built in are {', '.join(BUILT_IN)}")
    return (presets() / f"{name}.toml").read_text(encoding="utf-8")


def presets() -> Traversable:
    """Return the folder of the files that come with echobeam."""
    return resources.files("echobeam.scenario") / "presets"


def ships(name: str) -> bool:
    """Return whether a trace's bare name is that of a trace inside the package."""
    return Path(name).name == name and (presets() / name).is_file()
