"""Origin of numbers besides their job: version, libraries and sources.

The same job gives the same bits wherever these are the same.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import NamedTuple

from echobeam.simulation.environment import differences as environments
from echobeam.simulation.environment import environment
from echobeam.version import __version__

COMPUTING = (
    "simulation",
    "schemes",
    "tracking",
    "beamforming",
    "physics",
    "sensing",
    "estimation",
    "scenario",
    "traces",
    "values",
    "brief",
    "units",
    "numerals",
)
"""Rooms that a block's numbers come from."""


class Engine(NamedTuple):
    """What computes.

    Attributes
    ----------
    version
        Of the package.
    environment
        Python, libraries and processor.
    sources
        SHA-256 of the rooms that compute, for code that changes under one version.
    """

    version: str
    environment: str
    sources: str


def engine_here() -> Engine:
    """Return what computes in this process."""
    return Engine(__version__, environment(), _sources())


@cache
def _sources() -> str:
    package = Path(__file__).parents[1]
    rooms = [[package / f"{room}.py", *(package / room).rglob("*.py")] for room in COMPUTING]
    digest = hashlib.sha256()
    for path in sorted(path for room in rooms for path in room if path.is_file()):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def differences(begun: Engine, ours: Engine, where: str = "here") -> str:
    """Return in words with what work was begun that is not ``where`` it should go on; or nothing.

    Parameters
    ----------
    begun
        With what it was begun.
    ours
        What computes where it should go on.
    where
        The word for that place.
    """
    if begun.version != ours.version:
        return f"version {begun.version} ({where} {ours.version})"
    said = [
        f"{name} {then} ({where} {now})"
        for name, (then, now) in environments(begun.environment, ours.environment).items()
    ]
    if not said and begun.sources != ours.sources:
        said.append(f"other code of version {begun.version} than {where}")
    return ", ".join(said)
