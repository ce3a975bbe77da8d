"""Provenance of results besides their job: version, libraries and sources.

The same job gives the same bits wherever these agree.
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
"""Packages whose code determines the numbers of a block."""


class Engine(NamedTuple):
    """Provenance of computed numbers.

    Attributes
    ----------
    version
        Version of the package.
    environment
        Versions of Python and libraries, and the processor.
    sources
        SHA-256 of the packages that compute, for code that changes under one version.
    """

    version: str
    environment: str
    sources: str


def engine_here() -> Engine:
    """Return the provenance of numbers computed in this process."""
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
    """Return as text the differences in provenance of a run's start and its continuation.

    Parameters
    ----------
    begun
        Provenance at the start.
    ours
        Provenance where the run continues.
    where
        Word for the place where the run continues.
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
