"""Progress of the reading of long traces.

A trace is read deep inside a run, once for all trials, and its motion is cached. Progress is
therefore requested by a context around the run, not by an argument passed down to the reader.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path

from echobeam.traces.chunks import Advance

Progress = Callable[[int, int], None]

LONG = 1 << 20
"""Smallest size of a file whose reading shows progress, bytes; a smaller one takes about 1 s."""


def _silent(done: int, total: int) -> None:
    """Show nothing."""


_watcher: ContextVar[Progress] = ContextVar("watcher", default=_silent)


@contextmanager
def reading_shown(bar: Callable[[str], AbstractContextManager[Progress]]) -> Iterator[None]:
    """Show progress bars for the reading of long traces.

    Parameters
    ----------
    bar
        Function that returns a progress bar for a label.
    """
    with ExitStack() as bars:
        open_bars: list[Progress] = []

        def show(done: int, total: int) -> None:
            if not open_bars:
                open_bars.append(bars.enter_context(bar("reading the trace")))
            open_bars[0](done, total)
            if done >= total:
                open_bars.clear()
                bars.close()

        with watched(show):
            yield


@contextmanager
def watched(show: Progress) -> Iterator[None]:
    """Call ``show`` with the bytes read and the total while a long trace is read."""
    token = _watcher.set(show)
    try:
        yield
    finally:
        _watcher.reset(token)


def meter(path: Path, reading: int, readings: int) -> Advance:
    """Return the progress function of one of several readings of a file.

    Parameters
    ----------
    path
        Path of the file.
    reading, readings
        Number of this reading, counted from 0, and number of all readings.
    """
    size = path.stat().st_size if path.is_file() else 0
    show = _watcher.get() if size >= LONG else _silent

    def advance(done: int) -> None:
        show(reading * size + done, readings * size)

    return advance
