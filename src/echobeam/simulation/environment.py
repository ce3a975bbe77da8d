"""Environment of a run: versions of what the numbers depend on besides the package itself."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

LIBRARIES = ("numpy", "scipy", "numba", "clarabel")
"""Libraries whose version may change the last bits of a result."""


@cache
def environment() -> str:
    """Return Python, libraries and processor as one text, ``name version; ...``."""
    parts = [f"python {platform.python_version()}"]
    for library in LIBRARIES:
        try:
            parts.append(f"{library} {version(library)}")
        except PackageNotFoundError:
            parts.append(f"{library} none")
    return "; ".join([*parts, f"machine {platform.machine()}"])
