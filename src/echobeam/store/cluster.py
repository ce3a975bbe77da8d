"""The same tasks on an existing Dask cluster; the only file that knows Dask.

Workers compute, this process keeps: blocks come back over the network and are written here, so
that no shared file system is needed. A task whose worker dies is done again by another one.
"""

from __future__ import annotations

import itertools
import socket
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from echobeam.faults import InputError, RunError
from echobeam.store.engine import Engine, differences, engine_here

if TYPE_CHECKING:
    from echobeam.simulation.blocks import Block
    from echobeam.store.work import Piece, Work

PATIENCE = "15s"
PER_THREAD = 2
"""Tasks handed out per worker thread: one to work on and one to begin next."""

ASK_AGAIN = 5.0
"""Seconds after which the scheduler is asked again how many workers it has."""


class ClusterError(InputError):
    """A cluster that cannot be used; the message says why."""


def do_on_cluster(
    work: Work, missing: Sequence[int], address: str, progress: Callable[[int, int], None]
) -> None:
    """Do tasks on the cluster of a Dask scheduler.

    Parameters
    ----------
    address
        Of the scheduler, such as ``tcp://127.0.0.1:8786``.

    Raises
    ------
    ClusterError
        If Dask is not installed, no scheduler answers, it has no workers, or one of them would
        compute other numbers than this process.
    RunError
        If a task's workers die again and again.
    """
    try:
        from distributed import Client, as_completed
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise ClusterError("--dask needs Dask: pip install 'echobeam[cluster]'") from None
    sizes = work.sizes()
    total = sum(sizes)
    done = total - sum(sizes[task] for task in missing)
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise ClusterError(f"--dask {address}: no scheduler answers there ({error})") from None
    with client:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise ClusterError(f"--dask {address}: the scheduler has no workers")
        waiting, ours = iter(missing), engine_here()

        def hand_out(count: int) -> list[Any]:
            return [
                client.submit(compute, work.piece(task), task, ours, pure=False)
                for task in itertools.islice(waiting, count)
            ]

        running = as_completed(hand_out(PER_THREAD * threads))
        asked = time.monotonic()
        for future in running:
            if time.monotonic() - asked > ASK_AGAIN:  # workers of a batch system come one by one
                threads, asked = sum(client.nthreads().values()), time.monotonic()
            try:
                task, block = future.result()
            except KilledWorker as error:
                raise RunError(f"workers of the cluster died again and again: {error}") from error
            work.write(task, block)
            future.release()
            room = PER_THREAD * max(threads, 1) - running.count()
            running.update(hand_out(max(room, 0)))
            done += sizes[task]
            progress(done, total)


def compute(piece: Piece, task: int, wanted: Engine) -> tuple[int, Block]:
    """Do one task, on a worker.

    Raises
    ------
    ClusterError
        If other numbers would come out here than where the work was handed out.
    """
    different = differences(wanted, engine_here(), "there")
    if different:
        raise ClusterError(
            f"--dask: the worker on {socket.gethostname()} would give other numbers; this run was "
            f"begun with {different}; install the same on both"
        )
    return task, piece(lambda done: None)
