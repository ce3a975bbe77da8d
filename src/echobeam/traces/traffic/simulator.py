"""Programs of SUMO as processes: found in its package, bounded in time, with their messages."""

from __future__ import annotations

import os
import select
import subprocess
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from echobeam.faults import InputError, RunError

PATIENCE = 60.0
"""Longest silence of a program, s; it prints every step, and a step takes milliseconds."""

_LAST_LINES = 5
_CHUNK = 1 << 16

_MISSING = 'SUMO is not installed, which makes the traffic: pip install "echobeam[sumo]"'


@dataclass(frozen=True, slots=True)
class Simulator:
    """Installed SUMO.

    Attributes
    ----------
    home
        Folder of its package, with the programs in ``bin``.
    release
        Its version.
    """

    home: Path
    release: str

    def lines(
        self, program: str, arguments: list[str], folder: Path
    ) -> Generator[bytes, None, None]:
        """Run a program in a folder; yield the lines that it prints, without their ends.

        Raises
        ------
        RunError
            If it cannot be started, fails, or is silent for longer than `PATIENCE`; the message
            has its last lines. The process has ended then, and also if the iteration is given up.
        """
        with TemporaryFile() as errors:
            try:
                process = subprocess.Popen(
                    [self.home / "bin" / program, *arguments],
                    cwd=folder,
                    env=os.environ | {"SUMO_HOME": str(self.home)},
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=errors,
                )
            except OSError as error:
                raise RunError(f"SUMO's {program} cannot be started: {error.strerror}") from None
            assert process.stdout is not None
            try:
                yield from _lines(process.stdout, program, errors)
                status = process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                raise _silent(program, errors) from None
            finally:
                process.kill()
                process.wait()
                process.stdout.close()
            if status != 0:
                raise RunError(f"SUMO's {program} failed (status {status}){_said(errors)}")

    def run(self, program: str, arguments: list[str], folder: Path) -> None:
        """Run a program whose lines are of no interest, as `lines` does."""
        for _ in self.lines(program, arguments, folder):
            pass


def find_simulator() -> Simulator:
    """Return the SUMO of this Python.

    Raises
    ------
    InputError
        If its package is not installed; the message names the extra.
    """
    found = find_spec("sumo")
    try:
        release = version("eclipse-sumo")
    except PackageNotFoundError:
        raise InputError(_MISSING) from None
    if found is None or found.origin is None:
        raise InputError(_MISSING)
    return Simulator(Path(found.origin).parent, release)


def _lines(output: IO[bytes], program: str, errors: IO[bytes]) -> Iterator[bytes]:
    rest = b""
    while True:
        ready, _, _ = select.select([output], [], [], PATIENCE)
        if not ready:
            raise _silent(program, errors)
        chunk = os.read(output.fileno(), _CHUNK)
        if not chunk:
            break
        *whole, rest = (rest + chunk).split(b"\n")
        yield from whole
    if rest:
        yield rest


def _silent(program: str, errors: IO[bytes]) -> RunError:
    return RunError(f"SUMO's {program} was ended: it did nothing for {PATIENCE:g} s{_said(errors)}")


def _said(errors: IO[bytes]) -> str:
    """Return the last lines of a program's messages, as the end of a sentence."""
    errors.seek(0)
    said = errors.read().decode("utf-8", "replace").splitlines()
    last = [line for line in said if line.strip()][-_LAST_LINES:]
    return "; its last lines:\n" + "\n".join(f"  {line}" for line in last) if last else ""
