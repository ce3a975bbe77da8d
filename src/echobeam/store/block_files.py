"""The blocks of a run on disk: what makes an interrupted run go on where it stopped."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from echobeam.faults import InputError, RunError
from echobeam.schemes.base import SchemeError
from echobeam.simulation.blocks import Block
from echobeam.store.engine import Engine, differences, engine_here
from echobeam.store.writing import StoreError, replacing

MANIFEST = "job.json"
ENGINE = "engine"
FIRST = "first"
"""Under this name a block's file says which trial is its first."""


@dataclass(frozen=True, slots=True)
class Job:
    """What is computed: two runs are the same if and only if their jobs are.

    Attributes
    ----------
    kind
        Which command's blocks they are.
    scenarios
        Complete TOML texts.
    schemes
        Names, or ``path/to/file.py:name``.
    inputs
        Digests of the files that the run reads besides: traces and users' schemes.
    seed, trials
        As in the result.
    engine
        What computes; that of this process.
    """

    kind: str
    scenarios: tuple[str, ...]
    schemes: tuple[str, ...]
    inputs: tuple[str, ...]
    seed: int
    trials: int
    engine: Engine = field(default_factory=engine_here)

    def digest(self) -> str:
        """Return a fingerprint: equal for the same job, different for any other."""
        return hashlib.sha256(self.text().encode()).hexdigest()

    def text(self) -> str:
        """Return the job as it is kept beside its blocks, JSON."""
        return json.dumps({**asdict(self), ENGINE: self.engine._asdict()}, indent=1)


