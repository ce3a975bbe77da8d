"""Comma-separated traces with the header ``t,id,x,y`` or ``t,id,x,y,speed``.

Columns stand in any order, others are passed over, ids may be quoted, and an empty ``speed``
means that it is not known. Vehicles may be mixed by time or listed one after the other.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from echobeam.traces.sample import Sample, fault, read_number

REQUIRED = ("t", "id", "x", "y")


def table_samples(stream: BinaryIO, path: Path) -> Iterator[Sample]:
    """Yield the samples of a CSV trace in its order.

    Parameters
    ----------
    stream
        The text in UTF-8, decompressed.
    path
        The file's name, for messages.

    Raises
    ------
    TraceError
        If columns are missing or doubled, a row has another number of fields than the header
        (as a cut-off last one has), quotes are not closed, or a value is missing or no number.
    """
    rows = csv.reader(io.TextIOWrapper(stream, encoding="utf-8-sig", newline=""), strict=True)
    columns: dict[str, int] | None = None
    width = 0
    try:
        for row in rows:
            if not row:
                continue
            if columns is None:
                columns, width = _columns(path, rows.line_num, row), len(row)
            elif len(row) != width:
                raise fault(
                    path,
                    rows.line_num,
                    f"{len(row)} fields (cut off?); accepted are {width}, as in the header",
                )
            else:
                yield _sample(path, rows.line_num, row, columns)
    except csv.Error as error:
        raise fault(
            path, rows.line_num, f"damaged row ({error}); accepted are comma-separated values"
        ) from None
    except UnicodeDecodeError:
        raise fault(
            path, rows.line_num + 1, "not readable as text; accepted is UTF-8 from here on"
        ) from None


def _columns(path: Path, line: int, header: list[str]) -> dict[str, int]:
    """Return where the columns that count stand."""
    names = [name.strip() for name in header]
    accepted = "accepted is a header with t, id, x, y and, if known, speed"
    if missing := [name for name in REQUIRED if name not in names]:
        text = ",".join(names)
        raise fault(
            path, line, f"no column {', '.join(missing)} in the header {text[:80]!r}; {accepted}"
        )
    columns = {name: names.index(name) for name in (*REQUIRED, "speed") if name in names}
    if doubled := [name for name in columns if names.count(name) > 1]:
        raise fault(path, line, f"column {', '.join(doubled)} more than once; {accepted}")
    return columns


def _sample(path: Path, line: int, row: list[str], columns: dict[str, int]) -> Sample:
    name = row[columns["id"]].strip()
    if not name:
        raise fault(path, line, "id is empty; accepted is a non-empty id")
    speed = row[columns["speed"]] if "speed" in columns else ""
    return Sample(
        read_number(path, line, "t", row[columns["t"]]),
        name,
        read_number(path, line, "x", row[columns["x"]]),
        read_number(path, line, "y", row[columns["y"]]),
        read_number(path, line, "speed", speed) if speed.strip() else float("nan"),
        line,
    )
