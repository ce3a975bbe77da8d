"""Runs to a file: blocks in one or several processes, joined to a result at the end."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from typing import Any

from echobeam.faults import InputError, RunError
from echobeam.scenario.dump import dump_scenario
from echobeam.scenario.load import trace_path
from echobeam.scenario.model import Scenario
from echobeam.simulation.blocks import cut, run_block
from echobeam.simulation.motion import plan_motion
from echobeam.simulation.run import check_count, resolve_schemes
from echobeam.store.block_files import BlockFiles, Job, digest
from echobeam.store.result import open_result, write_result
from echobeam.store.writing import check_writable
from echobeam.version import __version__

CRASHES_ALLOWED = 3
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Recording:
    """What to run and where to put it.

    Attributes
    ----------
    scenario, schemes, trials, seed
        As for `simulate`; schemes by name or file, so that other processes find them.
    out
        The result file.
    jobs
        Number of processes.
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
    jobs: int = 1
    resume: bool = False
    force: bool = False


def record(recording: Recording, progress: Progress = lambda done, total: None) -> None:
    """Run a scenario to a result file.

    Parameters
    ----------
    progress
        Called with the trial-slots done so far and in all.

    Raises
    ------
    StoreError, ScenarioError, SchemeError
        If the input is wrong; nothing has been run then.
    RunError
        If the run could not be finished; its blocks are kept.
    """
    scenario = recording.scenario
    check_count(recording.trials, recording.seed)
    names = [scheme.name for scheme in resolve_schemes(scenario, recording.schemes)]
    if recording.resume and _finished(recording, names):
        BlockFiles.beside(recording.out).remove()
        return
    check_writable(recording.out, force=recording.force)
    plan_motion(scenario, recording.seed, range(1))  # a trace that cannot be used says so now
    blocks = cut(scenario, recording.trials)
    files = BlockFiles.beside(recording.out)
    files.begin(_job(recording), resume=recording.resume, force=recording.force)
    missing = files.missing(len(blocks))
    meter = _Meter(progress, [len(b) * scenario.n_slots * len(names) for b in blocks], missing)
    try:
        _compute(recording, files, blocks, missing, meter)
        write_result(
            recording.out,
            scenario,
            names,
            recording.seed,
            recording.trials,
            (files.read(index) for index in range(len(blocks))),
        )
    except InputError:
        files.remove_if_empty()  # a scheme broke the rules: nothing to go on with
        raise
    except OSError as error:
        raise RunError(f"{error.strerror or error}; {_kept(files, blocks)}") from error
    except KeyboardInterrupt:
        raise RunError(f"interrupted; {_kept(files, blocks)}") from None
    files.remove()


def _finished(recording: Recording, names: Sequence[str]) -> bool:
    """Whether the result is there already: a run may be killed after its last file is in place."""
    if not recording.out.is_file():
        return False
    with open_result(recording.out) as result:
        return (
            result.attrs["scenario"] == dump_scenario(recording.scenario)
            and int(result.attrs["seed"]) == recording.seed
            and result.attrs["echobeam_version"] == __version__
            and result["scheme"].values.tolist() == list(names)
            and result.sizes["trial"] == recording.trials
        )


def _job(recording: Recording) -> Job:
    inputs = [Path(name.rpartition(":")[0]) for name in recording.schemes if ".py:" in name]
    trace = trace_path(recording.scenario)
    if trace is not None:
        inputs.append(trace)
    return Job(
        scenario=dump_scenario(recording.scenario),
        schemes=recording.schemes,
        inputs=tuple(digest(path) for path in inputs if path.is_file()),
        seed=recording.seed,
        trials=recording.trials,
        version=__version__,
    )


def _kept(files: BlockFiles, blocks: Sequence[range]) -> str:
    done = len(blocks) - len(files.missing(len(blocks)))
    return f"{done} of {len(blocks)} blocks are kept in {files.directory}; go on with --resume"


class _Meter:
    """Progress over blocks, fed by counters that other processes write without locks."""

    def __init__(self, progress: Progress, sizes: Sequence[int], missing: Sequence[int]) -> None:
        self.progress = progress
        self.total = sum(sizes)
        self.before = self.total - sum(sizes[index] for index in missing)
        self.counts: Any = multiprocessing.get_context("spawn").Array("q", len(sizes), lock=False)

    def show(self) -> None:
        self.progress(min(self.before + sum(self.counts), self.total), self.total)


def _compute(
    recording: Recording,
    files: BlockFiles,
    blocks: Sequence[range],
    missing: Sequence[int],
    meter: _Meter,
) -> None:
    """Compute the missing blocks, here or in other processes."""
    if recording.jobs <= 1 or len(missing) <= 1:
        for index in missing:
            _work(recording, files, index, blocks[index], meter.counts, meter.show)
        return
    for _ in range(CRASHES_ALLOWED):
        if _spread(recording, files, blocks, files.missing(len(blocks)), meter):
            return
    raise RunError(
        f"a worker process died {CRASHES_ALLOWED} times (out of memory?); {_kept(files, blocks)}"
    )


def _spread(
    recording: Recording,
    files: BlockFiles,
    blocks: Sequence[range],
    missing: Sequence[int],
    meter: _Meter,
) -> bool:
    """Compute blocks in a pool of processes; return False if a process died."""
    for name in _THREADS:  # one thread of linear algebra per process
        os.environ.setdefault(name, "1")
    with ProcessPoolExecutor(
        max_workers=min(recording.jobs, len(missing)),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_remember,
        initargs=(meter.counts,),
    ) as pool:
        waiting: set[Future[None]] = {
            pool.submit(_work_elsewhere, recording, files, index, blocks[index])
            for index in missing
        }
        try:
            while waiting:
                done, waiting = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    future.result()
                meter.show()
        except BrokenProcessPool:
            return False
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return True


_counts: Synchronized[int] | None = None


def _remember(counts: Any) -> None:
    global _counts
    _counts = counts


def _work_elsewhere(recording: Recording, files: BlockFiles, index: int, trials: range) -> None:
    _work(recording, files, index, trials, _counts, lambda: None)


def _work(
    recording: Recording,
    files: BlockFiles,
    index: int,
    trials: range,
    counts: Any,
    show: Callable[[], None],
) -> None:
    """Compute one block and write it."""

    def advance(slots: int) -> None:
        counts[index] += slots
        show()

    counts[index] = 0
    schemes = resolve_schemes(recording.scenario, recording.schemes)
    files.write(index, run_block(recording.scenario, schemes, recording.seed, trials, advance))
