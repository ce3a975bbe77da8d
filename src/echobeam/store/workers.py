"""Independent tasks computed in one or several processes, with progress and restart of workers."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from types import ModuleType
from typing import Any

from echobeam.faults import RunError
from echobeam.store.work import Advance, Progress, Work

CRASHES_ALLOWED = 3
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers of a run.

    Attributes
    ----------
    jobs
        Number of processes on this machine; 1 works in this one.
    dask
        Address of a Dask scheduler to use instead; none by default.
    """

    jobs: int = 1
    dask: str | None = None


HERE = Workers()
"""This process alone."""


def do_all(work: Work, workers: Workers, progress: Progress) -> None:
    """Compute every missing task.

    Parameters
    ----------
    workers
        Processes on this machine, or a cluster.
    progress
        Called with the amount done and the total.

    Raises
    ------
    RunError
        If worker processes die repeatedly.
    """
    missing, jobs = work.missing(), workers.jobs
    if workers.dask is not None:
        from echobeam.store.cluster import do_on_cluster

        do_on_cluster(work, missing, workers.dask, progress)
        return
    meter = _Meter(progress, work.sizes(), missing)
    if jobs <= 1 or len(missing) <= 1:
        for task in missing:
            work.write(task, work.piece(task)(meter.advance(task)))
        return
    for _ in range(CRASHES_ALLOWED):
        if _spread(work, jobs, missing, meter):
            return
        missing = work.missing()
    raise RunError(f"a worker process died {CRASHES_ALLOWED} times (out of memory?)")


class _Meter:
    """Progress over tasks, from counters that other processes write without locks."""

    def __init__(self, progress: Progress, sizes: Sequence[int], missing: Sequence[int]) -> None:
        self.progress = progress
        self.total = sum(sizes)
        self.before = self.total - sum(sizes[task] for task in missing)
        self.counts: Any = multiprocessing.get_context("spawn").Array("q", len(sizes), lock=False)

    def advance(self, task: int) -> Advance:
        self.counts[task] = 0

        def count(done: int) -> None:
            self.counts[task] += done
            self.show()

        return count

    def show(self) -> None:
        self.progress(min(self.before + sum(self.counts), self.total), self.total)


def _spread(work: Work, jobs: int, missing: Sequence[int], meter: _Meter) -> bool:
    """Compute tasks in a pool of processes; return False if a process died."""
    for name in _THREADS:  # one thread of linear algebra per process
        os.environ.setdefault(name, "1")
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(
        max_workers=min(jobs, len(missing)),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_remember,
        initargs=(work, meter.counts),
    ) as pool:
        # Not `concurrent.futures.wait`: it acquires the lock of every future, and Ctrl-C within it
        # # would leave some locked, so that the pool waits for ever.
        finished: SimpleQueue[Future[None]] = SimpleQueue()
        with _ignoring_interrupts(), _without_script():
            for task in missing:
                pool.submit(_do_elsewhere, task).add_done_callback(finished.put)
        left = len(missing)
        try:
            while left:
                with suppress(Empty):
                    finished.get(timeout=0.2).result()
                    left -= 1
                meter.show()
        except BrokenProcessPool:
            return False
        except BaseException:
            with _ignoring_interrupts():
                pool.shutdown(wait=False, cancel_futures=True)
                for worker in set(multiprocessing.active_children()) - others:
                    worker.terminate()  # a block may take minutes, and its result is lost anyway
            raise
    return True


@contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Start processes that ignore Ctrl-C, which reaches the whole group; the parent handles it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


_starting = threading.Lock()


@contextmanager
def _without_script() -> Iterator[None]:
    """Start processes that do not run this process's script again.

    `multiprocessing` runs the script in each process for its definitions. None are needed here,
    and a script without a main guard would start again in each process.
    """
    with _starting:  # two threads would restore each other's replacement
        script = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = script


_here: dict[str, Any] = {}


def _remember(work: Work, counts: Any) -> None:
    _here.update(work=work, counts=counts)
    sys.stdout = sys.stderr  # a user's scheme may print; stdout is for the result
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker when its parent process is gone, for example killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do_elsewhere(task: int) -> None:
    counts = _here["counts"]
    counts[task] = 0

    def advance(done: int) -> None:
        counts[task] += done

    work: Work = _here["work"]
    work.write(task, work.piece(task)(advance))
