"""The blocks of a run on disk: what makes an interrupted run go on where it stopped."""

from __future__ import annotations

import hashlib
import json
import shutil
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from echobeam.faults import InputError, RunError
from echobeam.simulation.blocks import Block
from echobeam.store.writing import StoreError, replacing


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
    seed, trials, version
        As in the result.
    """

    kind: str
    scenarios: tuple[str, ...]
    schemes: tuple[str, ...]
    inputs: tuple[str, ...]
    seed: int
    trials: int
    version: str


def digest(path: Path) -> str:
    """Return a file's SHA-256."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True, slots=True)
class BlockFiles:
    """A directory of finished blocks beside the result that they will become."""

    directory: Path

    @classmethod
    def beside(cls, result: Path) -> BlockFiles:
        """Return the place for the blocks of a result file."""
        return cls(result.with_name(result.name + ".blocks"))

    def begin(self, job: Job, *, resume: bool, force: bool) -> None:
        """Make the directory for a job, or make sure that the one there belongs to it.

        Raises
        ------
        StoreError
            If blocks of an interrupted run are there and were not asked to be used or removed,
            or are those of another job.
        """
        manifest = self.directory / "job.json"
        if self.directory.exists():
            self._check_ours(manifest)
            if resume and manifest.is_file():
                self._check(manifest, job)
                return
            if not force and not resume and any(self.directory.glob("*.npz")):
                raise StoreError(
                    f"{self.directory}: blocks of an interrupted run are here; go on with "
                    "--resume, or --force to begin anew"
                )
            shutil.rmtree(self.directory)
        self.directory.mkdir()
        with replacing(manifest) as temporary:
            temporary.write_text(json.dumps(asdict(job), indent=1), encoding="utf-8")

    def _check_ours(self, manifest: Path) -> None:
        """Refuse to touch a file or a directory that no run of ours has made."""
        ours = self.directory.is_dir() and all(
            path == manifest or path.suffix in (".npz", ".tmp") for path in self.directory.iterdir()
        )
        if not ours:
            raise StoreError(
                f"{self.directory}: is in the way of the run's blocks and not made by one; move it "
                "or give another --out"
            )

    def matches(self, job: Job) -> bool:
        """Whether the directory holds blocks of this very job."""
        manifest = self.directory / "job.json"
        if not manifest.is_file():
            return False
        try:
            self._check(manifest, job)
        except StoreError:
            return False
        return True

    def _check(self, manifest: Path, job: Job) -> None:
        try:
            found = json.loads(manifest.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            found = {}
        wanted = json.loads(json.dumps(asdict(job)))
        different = [key for key in wanted if found.get(key) != wanted[key]]
        if different:
            raise StoreError(
                f"{self.directory}: its blocks belong to another run ({', '.join(different)} "
                "differ); give another --out, or --force to begin anew"
            )

    def path(self, index: int) -> Path:
        """Return a block's file."""
        return self.directory / f"{index:06d}.npz"

    def write(self, index: int, block: Block) -> None:
        """Write a finished block, whole or not at all."""
        with replacing(self.path(index)) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, first=np.array(block.first), **block.arrays)

    def read(self, index: int) -> Block:
        """Read a finished block."""
        with np.load(self.path(index), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        return Block(int(arrays.pop("first")), arrays)

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
    def keeping(self, count: int) -> Iterator[None]:
        """Say of whatever ends the work on ``count`` blocks too early what is kept.

        Raises
        ------
        RunError
            If the disk, the workers or the user ended it; wrong input passes as it is.
        """
        try:
            yield
        except InputError:
            self.remove_if_empty()  # a scheme broke the rules: nothing to go on with
            raise
        except OSError as error:
            raise RunError(f"{error.strerror or error}; {self.kept(count)}") from error
        except RunError as error:
            raise RunError(f"{error}; {self.kept(count)}") from error
        except KeyboardInterrupt:
            raise RunError(f"interrupted; {self.kept(count)}") from None

    def remove_if_empty(self) -> None:
        """Remove the directory if no block was finished."""
        if not any(self.directory.glob("*.npz")):
            self.remove()

    def remove(self) -> None:
        """Remove the directory, when its result is in place."""
        shutil.rmtree(self.directory, ignore_errors=True)
