"""Bytes of a trace file, unpacked piece by piece; lines are counted as they come."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterator
from io import BufferedReader

_CHUNK = 1 << 16
_HEAD = 512

Advance = Callable[[int], None]
"""Called with the number of bytes of the file that have been read."""


class Chunks:
    """Stream of the pieces of a file, which may be gzip-compressed.

    Attributes
    ----------
    head
        The first bytes, which tell the format; they come again in the stream.
    lines
        Number of whole lines that have been handed out so far. What a damaged gzip file holds
        before the damage is handed out before the fault is raised.
    """

    def __init__(self, raw: BufferedReader, advance: Advance) -> None:
        packed = raw.peek(2)[:2] == b"\x1f\x8b"
        self._stream = gzip.GzipFile(fileobj=raw) if packed else raw
        self._raw = raw
        self._advance = advance
        self.lines = 0
        self.head = self._stream.peek(_HEAD)[:_HEAD]

    def __iter__(self) -> Iterator[bytes]:
        # Not `read`, which loses what it has when the end of a cut-off file meets it half way.
        while chunk := self._stream.read1(_CHUNK):
            self.lines += chunk.count(b"\n")
            yield chunk
            self._advance(self._raw.tell())
