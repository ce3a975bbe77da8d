"""The direct solver's compiled functions as plain Python, so that tests can call each of them."""

import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from numba import config

from echobeam.beamforming.problem import ProblemBatch

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
    "layout",
    "trials",
    "batch",
)


@cache
def interpreted() -> SimpleNamespace:
    """Return the modules by name, imported anew without compilation; the others stay compiled."""
    with _in_place_of_the_compiled_ones({}) as modules:
        for file in FILES:
            importlib.import_module(f"{PACKAGE}.{file}")
        modules.update(_loaded())
    files: dict[str, Any] = {file: modules[f"{PACKAGE}.{file}"] for file in FILES}
    return SimpleNamespace(**files, modules=modules)


def solve_interpreted(batch: ProblemBatch) -> Any:
    """Return what the interpreted solver finds for a batch: nothing of it is compiled.

    The solver is put together when it is first called, from modules that it looks up then.
    """
    direct = interpreted()
    with _in_place_of_the_compiled_ones(direct.modules), np.errstate(all="ignore"):
        assert isinstance(direct.trials.ready(), FunctionType)
        return direct.batch.solve_batch(batch)


def _loaded() -> dict[str, ModuleType]:
    return {
        name: module
        for name, module in sys.modules.items()
        if name == PACKAGE or name.startswith(f"{PACKAGE}.")
    }


@contextmanager
def _in_place_of_the_compiled_ones(
    modules: dict[str, ModuleType],
) -> Iterator[dict[str, ModuleType]]:
    """Have these modules imported in place of those of the same names, and the compiler idle."""
    before, idle = _loaded(), config.DISABLE_JIT
    _exchange(modules)
    config.DISABLE_JIT = 1
    try:
        yield modules
    finally:
        config.DISABLE_JIT = idle
        _exchange(before)


def _exchange(modules: dict[str, ModuleType]) -> None:
    for name in _loaded():
        del sys.modules[name]
    sys.modules.update(modules)
    if PACKAGE in modules:
        parent, name = PACKAGE.rsplit(".", 1)
        setattr(sys.modules[parent], name, modules[PACKAGE])
