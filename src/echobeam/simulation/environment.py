"""Environment of a run: versions of what the numbers depend on besides the package itself."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

LIBRARIES = ("numpy", "scipy", "numba", "clarabel")
"""Libraries whose version may change the last bits of a result."""

_CPUINFO = Path("/proc/cpuinfo")

_MODEL = ("vendor_id", "cpu family", "model", "CPU implementer", "CPU part")
"""Keys of Linux's description by which compilers and linear algebra choose their code."""

_VECTORS = ("avx512f", "avx2", "avx", "sve", "asimd")
"""Vector instructions, widest first: a virtual machine may hide some of a processor's."""


@cache
def environment() -> str:
    """Return Python, libraries and processor as one text, ``name version; ...``."""
    parts = [f"python {platform.python_version()}"]
    for library in LIBRARIES:
        try:
            parts.append(f"{library} {version(library)}")
        except PackageNotFoundError:
            parts.append(f"{library} none")
    return "; ".join([*parts, f"processor {_processor()}"])


def differences(one: str, other: str) -> dict[str, tuple[str, str]]:
    """Return in what two environments differ: by name, the version of each, "none" if missing."""
    versions = [dict(_named(part) for part in text.split("; ") if part) for text in (one, other)]
    names = dict.fromkeys(name for each in versions for name in each)
    pairs = {name: (versions[0].get(name, "none"), versions[1].get(name, "none")) for name in names}
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}


def _named(part: str) -> tuple[str, str]:
    name, _, rest = part.partition(" ")
    return name, rest


def _processor() -> str:
    """Return the kind of processor: architecture, model, widest vector instructions."""
    try:
        described = processor_model(_CPUINFO.read_text(encoding="utf-8", errors="replace"))
    except OSError:  # no Linux
        described = platform.processor()
    return f"{platform.machine()} {described}".strip()


def processor_model(cpuinfo: str) -> str:
    """Return model and widest vector instructions from Linux's description of the processors."""
    lines = (line.partition(":") for line in cpuinfo.split("\n\n")[0].splitlines())
    values = {key.strip(): value.strip() for key, _, value in lines}
    flags = (values.get("flags") or values.get("Features") or "").split()
    widest = next((vector for vector in _VECTORS if vector in flags), "")
    return " ".join(filter(None, [*(values.get(key, "") for key in _MODEL), widest]))
