"""Blocks of a run on disk: checkpoints from which an interrupted run continues."""

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
"""Name of the array that holds a block's first trial."""


@dataclass(frozen=True, slots=True)
class Job:
    """Identity of a computation: two runs are equal if and only if their jobs are.

    Attributes
    ----------
    kind
        Command that the blocks belong to.
    scenarios
        Complete TOML texts of the scenarios.
    schemes
        Names, or ``path/to/file.py:name``.
    inputs
        Checksums of the other files that the run reads: traces and users' schemes.
    seed, trials
        As in the result.
    engine
        Version, environment and sources of the code; by default those of this process.
    """

    kind: str
    scenarios: tuple[str, ...]
    schemes: tuple[str, ...]
    inputs: tuple[str, ...]
    seed: int
    trials: int
    engine: Engine = field(default_factory=engine_here)

    def digest(self) -> str:
        """Return the SHA-256 of the job."""
        return hashlib.sha256(self.text().encode()).hexdigest()

    def text(self) -> str:
        """Return the job as JSON, as it is stored beside its blocks."""
        return json.dumps({**asdict(self), ENGINE: self.engine._asdict()}, indent=1)


@dataclass(frozen=True, slots=True)
class BlockFiles:
    """Directory of finished blocks beside the result file that they are joined to."""

    directory: Path

    @classmethod
    def beside(cls, result: Path) -> BlockFiles:
        """Return the directory of blocks of a result file."""
        return cls(result.parent / f"{result.name}.blocks")

    @contextmanager
    def held(self, job: Job, count: int, *, resume: bool, force: bool) -> Iterator[None]:
        """Lock the directory while this process works on a job's ``count`` blocks.

        An error or interruption becomes a message with the number of finished blocks.

        Raises
        ------
        StoreError
            If the directory holds blocks of an interrupted run and neither ``resume`` nor ``force``
            is given, if they belong to another job, or if another process works on them.
        RunError
            If the disk, the workers or the user ended the work; input errors are raised unchanged.
        """
        try:
            lock = self._begin(job, resume=resume, force=force)
        except OSError as error:
            raise RunError(f"{self.directory}: {error.strerror or error}") from error
        try:
            with self._reporting(count):
                yield
        finally:
            os.close(lock)

    def _begin(self, job: Job, *, resume: bool, force: bool) -> int:
        """Make the directory of a job, or check that an existing one belongs to it; lock it."""
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
                        f"{self.directory}: blocks of an interrupted run are here; continue with "
                        "--resume, or start again with --force"
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
        """Return an open lock on the directory; the system releases it when this process ends."""
        lock = os.open(self.directory, os.O_RDONLY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            raise StoreError(
                f"{self.directory}: another process works on these blocks; wait for it, or "
                "give another --out"
            ) from None
        except OSError:
            pass  # the file system has no locks: continue without
        return lock

    def _clear_leftovers(self) -> None:
        for path in self.directory.glob(".*.tmp"):
            path.unlink(missing_ok=True)

    def _check_ours(self) -> None:
        """Refuse a file or directory that was not made by a run."""
        if not self._ours():
            raise StoreError(
                f"{self.directory}: exists and is not a directory of a run's blocks; move it "
                "or give another --out"
            )

    def _ours(self) -> bool:
        return self.directory.is_dir() and all(
            path.name == MANIFEST or path.suffix in (".npz", ".tmp")
            for path in self.directory.iterdir()
        )

    def matches(self, job: Job) -> bool:
        """Return whether the directory holds blocks of this job."""
        return self._different(job) == []

    def _check(self, job: Job) -> None:
        different = self._different(job)
        if different:
            keys = [key for key in different if key != ENGINE]
            reasons = [f"{', '.join(keys)} differ"] if keys else []
            if ENGINE in different:
                reasons.append(f"started with {self._begun_with(job.engine)}")
            ours = "" if keys else "continue with the same versions, "
            raise StoreError(
                f"{self.directory}: its blocks belong to another run ({'; '.join(reasons)}); "
                f"{ours}give another --out, or start again with --force"
            )

    def _different(self, job: Job) -> list[str]:
        """Return the keys in which the job of the existing blocks differs."""
        found, wanted = self._manifest(), json.loads(job.text())
        return [key for key in wanted if found.get(key) != wanted[key]]

    def _begun_with(self, ours: Engine) -> str:
        """Return as text the versions that computed the existing blocks."""
        try:
            return differences(Engine(**self._manifest()[ENGINE]), ours)
        except (KeyError, TypeError):
            return "other code"

    def _manifest(self) -> dict[str, Any]:
        """Return the stored job of the existing blocks; empty if unreadable."""
        try:
            found = json.loads((self.directory / MANIFEST).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}

    def path(self, index: int) -> Path:
        """Return the path of a block's file."""
        return self.directory / f"{index:06d}.npz"

    def write(self, index: int, block: Block) -> None:
        """Write a finished block atomically."""
        with replacing(self.path(index)) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, **{FIRST: np.array(block.first)}, **block.arrays)

    def read(self, index: int, wanted: Callable[[str], bool] = lambda name: True) -> Block:
        """Read a finished block, or only its wanted arrays."""
        with np.load(self.path(index), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files if name != FIRST and wanted(name)}
            return Block(int(file[FIRST]), arrays)

    def missing(self, count: int) -> list[int]:
        """Return the blocks whose file is missing or incomplete."""
        return [index for index in range(count) if not self._whole(index)]

    def _whole(self, index: int) -> bool:
        try:
            with zipfile.ZipFile(self.path(index)) as file:
                return file.testzip() is None
        except (OSError, zipfile.BadZipFile):
            return False

    def kept(self, count: int) -> str:
        """Return as text how many blocks of an unfinished run are stored, and how to continue."""
        done = count - len(self.missing(count))
        return f"{done} of {count} blocks are stored in {self.directory}; continue with --resume"

    @contextmanager
    def _reporting(self, count: int) -> Iterator[None]:
        """Add the number of finished blocks to the message of an error or interruption."""
        try:
            yield
        except SchemeError:
            self._remove_if_empty()  # a corrected scheme is another job
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
        """Remove the directory, whose result is complete, if it was made by a run."""
        if self._ours():
            shutil.rmtree(self.directory, ignore_errors=True)
