"""Bytes of a trace file, decompressed in chunks, with a count of lines."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterator
from io import BufferedReader

_CHUNK = 1 << 16
_HEAD = 512

Advance = Callable[[int], None]
"""Function that is called with the number of bytes read from the file."""


class Chunks:
    """Stream of the chunks of a file, which may be gzip-compressed.

    Attributes
    ----------
    head
        First bytes, which identify the format; they are also part of the stream.
    lines
        Number of complete lines yielded so far. The data before the damage in a gzip file are
        yielded before the error is raised.
    """

    def __init__(self, raw: BufferedReader, advance: Advance) -> None:
        packed = raw.peek(2)[:2] == b"\x1f\x8b"
        self._stream = gzip.GzipFile(fileobj=raw) if packed else raw
        self._raw = raw
        self._advance = advance
        self.lines = 0
        self.head = self._stream.peek(_HEAD)[:_HEAD]

    def __iter__(self) -> Iterator[bytes]:
        # Not `read`, which loses its data at the end of a truncated file.
        while chunk := self._stream.read1(_CHUNK):
            self.lines += chunk.count(b"\n")
            yield chunk
            self._advance(self._raw.tell())
