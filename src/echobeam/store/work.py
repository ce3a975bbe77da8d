"""Tasks of a run, by number: the interface between a run and its workers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from echobeam.simulation.blocks import Block

Progress = Callable[[int, int], None]
Advance = Callable[[int], None]


Piece = Callable[[Advance], Block]
"""Work of one task, picklable; it is called with a function that reports its progress."""


class Work(Protocol):
    """Tasks by number, picklable; the result of a task is a block stored on disk."""

    def sizes(self) -> Sequence[int]:
        """Return the size of each task, in any unit."""

    def missing(self) -> list[int]:
        """Return the tasks whose result is not stored yet."""

    def piece(self, task: int) -> Piece:
        """Return the work of one task: small, since it may be sent over a network."""

    def write(self, task: int, block: Block) -> None:
        """Store a task's result atomically."""
