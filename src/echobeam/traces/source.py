"""Stream of the samples of a trace file, for all formats and compressions.

The content determines both: gzip has its magic number, XML its first character, CSV its header.
Samples are yielded one by one; only the last time of each vehicle is stored.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path

from echobeam.traces.chunks import Advance, Chunks
from echobeam.traces.fcd import fcd_samples
from echobeam.traces.sample import NO_VALUE, SHORTEST_STEP, Sample, TraceError, fault
from echobeam.traces.table import looks_like_header, table_samples

_FORMATS = (
    "accepted are SUMO FCD XML and CSV with the header t,id,x,y or t,id,x,y,speed or with "
    "SUMO's column names, plain or gzip-compressed"
)


def _unwatched(done: int) -> None:
    """Show no progress."""


def read_samples(path: str | Path, advance: Advance = _unwatched) -> Iterator[Sample]:
    """Yield the samples of a trace in the order of the file, each vehicle's in order of time.

    Parameters
    ----------
    path
        SUMO FCD XML or CSV, either may be gzip-compressed.
    advance
        Called with the number of bytes read from the file.

    Raises
    ------
    TraceError
        If the file cannot be read, is empty, truncated or of unknown format; if a value is
        missing or not a number; if a vehicle goes back in time or has two samples at one time.
    """
    file = Path(path)
    chunks: Chunks | None = None
    try:
        with file.open("rb") as raw:
            chunks = Chunks(raw, advance)
            yield from _in_order(_parsed(chunks, file), file)
    except EOFError:
        raise fault(file, None, f"the gzip data are cut off after line {_lines(chunks)}") from None
    except (gzip.BadGzipFile, zlib.error) as error:
        raise fault(
            file, None, f"damaged gzip data after line {_lines(chunks)} ({error})"
        ) from None
    except OSError as error:
        raise fault(file, None, f"cannot be read ({error.strerror}); {_FORMATS}") from None


def _lines(chunks: Chunks | None) -> int:
    return 0 if chunks is None else chunks.lines


def _parsed(chunks: Chunks, path: Path) -> Iterator[Sample]:
    """Select the parser by the first characters."""
    if not chunks.head:
        raise fault(path, None, f"the file is empty; {_FORMATS}")
    text = chunks.head.decode("utf-8", "replace").lstrip("\ufeff \t\r\n")
    if b"\0" in chunks.head and _readable(text.replace("\0", "").lstrip("\ufffd")):
        raise fault(path, None, f"holds zero bytes: not UTF-8 text (UTF-16?); {_FORMATS}")
    if text.startswith("<"):
        return fcd_samples(chunks, path)
    if b"\0" in chunks.head or not looks_like_header(text):
        raise fault(path, None, f"unknown format, begins with {text[:40]!r}; {_FORMATS}")
    return table_samples(chunks, path)


def _readable(text: str) -> bool:
    return text.startswith("<") or looks_like_header(text)


def _in_order(samples: Iterator[Sample], path: Path) -> Iterator[Sample]:
    """Yield the samples, and check that each vehicle's times increase."""
    last: dict[str, float] = {}
    for sample in samples:
        before = last.get(sample.name)
        if before is not None and sample.time - before < SHORTEST_STEP:
            raise _order_fault(path, sample, before)
        last[sample.name] = sample.time
        yield sample if sample.speed != NO_VALUE else sample._replace(speed=float("nan"))


def _order_fault(path: Path, sample: Sample, before: float) -> TraceError:
    who = f"vehicle {sample.name!r}"
    if sample.time > before - SHORTEST_STEP:
        return fault(
            path,
            sample.line,
            f"second sample of {who} at t = {sample.time!r}; accepted is one per vehicle and time",
        )
    return fault(
        path,
        sample.line,
        f"t = {sample.time!r} of {who} goes back in time, after {before!r}; accepted are "
        "increasing times of each vehicle",
    )
