"""Runs to a file: blocks computed in one or several processes, then joined to a result."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import configure_all
from echobeam.simulation.blocks import Block, cut, run_block
from echobeam.simulation.decisions import SECONDS, Decisions, decision_times
from echobeam.simulation.environment import environment
from echobeam.simulation.run import check_count
from echobeam.simulation.scene import Scene, scene_of
from echobeam.store.block_files import BlockFiles, Job
from echobeam.store.inputs import CodeFiles, input_digests
from echobeam.store.result import open_result, write_result
from echobeam.store.work import Advance, Progress
from echobeam.store.workers import HERE, Workers, do_all
from echobeam.store.writing import check_writable, clear_leftovers
from echobeam.values import Array
from echobeam.version import __version__


@dataclass(frozen=True, slots=True)
class Recording:
    """Run to a result file.

    Attributes
    ----------
    scenario, schemes, trials, seed
        As for `simulate`; schemes by name or file, so that other processes can import them.
    out
        The result file.
    workers
        Processes on this machine, or a cluster.
    resume
        Use the finished blocks of an interrupted run.
    force
        Replace an existing result.
    """

    scenario: Scenario
    schemes: tuple[str, ...]
    trials: int
    seed: int
    out: Path
    workers: Workers = HERE
    resume: bool = False
    force: bool = False


@dataclass(frozen=True, slots=True)
class Done:
    """Work done for a result.

    Attributes
    ----------
    anything
        Whether any work was done; a finished result that is resumed is left unchanged.
    decisions
        Decision times of the schemes at every point that was run; empty if none was.
    """

    anything: bool
    decisions: tuple[Decisions, ...] = ()


@dataclass(frozen=True, slots=True)
class BlockPiece:
    """Work of one block: some trials of a run."""

    scene: Scene
    schemes: tuple[str | object, ...]
    seed: int
    trials: range
    code: CodeFiles

    def __call__(self, advance: Advance) -> Block:
        """Run the block."""
        self.code.check()
        schemes = configure_all(self.scene.scenario, self.schemes)
        return run_block(self.scene, schemes, self.seed, self.trials, advance)


@dataclass(frozen=True, slots=True)
class BlockWork:
    """The blocks of one run as tasks whose outcomes are files."""

    scene: Scene
    schemes: tuple[str | object, ...]
    seed: int
    blocks: tuple[range, ...]
    files: BlockFiles
    code: CodeFiles

    def sizes(self) -> list[int]:
        """Return trial-slots per block, over all schemes."""
        per_trial = self.scene.scenario.n_slots * len(self.schemes)
        return [len(block) * per_trial for block in self.blocks]

    def missing(self) -> list[int]:
        """Return the blocks whose file is missing or incomplete."""
        return self.files.missing(len(self.blocks))

    def piece(self, task: int) -> BlockPiece:
        """Return the work of one block."""
        return BlockPiece(self.scene, self.schemes, self.seed, self.blocks[task], self.code)

    def write(self, task: int, block: Block) -> None:
        """Write a finished block."""
        self.files.write(task, block)


def record(recording: Recording, progress: Progress = lambda done, total: None) -> Done:
    """Run a scenario to a result file.

    Parameters
    ----------
    progress
        Called with the number of trial-slots done and the total.

    Returns
    -------
    Done
        One point, with the decision times of all blocks, resumed ones included.

    Raises
    ------
    StoreError, ScenarioError, SchemeError
        If the input is wrong; then nothing was run.
    RunError
        If the run could not be finished; its finished blocks stay on disk.
    """
    scenario, out = recording.scenario, recording.out
    check_count(recording.trials, recording.seed)
    code = CodeFiles.of(scenario, recording.schemes)
    names = [scheme.name for scheme in configure_all(scenario, recording.schemes)]
    files = BlockFiles.beside(out)
    if recording.resume and not recording.force and _finished(recording, names):
        files.remove()
        return Done(anything=False)
    check_writable(out, force=recording.force)
    scene = scene_of(scenario)  # raises the errors of a trace before any work
    blocks = tuple(cut(scenario, recording.trials))
    work = BlockWork(scene, recording.schemes, recording.seed, blocks, files, code)
    job = _job(recording)
    with files.held(job, len(blocks), resume=recording.resume, force=recording.force):
        clear_leftovers(out)
        do_all(work, recording.workers, progress)
        timed: list[Array] = []
        finished = _noting(timed, files, len(blocks))
        write_result(out, scene, names, recording.seed, recording.trials, finished)
        files.remove()
    return Done(anything=True, decisions=(decision_times(timed, names),))


def _noting(timed: list[Array], files: BlockFiles, count: int) -> Iterator[Block]:
    """Yield blocks, one in memory at a time, and collect their decision times."""
    for index in range(count):
        block = files.read(index)
        timed.append(np.asarray(block.arrays[SECONDS], dtype=float))
        yield block


def _finished(recording: Recording, names: Sequence[str]) -> bool:
    """Return whether the result exists: a run may be killed after it wrote its last file."""
    job = _job(recording)
    if not recording.out.is_file():
        return False
    if job.inputs and not BlockFiles.beside(recording.out).matches(job):
        return False  # a result does not record its trace or scheme files
    with open_result(recording.out) as result:
        return (
            result.attrs["scenario"] == recording.scenario.to_toml()
            and int(result.attrs["seed"]) == recording.seed
            and result.attrs["echobeam_version"] == __version__
            and result.attrs.get("environment") == environment()
            and result["scheme"].values.tolist() == list(names)
            and result.sizes["trial"] == recording.trials
        )


def _job(recording: Recording) -> Job:
    return Job(
        kind="run",
        scenarios=(recording.scenario.to_toml(),),
        schemes=recording.schemes,
        inputs=input_digests(recording.scenario, recording.schemes),
        seed=recording.seed,
        trials=recording.trials,
    )
