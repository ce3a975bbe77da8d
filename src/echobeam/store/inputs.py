"""Files that a run reads besides its scenario: a trace, and users' schemes and parts."""

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
    """Users' files of schemes and parts as they were when a run began.

    Attributes
    ----------
    digests
        Path and SHA-256 of each.
    """

    digests: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, scenario: Scenario, schemes: Sequence[str]) -> CodeFiles:
        """Return the files that schemes are made of, as they are now."""
        files = _code_files(scenario, schemes)
        return cls(tuple((str(path), digest(path)) for path in files))

    def check(self) -> None:
        """Refuse to go on with other code than the run began with: blocks would not fit together.

        Raises
        ------
        RunError
            Names the file, and the machine: a worker may have another one.
        """
        for path, begun in self.digests:
            if not Path(path).is_file() or digest(Path(path)) != begun:
                raise RunError(
                    f"{path}: is gone, or not the file that the run began with "
                    f"(on {socket.gethostname()})"
                )


def input_digests(scenario: Scenario, schemes: Sequence[str]) -> tuple[str, ...]:
    """Return digests of the files that a run reads: users' schemes and parts, its trace."""
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
    """Return the files that the texts of schemes and the scenario's parameters name."""
    texts = [*schemes, *scenario.scheme_parameters]
    named = [split(text)[0] for text in texts]
    named += [item.partition("=")[2] for text in texts for item in split(text)[1].split(",")]
    for table in scenario.scheme_parameters.values():
        named += [value for value in table.values() if isinstance(value, str)]
    files = [name.rpartition(":")[0] for name in named if ".py:" in name]
    return [path for path in map(Path, dict.fromkeys(files)) if path.is_file()]
