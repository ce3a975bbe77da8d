"""The direct solver's compiled functions as plain Python, so that tests can call each of them."""

import importlib
import sys
from types import ModuleType, SimpleNamespace

from numba import config

PACKAGE = "echobeam.beamforming.direct"
FILES = (
    "arrays",
    "linear",
    "steering",
    "beams",
    "shape",
    "advance",
    "grid",
    "start",
    "shapes",
    "powers",
    "step",
    "climb",
    "trials",
    "batch",
)


def interpreted() -> SimpleNamespace:
    """Return the modules by name, imported anew without compilation; the others stay compiled."""
    before = {name: module for name, module in sys.modules.items() if name.startswith(PACKAGE)}
    for name in before:
        del sys.modules[name]
    config.DISABLE_JIT = 1
    try:
        found: dict[str, ModuleType] = {
            file: importlib.import_module(f"{PACKAGE}.{file}") for file in FILES
        }
    finally:
        config.DISABLE_JIT = 0
        for name in [name for name in sys.modules if name.startswith(PACKAGE)]:
            del sys.modules[name]
        sys.modules.update(before)
    return SimpleNamespace(**found)
