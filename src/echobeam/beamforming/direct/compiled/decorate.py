"""Numba's decorators with a type, so that compiled functions keep theirs.

Only the outermost function is kept on disk, whole: Numba would not notice that a function in
another file has changed. A fingerprint of all the sources is part of that function's key.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, cast

njit: Any = import_module("numba").njit  # whose own types know fewer options

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "nogil": True,
    # Sums may be taken in any order, or they would not use vector instructions; infinities and
    # NaN keep their meaning.
    "fastmath": {"reassoc", "contract", "nsz"},
}


NOT_COMPILED = ("__init__.py", "batch.py", "contest.py")
"""Sources of the direct solver that compiled code takes nothing from."""


def compiled(function: Function) -> Function:
    """Compile a function together with those that call it."""
    return cast(Function, njit(**OPTIONS)(function))


def compiled_once(function: Function) -> Function:
    """Compile a function on its first use and keep the result on disk, where that is possible.

    Its key has what it is a closure over, but not what the functions that it calls do.
    """
    try:
        return cast(Function, njit(cache=True, **OPTIONS)(function))
    except RuntimeError:  # Neither the package's folder nor the user's cache can be written to.
        return cast(Function, njit(**OPTIONS)(function))


def fingerprint() -> str:
    """Return what changes whenever a source changes that the compiled code is made from."""
    here = Path(__file__).parent
    sources = {*here.glob("*.py"), *here.parent.glob("*.py")} - {
        here.parent / name for name in NOT_COMPILED
    }
    digest = hashlib.sha256()
    for source in sorted(sources):
        digest.update(source.read_bytes())
    return digest.hexdigest()
