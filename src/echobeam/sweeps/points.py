"""Many scenarios run as one piece of work: points, cut into blocks, digested and kept on disk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echobeam.scenario.dump import dump_scenario
from echobeam.scenario.model import Scenario
from echobeam.simulation.blocks import Block, cut, run_block
from echobeam.simulation.digest import Digest, digest, join
from echobeam.simulation.motion import plan_motion
from echobeam.simulation.run import check_count, resolve_schemes
from echobeam.store.block_files import BlockFiles, Job
from echobeam.store.recorded import input_digests
from echobeam.store.workers import HERE, Advance, Progress, Workers, do_all
from echobeam.values import Array
from echobeam.version import __version__

KEPT = "kept:"
"""Prefix of the full arrays that a block's file holds beside its digest."""


@dataclass(frozen=True, slots=True)
class Point:
    """One scenario of a study.

    Attributes
    ----------
    name
        Tells the point from the others.
    scenario, schemes, trials
        As for `echobeam.simulate`; schemes by name or file.
    keep
        Variables of the result kept in full, trial by trial; the digest always is.
    """

    name: str
    scenario: Scenario
    schemes: tuple[str, ...]
    trials: int
    keep: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Study:
    """Points on common random numbers, and the directory where their blocks are kept.

    A trial of one point meets the same draws as that trial of every other.
    """

    points: tuple[Point, ...]
    seed: int
    files: BlockFiles

    def tasks(self) -> list[tuple[int, range]]:
        """Return every block of every point: the point's number and its trials."""
        return [
            (index, block)
            for index, point in enumerate(self.points)
            for block in cut(point.scenario, point.trials)
        ]

    def sizes(self) -> list[int]:
        """Return trial-slots per task, over all schemes."""
        return [
            len(block) * self.points[index].scenario.n_slots * len(self.points[index].schemes)
            for index, block in self.tasks()
        ]

    def missing(self) -> list[int]:
        """Return the tasks without a whole file."""
        return self.files.missing(len(self.tasks()))

    def compute(self, task: int, advance: Advance) -> Block:
        """Run one block; return its digest and what is to be kept."""
        index, trials = self.tasks()[task]
        point = self.points[index]
        schemes = resolve_schemes(point.scenario, point.schemes)
        block = run_block(point.scenario, schemes, self.seed, trials, advance)
        figures = digest(block.arrays, point.scenario)
        kept = {KEPT + name: block.arrays[name] for name in point.keep}
        return Block(block.first, {**figures, **kept})

    def write(self, task: int, block: Block) -> None:
        """Write a finished task's arrays."""
        self.files.write(task, block)

    def digests(self) -> list[Digest]:
        """Return the digest of every point, its blocks joined in order."""
        return [
            join([{k: v for k, v in part.items() if not k.startswith(KEPT)} for part in parts])
            for parts in self._parts()
        ]

    def kept(self, index: int) -> dict[str, Array]:
        """Return the arrays that one point keeps in full, as in a result: scheme, trial, ..."""
        point, parts = self.points[index], self._parts()[index]
        shared = ("truth", "present")
        return {
            name: parts[0][KEPT + name]
            if name == "phase"
            else np.concatenate(
                [part[KEPT + name] for part in parts], axis=0 if name in shared else 1
            )
            for name in point.keep
        }

    def _parts(self) -> list[list[dict[str, Array]]]:
        parts: list[list[dict[str, Array]]] = [[] for _ in self.points]
        for task, (index, _) in enumerate(self.tasks()):
            parts[index].append(dict(self.files.read(task).arrays))  # type: ignore[arg-type]
        return parts


def run_study(
    study: Study,
    *,
    workers: Workers = HERE,
    resume: bool = False,
    force: bool = False,
    progress: Progress = lambda done, total: None,
) -> None:
    """Do what is missing of a study; its blocks stay in its directory.

    Raises
    ------
    StoreError, ScenarioError, SchemeError
        If the input is wrong, or the directory holds blocks of another study.
    RunError
        If the work could not be finished; what is done is kept.
    """
    for point in study.points:
        check_count(point.trials, study.seed)
        resolve_schemes(point.scenario, point.schemes)
        plan_motion(point.scenario, study.seed, range(1))
    study.files.begin(_job(study.points, study.seed), resume=resume, force=force)
    with study.files.keeping(len(study.tasks())):
        do_all(study, workers, progress)


def _job(points: Sequence[Point], seed: int) -> Job:
    return Job(
        kind="study",
        scenarios=tuple(dump_scenario(point.scenario) for point in points),
        schemes=tuple(f"{p.name}: {p.trials} x {', '.join((*p.schemes, *p.keep))}" for p in points),
        inputs=tuple(d for p in points for d in input_digests(p.scenario, p.schemes)),
        seed=seed,
        trials=max(point.trials for point in points),
        version=__version__,
    )


def study_in(directory: Path, points: Sequence[Point], seed: int) -> Study:
    """Return a study whose blocks are kept in a directory of its own."""
    return Study(tuple(points), seed, BlockFiles(directory))
