"""Work of a run as tasks by number: the contract between a run and its workers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from echobeam.simulation.blocks import Block

Progress = Callable[[int, int], None]
Advance = Callable[[int], None]


Piece = Callable[[Advance], Block]
"""One task's work alone, picklable; it is given a call for what was done since the last call."""


class Work(Protocol):
    """Tasks by number, picklable; a task's outcome is a block that is kept on disk."""

    def sizes(self) -> Sequence[int]:
        """Return how much there is to do in each task, in any unit."""

    def missing(self) -> list[int]:
        """Return the tasks whose outcome is not there yet."""

    def piece(self, task: int) -> Piece:
        """Return what is to be done for one task: small, since it may go over a network."""

    def write(self, task: int, block: Block) -> None:
        """Keep a task's outcome, whole or not at all."""
