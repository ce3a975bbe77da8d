"""One sample of a trace, the fault of a trace file, and the reading of its numbers."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from echobeam.faults import InputError, InputWarning

LARGEST = 1e12
"""Largest size of a number in a trace: room for Unix times in seconds and any map's metres."""

NO_VALUE = -1073741824.0
"""SUMO's mark for a value that it does not have (``INVALID_DOUBLE_VALUE``)."""

SHORTEST_STEP = 1e-6
"""s: times of one vehicle that are closer than this are the same time."""

_WANTED = {
    "time": "a finite number of seconds",
    "t": "a finite number of seconds",
    "x": "a finite number of metres",
    "y": "a finite number of metres",
    "speed": "a finite number of metres per second",
}


class TraceError(InputError):
    """A trace that cannot be used; the message names the file, the place and what is accepted."""


class TraceWarning(InputWarning):
    """Part of a trace that is left out or reinterpreted; the message says which, and where."""


class Sample(NamedTuple):
    """Where one vehicle was at one time.

    Attributes
    ----------
    time
        s, on the trace's own clock.
    name
        The vehicle's id.
    x, y
        m, in the trace's plane; `NO_VALUE` where SUMO had no position.
    speed
        m/s; NaN where the trace gives none.
    line
        Line of the file, counted from 1.
    """

    time: float
    name: str
    x: float
    y: float
    speed: float
    line: int


def fault(path: Path, line: int | None, text: str) -> TraceError:
    """Return the error for a fault in a line, or in the file as a whole (``line=None``)."""
    place = str(path) if line is None else f"{path}, line {line}"
    return TraceError(f"{place}: {text}")


def read_number(path: Path, line: int, column: str, text: str) -> float:
    """Return one number of a trace.

    Raises
    ------
    TraceError
        If the text is no number, not finite, or larger than `LARGEST`.
    """
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    # Python's float() also takes "1_000", which no trace writer means.
    if not abs(value) <= LARGEST or "_" in text:
        raise fault(
            path, line, f"{column} = {text!r}; accepted is {_WANTED[column]}, at most {LARGEST:g}"
        )
    return value
