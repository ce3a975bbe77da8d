"""Tables of samples: CSV with the header ``t,id,x,y[,speed]``, or as SUMO writes it.

Columns may have any order, others are ignored, ids may be quoted, and an empty ``speed`` means
unknown. Vehicles may be interleaved in time or listed one after the other. SUMO separates by
semicolons, names its columns ``timestep_time``, ``vehicle_id`` and so on, leaves all fields of a
vehicle empty in a time step without vehicles, and writes persons into the vehicles' columns, with
an edge but no lane. As in SUMO's XML, persons are ignored.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from echobeam.traces.sample import Sample, fault, read_number

_REQUIRED = ("t", "id", "x", "y")
_NAMES = {
    "t": ("t", "time", "timestep_time"),
    "id": ("id", "vehicle_id"),
    "x": ("x", "vehicle_x"),
    "y": ("y", "vehicle_y"),
    "speed": ("speed", "vehicle_speed"),
    "lane": ("lane", "vehicle_lane"),
    "edge": ("edge", "vehicle_edge"),
}
_SEPARATORS = (",", ";", "\t")
_LONGEST_LINE = 1 << 20


class _Columns(NamedTuple):
    """Indices of the used columns, and number of all columns."""

    t: int
    id: int
    x: int
    y: int
    speed: int | None
    lane: int | None
    edge: int | None
    width: int
    sumo: bool

    def is_person(self, row: list[str]) -> bool:
        """Return whether a row of SUMO is that of a person, who has an edge but no lane."""
        return (
            self.edge is not None
            and self.lane is not None
            and bool(row[self.edge].strip())
            and not row[self.lane].strip()
        )


def looks_like_header(text: str) -> bool:
    """Return whether the beginning of a file may be a header, possibly an incomplete one."""
    line = text.partition("\n")[0]
    names = set(_split(line, _separator(line)))
    return any(names & set(_NAMES[column]) for column in _REQUIRED)


def table_samples(chunks: Iterable[bytes], path: Path) -> Iterator[Sample]:
    """Yield the samples of a table in the order of the file.

    Parameters
    ----------
    chunks
        UTF-8 text, decompressed, in chunks.
    path
        The file's name, for messages.

    Raises
    ------
    TraceError
        If columns are missing or doubled, a row differs from the header in the number of fields
        (as a truncated last one), quotes are not closed, or a value is missing or not a number.
    """
    lines = _text_lines(chunks, path)
    header = ""
    before = 0
    for header in lines:
        if header.strip():
            break
        before += 1
    separator = _separator(header)
    columns = _columns(path, before + 1, _split(header, separator))
    rows = csv.reader(lines, strict=True, delimiter=separator)
    try:
        for row in rows:
            line = before + 1 + rows.line_num
            if not row:
                continue
            if len(row) != columns.width:
                raise fault(
                    path,
                    line,
                    f"{len(row)} fields (cut off?); accepted are {columns.width}, as in the header",
                )
            if (sample := _sample(path, line, row, columns)) is not None:
                yield sample
    except csv.Error as error:
        raise fault(
            path,
            before + 1 + rows.line_num,
            f"damaged row ({error}); accepted are values separated by {separator!r}",
        ) from None


def _text_lines(chunks: Iterable[bytes], path: Path) -> Iterator[str]:
    """Yield the lines with their ends, decoded one by one, so that errors name their line."""
    for count, line in enumerate(_byte_lines(chunks, path), start=1):
        try:
            yield line.decode("utf-8-sig" if count == 1 else "utf-8")
        except UnicodeDecodeError as error:
            raise fault(
                path,
                count,
                f"not readable as text (byte 0x{line[error.start]:02x}); accepted is UTF-8",
            ) from None


def _byte_lines(chunks: Iterable[bytes], path: Path) -> Iterator[bytes]:
    """Yield the lines with their ends: Unix, Windows, or old Macintosh."""
    rest = b""
    for chunk in chunks:
        block = rest + chunk
        lines = block.splitlines(keepends=True)
        # The last line may continue, and a last \r may be half of \r\n.
        rest = lines.pop() if not block.endswith(b"\n") else b""
        if len(rest) > _LONGEST_LINE:
            raise fault(path, None, f"a line of more than {_LONGEST_LINE} bytes; not a trace")
        yield from lines
    if rest:
        yield rest


def _separator(header: str) -> str:
    """Return the separator of the columns: the most frequent one in the header."""
    return max(_SEPARATORS, key=header.count)


def _split(header: str, separator: str) -> list[str]:
    return [re.sub(r'^"(.*)"$', r"\1", name.strip()).strip() for name in header.split(separator)]


def _columns(path: Path, line: int, names: list[str]) -> _Columns:
    """Return the indices of the used columns."""
    accepted = (
        "accepted is a header with t, id, x, y and, if known, speed, or with SUMO's column names"
    )
    found = {
        column: [place for place, name in enumerate(names) if name in known]
        for column, known in _NAMES.items()
    }
    if missing := [column for column in _REQUIRED if not found[column]]:
        text = ",".join(names)
        raise fault(
            path, line, f"no column {', '.join(missing)} in the header {text[:80]!r}; {accepted}"
        )
    if doubled := [column for column, places in found.items() if len(places) > 1]:
        raise fault(path, line, f"column {', '.join(doubled)} more than once; {accepted}")
    t, id_, x, y = (found[column][0] for column in _REQUIRED)
    speed, lane, edge = (
        found[column][0] if found[column] else None for column in ("speed", "lane", "edge")
    )
    return _Columns(t, id_, x, y, speed, lane, edge, len(names), names[t] != "t")


def _sample(path: Path, line: int, row: list[str], columns: _Columns) -> Sample | None:
    """Return the sample of a row; None for a row of SUMO without a vehicle."""
    if columns.sumo and columns.is_person(row):
        return None
    name = row[columns.id].strip()
    x, y = row[columns.x], row[columns.y]
    if not name:
        if columns.sumo and not x.strip() and not y.strip():
            return None
        raise fault(path, line, "id is empty; accepted is a non-empty id")
    speed = row[columns.speed].strip() if columns.speed is not None else ""
    return Sample(
        read_number(path, line, "t", row[columns.t]),
        name,
        read_number(path, line, "x", x),
        read_number(path, line, "y", y),
        read_number(path, line, "speed", speed) if speed else float("nan"),
        line,
    )
