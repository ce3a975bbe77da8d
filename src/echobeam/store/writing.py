"""Atomic writing of files: a reader never sees an incomplete one."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from echobeam.faults import InputError


class StoreError(InputError):
    """Error of a path that cannot be read, written or overwritten; the message gives the reason."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` to write to, and rename it to ``path`` at the end.

    On an error the temporary file is removed and ``path`` is unchanged.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def clear_leftovers(path: Path) -> None:
    """Remove the temporary files of killed processes that were writing ``path``."""
    for leftover in path.parent.glob(f".{glob.escape(path.name)}.*.tmp"):
        leftover.unlink(missing_ok=True)


def check_writable(path: Path, *, force: bool) -> None:
    """Refuse a path that exists (without ``force``) or cannot be written, before any work is done.

    Raises
    ------
    StoreError
        Names the path and a remedy.
    """
    try:
        os.fsencode(path)
        path.lstat()
    except FileNotFoundError:
        pass
    except UnicodeEncodeError:
        raise StoreError(
            f"{path}: the locale of this process cannot encode this file name; give another --out"
        ) from None
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror}") from None
    if path.is_dir():
        raise StoreError(f"{path}: is a directory; give a file name, such as {path / 'result.nc'}")
    if path.exists() and not path.is_file():
        raise StoreError(f"{path}: is not a regular file; give another --out")
    if path.exists() and not force:
        raise StoreError(f"{path}: exists already; give another --out, or --force to replace it")
    if not path.parent.is_dir():
        raise StoreError(f"{path}: no directory {path.parent}")
    try:
        _probe(path)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror}") from None


def make_writable(directory: Path) -> None:
    """Make a directory if necessary, and refuse one that cannot be written to.

    Raises
    ------
    StoreError
        Names the directory and the reason.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{directory}: cannot be made: {error.strerror}") from None
    try:
        _probe(directory / "result")
    except OSError as error:
        raise StoreError(f"{directory}: cannot be written to: {error.strerror}") from None


def _probe(path: Path) -> None:
    """Create and remove a file beside a path, to test that its directory is writable."""
    probe = path.with_name(f".{path.name}.{os.getpid()}.probe")
    probe.touch()
    probe.unlink()
