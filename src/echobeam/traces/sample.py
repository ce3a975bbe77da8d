"""Sample of a trace, error of a trace file, and conversion of its numbers."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from echobeam.faults import InputError, InputWarning

LARGEST = 1e12
"""Largest absolute value of a number in a trace: enough for Unix times in s and maps in m."""

NO_VALUE = -1073741824.0
"""Mark of SUMO for an unknown value (``INVALID_DOUBLE_VALUE``)."""

SHORTEST_STEP = 1e-6
"""Shortest time between two samples of a vehicle, s; closer ones are at the same time."""

_WANTED = {
    "time": "a finite number of seconds",
    "t": "a finite number of seconds",
    "x": "a finite number of metres",
    "y": "a finite number of metres",
    "speed": "a finite number of metres per second",
}


class TraceError(InputError):
    """Error of a trace file; the message names the file, the line and the accepted input."""


class TraceWarning(InputWarning):
    """Warning of data in a trace that are omitted or reinterpreted; the message names them."""


class Sample(NamedTuple):
    """Position of one vehicle at one time.

    Attributes
    ----------
    time
        Time on the trace's clock, s.
    name
        The vehicle's id.
    x, y
        Position in the trace's plane, m; `NO_VALUE` where SUMO had none.
    speed
        Speed, m/s; NaN if the trace gives none.
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
    """Return the error for a line, or for the whole file (``line=None``)."""
    place = str(path) if line is None else f"{path}, line {line}"
    return TraceError(f"{place}: {text}")


def read_number(path: Path, line: int, column: str, text: str) -> float:
    """Return a number of a trace from its text.

    Raises
    ------
    TraceError
        If the text is not a number, not finite, or larger than `LARGEST`.
    """
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    # Python's float() also accepts "1_000", which no trace writer intends.
    if not abs(value) <= LARGEST or "_" in text:
        raise fault(
            path, line, f"{column} = {text!r}; accepted is {_WANTED[column]}, at most {LARGEST:g}"
        )
    return value
