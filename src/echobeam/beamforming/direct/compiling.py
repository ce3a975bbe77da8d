"""Compilation of the direct solver by Numba: decorators that keep types, and the first call.

Only the outermost function is kept on disk, whole: Numba would not notice that a function in
another file has changed. A fingerprint of all the sources is part of that function's key.
"""

from __future__ import annotations

import hashlib
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, cast

event: Any = import_module("numba.core.event")
njit: Any = import_module("numba").njit  # whose own types know fewer options

Progress = Callable[[int, int], None]
Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "nogil": True,
    # Sums keep their order: with "reassoc" the compiled code chooses one by how far apart two
    # arrays lie in memory, and the last bits with it. It was 4 % faster.
    "fastmath": {"contract", "nsz"},
}


NOT_COMPILED = ("__init__.py", "batch.py", "found.py", "layout.py", "subsets.py")
"""Sources of the direct solver that compiled code takes nothing from."""


ABOUT = 23
"""s that the compiler takes, about, on one processor of the kind that it was measured on."""

FUNCTIONS: list[str] = []
"""Names of the functions that are compiled on their own."""


def compiled(function: Function) -> Function:
    """Compile a function together with those that call it; Python itself cannot call it.

    The wrappers for calls from Python and from C would take a fifth of the compiler's time.
    """
    FUNCTIONS.append(function.__name__)
    return cast(Function, njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **OPTIONS)(function))


def inlined(function: Function) -> Function:
    """Compile a function as a part of the only one that calls it.

    For the long ones at the top: every function is optimised and turned into machine code on its
    own, and its code again within each that calls it. Without these levels the compiler took 27 in
    place of 37 CPU seconds; for the many short ones below it would take longer.
    """
    return cast(Function, njit(inline="always", **OPTIONS)(function))


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
    sources = set(here.glob("*.py")) - {here / name for name in NOT_COMPILED}
    digest = hashlib.sha256()
    for source in sorted(sources):
        digest.update(source.read_bytes())
    return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class Compilation:
    """Outcome of a request to compile.

    Attributes
    ----------
    fresh
        Whether anything was compiled; false where it was on disk, or done already.
    seconds
        s that it took.
    folder
        Where the code is kept; None if it is not.
    """

    fresh: bool
    seconds: float
    folder: Path | None


def compile_now(run: Any, arguments: tuple[object, ...], progress: Progress) -> Compilation:
    """Call a function of `compiled_once` for the first time; say so if that means compiling it.

    Parameters
    ----------
    run
        The function.
    arguments
        With the types of all later calls; there should be nothing for it to do.
    progress
        As in `echobeam.beamforming.direct.trials.compile_solver`.
    """
    stats = getattr(run, "stats", None)  # interpreted functions have none
    folder = None if stats is None or stats.cache_path is None else Path(stats.cache_path)
    watch, begun = _Watch(folder, progress), time.perf_counter()
    with event.install_listener("numba:compile", watch):
        run(*arguments)
    if watch.done:
        progress(len(FUNCTIONS) + 1, len(FUNCTIONS) + 1)
    return Compilation(watch.done > 0, time.perf_counter() - begun, folder)


class _Watch(event.Listener):  # type: ignore[misc]
    """Listener that tells the user when compilation begins, and how far it is."""

    def __init__(self, folder: Path | None, progress: Progress) -> None:
        self.folder, self.progress = folder, progress
        self.done = 0
        self.announced = False

    def on_start(self, happened: Any) -> None:
        """Say once that the solver is being compiled, and where it will be kept."""
        if not self.announced:
            self.announced = True
            logging.getLogger("echobeam").warning(message(self.folder))

    def on_end(self, happened: Any) -> None:
        """Count a function of ours."""
        if happened.data["dispatcher"].py_func.__module__.startswith(__package__ or ""):
            self.done += 1
            self.progress(min(self.done, len(FUNCTIONS)), len(FUNCTIONS) + 1)  # some twice


def message(folder: Path | None) -> str:
    """Return the words that say what the user waits for."""
    begin = f"compiling the beam solver, about {ABOUT} s"
    if folder is None:
        return (
            f"{begin}; it cannot be kept: neither the package's folder nor the user's cache can be "
            "written to; set NUMBA_CACHE_DIR to a folder that can"
        )
    return f"{begin}; it is kept in {folder} for later runs"