@dataclass(frozen=True, slots=True)
class BlockFiles:
    """A directory of finished blocks beside the result that they will become."""

    directory: Path

    @classmethod
    def beside(cls, result: Path) -> BlockFiles:
        """Return the place for the blocks of a result file."""
        return cls(result.parent / f"{result.name}.blocks")

    @contextmanager
    def held(self, job: Job, count: int, *, resume: bool, force: bool) -> Iterator[None]:
        """Hold the directory while a job's ``count`` blocks are worked on, here alone.

        Whatever ends the work too early becomes a message that says what is kept.

        Raises
        ------
        StoreError
            If blocks of an interrupted run are there and were not asked to be used or removed,
            are those of another job, or another process is at work on them.
        RunError
            If the disk, the workers or the user ended the work; wrong input passes as it is.
        """
        try:
            lock = self._begin(job, resume=resume, force=force)
        except OSError as error:
            raise RunError(f"{self.directory}: {error.strerror or error}") from error
        try:
            with self._keeping(count):
                yield
        finally:
            os.close(lock)

    def _begin(self, job: Job, *, resume: bool, force: bool) -> int:
        """Make the directory for a job, or make sure that the one there belongs to it; lock it."""
        manifest = self.directory / MANIFEST
        if self.directory.exists():
            self._check_ours()
            lock = self._lock()
            try:
                if resume and manifest.is_file():
                    self._check(job)
                    self._clear_leftovers()
                    return lock
                if not force and not resume and any(self.directory.glob("*.npz")):
                    raise StoreError(
                        f"{self.directory}: blocks of an interrupted run are here; go on with "
                        "--resume, or --force to begin anew"
                    )
                shutil.rmtree(self.directory)
            except BaseException:
                os.close(lock)
                raise
            os.close(lock)
        self.directory.mkdir()
        with replacing(manifest) as temporary:
            temporary.write_text(job.text(), encoding="utf-8")
        return self._lock()

    def _lock(self) -> int:
        """Return an open lock on the directory; it goes with this process, however that ends."""
        lock = os.open(self.directory, os.O_RDONLY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            raise StoreError(
                f"{self.directory}: another process is at work on these blocks; wait for it, or "
                "give another --out"
            ) from None
        except OSError:
            pass  # a file system without locks: as before there were any
        return lock

    def _clear_leftovers(self) -> None:
        for path in self.directory.glob(".*.tmp"):
            path.unlink(missing_ok=True)

    def _check_ours(self) -> None:
        """Refuse to touch a file or a directory that no run of ours has made."""
        if not self._ours():
            raise StoreError(
                f"{self.directory}: is in the way of the run's blocks and not made by one; move it "
                "or give another --out"
            )

    def _ours(self) -> bool:
        return self.directory.is_dir() and all(
            path.name == MANIFEST or path.suffix in (".npz", ".tmp")
            for path in self.directory.iterdir()
        )

    def matches(self, job: Job) -> bool:
        """Whether the directory holds blocks of this very job."""
        return self._different(job) == []

    def _check(self, job: Job) -> None:
        different = self._different(job)
        if different:
            keys = [key for key in different if key != ENGINE]
            reasons = [f"{', '.join(keys)} differ"] if keys else []
            if ENGINE in different:
                reasons.append(f"begun with {self._begun_with(job.engine)}")
            ours = "" if keys else "go on with what it was begun with, "
            raise StoreError(
                f"{self.directory}: its blocks belong to another run ({'; '.join(reasons)}); "
                f"{ours}give another --out, or --force to begin anew"
            )

    def _different(self, job: Job) -> list[str]:
        """Return in what the job of the blocks that are there differs."""
        found, wanted = self._manifest(), json.loads(job.text())
        return [key for key in wanted if found.get(key) != wanted[key]]

    def _begun_with(self, ours: Engine) -> str:
        """Say what has computed the blocks that are there."""
        try:
            return differences(Engine(**self._manifest()[ENGINE]), ours)
        except (KeyError, TypeError):
            return "other code"

    def _manifest(self) -> dict[str, Any]:
        """Return the job of the blocks that are there, as it was written; empty if unreadable."""
        try:
            found = json.loads((self.directory / MANIFEST).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}

    def path(self, index: int) -> Path:
        """Return a block's file."""
        return self.directory / f"{index:06d}.npz"

    def write(self, index: int, block: Block) -> None:
        """Write a finished block, whole or not at all."""
        with replacing(self.path(index)) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, **{FIRST: np.array(block.first)}, **block.arrays)

    def read(self, index: int, wanted: Callable[[str], bool] = lambda name: True) -> Block:
        """Read a finished block, or the arrays of it whose names are wanted."""
        with np.load(self.path(index), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files if name != FIRST and wanted(name)}
            return Block(int(file[FIRST]), arrays)

    def missing(self, count: int) -> list[int]:
        """Return the blocks that are not there or not whole."""
        return [index for index in range(count) if not self._whole(index)]

    def _whole(self, index: int) -> bool:
        try:
            with zipfile.ZipFile(self.path(index)) as file:
                return file.testzip() is None
        except (OSError, zipfile.BadZipFile):
            return False

    def kept(self, count: int) -> str:
        """Say how much of an unfinished run is there, and how to go on."""
        done = count - len(self.missing(count))
        return f"{done} of {count} blocks are kept in {self.directory}; go on with --resume"

    @contextmanager
    def _keeping(self, count: int) -> Iterator[None]:
        """Say of whatever ends the work on ``count`` blocks too early what is kept."""
        try:
            yield
        except SchemeError:
            self._remove_if_empty()  # once it is mended, its blocks are those of another scheme
            raise
        except InputError as error:
            self._remove_if_empty()
            if not self.directory.exists():
                raise
            raise type(error)(f"{error}; {self.kept(count)}", error.details) from error
        except OSError as error:
            raise RunError(f"{error.strerror or error}; {self.kept(count)}") from error
        except RunError as error:
            raise RunError(f"{error}; {self.kept(count)}") from error
        except KeyboardInterrupt:
            raise RunError(f"interrupted; {self.kept(count)}") from None

    def _remove_if_empty(self) -> None:
        if not any(self.directory.glob("*.npz")):
            self.remove()

    def remove(self) -> None:
        """Remove the directory if it is one of ours: its result is in place."""
        if self._ours():
            shutil.rmtree(self.directory, ignore_errors=True)
