"""NetCDF-4 files, written so that a full disk is reported as an error.

HDF5 does not survive a failed write: it cannot close the file, and the process crashes at exit.
It therefore writes through a file object that holds back an error until HDF5 has finished.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echobeam.store.writing import replacing

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer


class Sink(io.RawIOBase):
    """File that stores the first write error, and discards the data written after it."""

    def __init__(self, path: Path) -> None:
        self.raw = path.open("w+b", buffering=0)
        self.fault: OSError | None = None

    def readable(self) -> bool:
        """Return True: HDF5 reads back the data it has written."""
        return True

    def writable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """Move to an offset in the file."""
        return self.raw.seek(offset, whence)

    def tell(self) -> int:
        """Return the offset in the file."""
        return self.raw.tell()

    def readinto(self, buffer: WriteableBuffer, /) -> int | None:
        """Read bytes into a buffer."""
        return self.raw.readinto(buffer)

    def write(self, data: ReadableBuffer, /) -> int:
        """Write all bytes, or store the error."""
        view = memoryview(data).cast("B")
        self._try(lambda: self._write_all(view))
        return len(view)

    def truncate(self, size: int | None = None, /) -> int:
        """Cut or lengthen the file."""
        self._try(lambda: self.raw.truncate(size))
        return self.tell() if size is None else size

    def flush(self) -> None:
        """Do nothing: there is no buffer."""

    def close(self) -> None:
        """Close the file."""
        self._try(self.raw.close)
        super().close()

    def check(self) -> None:
        """Raise the stored error, if any."""
        if self.fault is not None:
            raise self.fault

    def _write_all(self, view: memoryview) -> None:
        done = 0
        while done < len(view):
            done += self.raw.write(view[done:]) or 0

    def _try(self, action: Callable[[], object]) -> None:
        if self.fault is None:
            try:
                action()
            except OSError as fault:
                self.fault = fault


@contextmanager
def netcdf_file(path: Path) -> Iterator[tuple[Any, Callable[[], None]]]:
    """Yield a NetCDF-4 file to write, under a temporary name that is renamed at the end.

    Also yield a function that raises a disk error that has occurred, so that writing can stop
    early.

    Raises
    ------
    OSError
        If the disk is full or the path cannot be written; the file is then as it was before.
    """
    import h5netcdf

    with replacing(path) as temporary:
        sink = Sink(temporary)
        try:
            with h5netcdf.File(sink, "w") as file:
                yield file, sink.check
        finally:
            sink.close()
            sink.check()  # raises the cause rather than HDF5's own error
