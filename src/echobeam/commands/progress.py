"""Progress of long work: a bar in a terminal, a line in a notebook or a log."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from time import monotonic
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echobeam.store.work import Progress

Bar = Callable[[str], AbstractContextManager["Progress"]]
"""Progress display with a label that is known only after the input is read."""

BETWEEN_LINES = 15.0
"""Time between the lines of a log, s: a few lines per minute of work."""

BETWEEN_UPDATES = 0.2
"""Time between updates of a notebook's line, s."""

SHORT = 1.0
"""Duration of work called from Python that shows no progress, s."""


@contextmanager
def progress_bar(label: str, *, quiet: bool) -> Iterator[Progress]:
    """Yield a function that shows progress on stderr; a silent one if ``quiet``.

    Without a terminal it prints a line every `BETWEEN_LINES`, and one at the end.
    """
    if quiet or sys.stderr is None:
        yield _silent
    elif _terminal():
        with _rich_bar(label, wait=0.0) as show:
            yield show
    else:
        line = _Line(label, BETWEEN_LINES, lambda text: print(text, file=sys.stderr, flush=True))
        yield line
        line.end()


@contextmanager
def interactive_bar(label: str, *, quiet: bool) -> Iterator[Progress]:
    """Yield a function that shows progress in a terminal or notebook, and nowhere else.

    Work that takes less than `SHORT` shows none.
    """
    notebook = _notebook_line()
    if quiet:
        yield _silent
    elif notebook is not None:
        line = _Line(label, BETWEEN_UPDATES, notebook, wait=SHORT)
        yield line
        if line.shown:
            line.end()
    elif _terminal():
        with _rich_bar(label, wait=SHORT) as show:
            yield show
    else:
        yield _silent


def _silent(done: int, total: int) -> None:
    """Show nothing."""


def _terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def _rich_bar(label: str, wait: float) -> Iterator[Progress]:
    """Yield a progress bar with the remaining time, shown after ``wait`` seconds of work."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("elapsed"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
    )
    task = bar.add_task(label, total=None)
    begun = monotonic()

    def show(done: int, total: int) -> None:
        if monotonic() - begun >= wait:
            bar.start()  # only once work has begun: wrong input gets its message alone
        bar.update(task, completed=done, total=total)

    try:
        yield show
    finally:
        if bar.live.is_started:  # stopping a bar that never started would print an empty line
            bar.stop()


def _notebook_line() -> Callable[[str], None] | None:
    """Return a function that updates a line in a notebook; None outside of one.

    rich would need ipywidgets in a notebook, and warns without them.
    """
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if not hasattr(shell, "kernel"):
        return None
    from importlib import import_module

    display: Any = import_module("IPython.display").display
    handles: list[Any] = []

    def show(text: str) -> None:
        bundle = {"text/plain": text}
        if handles:
            handles[0].update(bundle, raw=True)
        else:
            handles.append(display(bundle, raw=True, display_id=True))

    return show


class _Line:
    """Progress as a line of text at fixed intervals."""

    def __init__(
        self, label: str, every: float, show: Callable[[str], None], wait: float | None = None
    ) -> None:
        self.label, self.every, self.show = label, every, show
        self.begun = monotonic()
        self.next = self.begun + (every if wait is None else wait)
        self.last: tuple[int, int] | None = None
        self.shown = False

    def __call__(self, done: int, total: int) -> None:
        self.last = done, total
        if monotonic() >= self.next:
            self.next = monotonic() + self.every
            self.shown = True
            self.show(self._text(done, total))

    def end(self) -> None:
        """Show the final state, if any work was done."""
        if self.last is not None:
            self.show(self._text(*self.last))

    def _text(self, done: int, total: int) -> str:
        elapsed = monotonic() - self.begun
        share = done / total if total else 0.0
        left = f", {_clock(elapsed / share - elapsed)} left" if 0.0 < share < 1.0 else ""
        return f"{self.label}: {100 * share:.0f}%, {_clock(elapsed)} elapsed{left}"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"
