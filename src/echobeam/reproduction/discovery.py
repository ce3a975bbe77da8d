"""Discovery of figures and claims: each module of their packages defines its own."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType

from echobeam.reproduction import claims
from echobeam.reproduction.records import Claim


def modules(package: ModuleType) -> Iterator[ModuleType]:
    """Import the modules of a package in the order of their names."""
    for found in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        yield import_module(found.name)


def find_claims() -> list[Claim]:
    """Return the claims of all modules in `claims`."""
    return [claim for module in modules(claims) for claim in module.CLAIMS]
