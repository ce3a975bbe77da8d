"""Input files of a run besides its scenario: a trace, and users' schemes and parts."""

from __future__ import annotations

import hashlib
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from echobeam.faults import RunError
from echobeam.scenario.load import trace_path
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import split


@dataclass(frozen=True, slots=True)
class CodeFiles:
    """Checksums of users' files of schemes and parts at the start of a run.

    Attributes
    ----------
    digests
        Path and SHA-256 of each.
    """

    digests: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, scenario: Scenario, schemes: Sequence[str]) -> CodeFiles:
        """Return the current checksums of the files that schemes consist of."""
        files = _code_files(scenario, schemes)
        return cls(tuple((str(path), digest(path)) for path in files))

    def check(self) -> None:
        """Check that the code has not changed since the run started: blocks would be inconsistent.

        Raises
        ------
        RunError
            Names the file and the machine, since a worker may have another version of it.
        """
        for path, begun in self.digests:
            if not Path(path).is_file() or digest(Path(path)) != begun:
                raise RunError(
                    f"{path}: is missing, or changed since the run started "
                    f"(on {socket.gethostname()})"
                )


def input_digests(scenario: Scenario, schemes: Sequence[str]) -> tuple[str, ...]:
    """Return checksums of the files that a run reads: users' schemes and parts, its trace."""
    inputs = _code_files(scenario, schemes)
    trace = trace_path(scenario)
    if trace is not None and trace.is_file():
        inputs.append(trace)
    return tuple(digest(path) for path in inputs)


def digest(path: Path) -> str:
    """Return a file's SHA-256."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _code_files(scenario: Scenario, schemes: Sequence[str]) -> list[Path]:
    """Return the files named in the schemes' texts and the scenario's parameters."""
    texts = [*schemes, *scenario.scheme_parameters]
    named = [split(text)[0] for text in texts]
    named += [item.partition("=")[2] for text in texts for item in split(text)[1].split(",")]
    for table in scenario.scheme_parameters.values():
        named += [value for value in table.values() if isinstance(value, str)]
    files = [name.rpartition(":")[0] for name in named if ".py:" in name]
    return [path for path in map(Path, dict.fromkeys(files)) if path.is_file()]
