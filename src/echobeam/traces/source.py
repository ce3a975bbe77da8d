"""A trace file as a stream of samples, whatever its format and packing.

Both are told by content: gzip by its magic number, XML by its first character, CSV by its header.
Samples come one by one; what is remembered is the last time of each vehicle.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

from echobeam.traces.fcd import fcd_samples
from echobeam.traces.sample import SHORTEST_STEP, Sample, TraceError, fault
from echobeam.traces.table import REQUIRED, table_samples

_FORMATS = (
    "accepted are SUMO FCD XML and CSV with the header t,id,x,y or t,id,x,y,speed, "
    "plain or gzip-compressed"
)


def read_samples(path: str | Path) -> Iterator[Sample]:
    """Yield the samples of a trace in the file's order, each vehicle's in order of time.

    Parameters
    ----------
    path
        SUMO FCD XML or CSV, either may be gzip-compressed.

    Raises
    ------
    TraceError
        If the file cannot be read, is empty, cut off or in no known format; if a value is
        missing or no number; if a vehicle goes back in time or has two samples at one time.
    """
    file = Path(path)
    last_line = 0
    try:
        with file.open("rb") as raw:
            packed = raw.peek(2)[:2] == b"\x1f\x8b"
            stream = cast(BinaryIO, gzip.GzipFile(fileobj=raw) if packed else raw)
            for sample in _in_order(_parsed(stream, file), file):
                last_line = sample.line
                yield sample
    except EOFError:
        raise fault(file, None, f"the gzip data are cut off after line {last_line}") from None
    except (gzip.BadGzipFile, zlib.error) as error:
        raise fault(file, None, f"damaged gzip data after line {last_line} ({error})") from None
    except OSError as error:
        raise fault(file, None, f"cannot be read ({error.strerror}); {_FORMATS}") from None


def _parsed(stream: BinaryIO, path: Path) -> Iterator[Sample]:
    """Choose the parser by the first characters."""
    head = cast(gzip.GzipFile, stream).peek(512)[:512]
    if not head:
        raise fault(path, None, f"the file is empty; {_FORMATS}")
    text = head.decode("utf-8", "replace").lstrip("\ufeff \t\r\n")
    if text.startswith("<"):
        return fcd_samples(stream, path)
    names = {name.strip().strip('"') for name in text.partition("\n")[0].split(",")}
    if b"\0" in head or not names & set(REQUIRED):
        raise fault(path, None, f"unknown format, begins with {text[:40]!r}; {_FORMATS}")
    return table_samples(stream, path)


def _in_order(samples: Iterator[Sample], path: Path) -> Iterator[Sample]:
    """Pass the samples on and see to it that each vehicle's times increase."""
    last: dict[str, float] = {}
    for sample in samples:
        before = last.get(sample.name)
        if before is not None and sample.time - before < SHORTEST_STEP:
            raise _order_fault(path, sample, before)
        last[sample.name] = sample.time
        yield sample


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
