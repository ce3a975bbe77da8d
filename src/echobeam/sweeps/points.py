"""Studies: many scenarios run as one job in blocks, with their statistics on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import configure_all
from echobeam.simulation.blocks import Block, cut, run_block, trial_axis
from echobeam.simulation.decisions import SECONDS, Decisions, decision_times
from echobeam.simulation.run import check_count
from echobeam.simulation.scene import Scene, scene_of
from echobeam.simulation.statistics import Statistics, join, statistics_of
from echobeam.store.block_files import BlockFiles, Job
from echobeam.store.inputs import CodeFiles, input_digests
from echobeam.store.work import Advance, Progress
from echobeam.store.workers import HERE, Workers, do_all
from echobeam.values import Array

KEPT = "kept:"
"""Prefix of the names of full arrays in a block's file, beside its statistics."""


@dataclass(frozen=True, slots=True)
class Point:
    """Point of a study: one scenario.

    Attributes
    ----------
    name
        Unique name of the point.
    scenario, schemes, trials
        As for `echobeam.simulate`; schemes by name or file.
    keep
        Variables of the result stored in full, trial by trial, besides the statistics.
    """

    name: str
    scenario: Scenario
    schemes: tuple[str, ...]
    trials: int
    keep: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PointPiece:
    """Work of one block: statistics over some trials of a point, and its full variables."""

    point: Point
    scene: Scene
    seed: int
    trials: range
    code: CodeFiles

    def __call__(self, advance: Advance) -> Block:
        """Run the block."""
        self.code.check()
        point = self.point
        schemes = configure_all(point.scenario, point.schemes)
        block = run_block(self.scene, schemes, self.seed, self.trials, advance)
        names = [scheme.name for scheme in schemes]
        figures = statistics_of(block.arrays, point.scenario, names)
        kept = {KEPT + name: block.arrays[name] for name in point.keep if name in block.arrays}
        return Block(block.first, {**figures, **kept, SECONDS: block.arrays[SECONDS]})


@dataclass(frozen=True, slots=True)
class Study:
    """Points with common random numbers, and the directory of their blocks.

    A trial has the same random draws at every point.

    Attributes
    ----------
    tasks
        Blocks of all points: the point's number and its trials.
    scenes, code
        Scene and users' code of each point.
    """

    points: tuple[Point, ...]
    seed: int
    files: BlockFiles
    tasks: tuple[tuple[int, range], ...] = field(init=False, repr=False, compare=False)
    scenes: tuple[Scene, ...] = field(init=False, repr=False, compare=False)
    code: tuple[CodeFiles, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Divide the points into blocks; read their traces and the checksums of users' code."""
        tasks = tuple(
            (index, block)
            for index, point in enumerate(self.points)
            for block in cut(point.scenario, point.trials)
        )
        object.__setattr__(self, "tasks", tasks)
        scenes = tuple(scene_of(point.scenario) for point in self.points)
        object.__setattr__(self, "scenes", scenes)
        code = tuple(CodeFiles.of(point.scenario, point.schemes) for point in self.points)
        object.__setattr__(self, "code", code)

    def job(self) -> Job:
        """Return the identity of this study."""
        points = self.points
        return Job(
            kind="study",
            scenarios=tuple(point.scenario.to_toml() for point in points),
            schemes=tuple(
                f"{p.name}: {p.trials} x {', '.join((*p.schemes, *p.keep))}" for p in points
            ),
            inputs=tuple(d for p in points for d in input_digests(p.scenario, p.schemes)),
            seed=self.seed,
            trials=max(point.trials for point in points),
        )

    def sizes(self) -> list[int]:
        """Return trial-slots per task, over all schemes."""
        return [
            len(block) * self.points[index].scenario.n_slots * len(self.points[index].schemes)
            for index, block in self.tasks
        ]

    def missing(self) -> list[int]:
        """Return the tasks whose file is missing or incomplete."""
        return self.files.missing(len(self.tasks))

    def piece(self, task: int) -> PointPiece:
        """Return the work of one task."""
        index, trials = self.tasks[task]
        return PointPiece(
            self.points[index], self.scenes[index], self.seed, trials, self.code[index]
        )

    def write(self, task: int, block: Block) -> None:
        """Write a finished task's arrays."""
        self.files.write(task, block)

    def statistics_of(self, index: int) -> Statistics:
        """Return the statistics of one point, its blocks joined in order."""
        parts = [block.arrays for block in self._blocks(index, _is_statistic)]
        return join(parts)  # type: ignore[arg-type]

    def decisions(self, index: int, names: Sequence[str]) -> Decisions:
        """Return the decision times of the schemes at one point."""
        timed = [block.arrays[SECONDS] for block in self._blocks(index, SECONDS.__eq__)]
        return decision_times(timed, names)  # type: ignore[arg-type]

    def kept(self, index: int) -> dict[str, Array]:
        """Return the full arrays of one point, as in a result: scheme, trial, ..."""
        parts = [block.arrays for block in self.kept_blocks(index)]
        return {
            name: parts[0][name]  # type: ignore[misc]
            if (axis := trial_axis(name)) is None
            else np.concatenate([part[name] for part in parts], axis=axis)
            for name in self.points[index].keep
        }

    def kept_blocks(self, index: int) -> Iterator[Block]:
        """Yield the full arrays of one point block by block, one block in memory at a time."""
        for block in self._blocks(index, lambda name: KEPT in name):
            arrays = {name.removeprefix(KEPT): array for name, array in block.arrays.items()}
            yield Block(block.first, arrays)

    def _blocks(self, index: int, wanted: Callable[[str], bool]) -> Iterator[Block]:
        """Read the blocks of one point in order, only the wanted arrays of each."""
        for task, (point, _) in enumerate(self.tasks):
            if point == index:
                yield self.files.read(task, wanted)


def _is_statistic(name: str) -> bool:
    return KEPT not in name and name != SECONDS


def run_study(
    study: Study,
    *,
    workers: Workers = HERE,
    resume: bool = False,
    force: bool = False,
    progress: Progress = lambda done, total: None,
) -> None:
    """Compute the missing blocks of a study; they stay in its directory.

    Raises
    ------
    StoreError, ScenarioError, SchemeError
        If the input is wrong, or the directory holds blocks of another study.
    RunError
        If the work could not be finished; finished blocks stay on disk.
    """
    with holding(study, resume=resume, force=force):
        do_all(study, workers, progress)


@contextmanager
def holding(study: Study, *, resume: bool, force: bool) -> Iterator[None]:
    """Check a study and lock its directory while its blocks and results are written.

    Raises
    ------
    StoreError, ScenarioError, SchemeError, RunError
        As in `run_study`.
    """
    for point in study.points:
        check_count(point.trials, study.seed)
        configure_all(point.scenario, point.schemes)
    count = len(study.tasks)
    with study.files.held(study.job(), count, resume=resume, force=force):
        yield


def study_in(directory: Path, points: Sequence[Point], seed: int) -> Study:
    """Return a study with its own directory of blocks."""
    return Study(tuple(points), seed, BlockFiles(directory))
