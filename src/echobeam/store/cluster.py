"""Tasks on an existing Dask cluster; no other file imports Dask.

Workers compute and this process stores: blocks return over the network and are written here, so
that no shared file system is needed. A task whose worker dies is repeated by another one. Every
wait for the cluster is bounded, since a wrong address or a lost scheduler may never answer.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

from echobeam.faults import InputError, RunError
from echobeam.store.engine import Engine, differences, engine_here

if TYPE_CHECKING:
    from echobeam.simulation.blocks import Block
    from echobeam.store.work import Piece, Work

Found = TypeVar("Found")

PATIENCE = 15.0
"""Time limit, s, for a scheduler's answer, and for the return of workers that are all lost; a
worker needs about 5 s to restart."""

PER_THREAD = 2
"""Number of tasks submitted per worker thread: one to compute and one to begin next."""

ASK_AGAIN = 5.0
"""Time between requests for the number of workers, s; the rest of `PATIENCE` is left for the
scheduler's answer."""

_GOODBYE = 3.0
"""Time limit for closing the connection to a scheduler, s."""

_TICK = 0.5
"""Time between checks of the scheduler during a wait for results, s."""

_USUAL = "the scheduler's usual port is 8786, the dashboard's 8787"


class ClusterError(InputError):
    """Error of a cluster that cannot be used; the message gives the reason."""


def do_on_cluster(
    work: Work, missing: Sequence[int], address: str, progress: Callable[[int, int], None]
) -> None:
    """Compute tasks on the cluster of a Dask scheduler.

    Parameters
    ----------
    address
        Address of the scheduler, such as ``tcp://127.0.0.1:8786``.

    Raises
    ------
    ClusterError
        If Dask is not installed, no scheduler answers, it has no workers, or the versions of a
        worker differ from those of this process.
    RunError
        If the scheduler or all workers are lost, or a task's workers die repeatedly.
    """
    sizes = work.sizes()
    total = sum(sizes)
    done = total - sum(sizes[task] for task in missing)
    with _connected(address) as client:
        cluster = _Cluster(client, address)
        cluster.check_workers()
        for task, block in cluster.outcomes(work, missing):
            work.write(task, block)
            done += sizes[task]
            progress(done, total)


def compute(piece: Piece, task: int, wanted: Engine) -> tuple[int, Block]:
    """Compute one task, on a worker.

    Raises
    ------
    ClusterError
        If the versions here differ from those of the process that submitted the work.
    """
    different = differences(wanted, engine_here(), "there")
    if different:
        raise _other_numbers(f"the worker on {socket.gethostname()}", different)
    return task, piece(lambda done: None)


def _other_numbers(worker: str, different: str) -> ClusterError:
    return ClusterError(
        f"--dask: {worker} would give other numbers; this run was started with {different}; "
        "install the same on both"
    )


class _Cluster:
    """Tasks submitted to the workers of one scheduler, and their results in order of completion."""

    def __init__(self, client: Any, address: str) -> None:
        self.client = client
        self.address = address
        self.out: set[Any] = set()
        self.finished: SimpleQueue[Any] = SimpleQueue()
        self.threads = self._ask_threads()
        self.asked = self.seen = time.monotonic()
        """Times of the last request for the workers, and of the last answer with any."""

    def check_workers(self) -> None:
        """Check that there are workers, with echobeam and the versions of this process.

        Raises
        ------
        ClusterError
            Names the first worker that fails the check.
        """
        if self.threads == 0:
            raise ClusterError(f"--dask {self.address}: the scheduler has no workers")

        def look() -> tuple[str, ...] | str:  # local, so that it is pickled by value, not by name
            try:
                from echobeam.store.engine import engine_here
            except ImportError as error:
                return str(error)
            return tuple(engine_here())

        try:
            engines = _within(PATIENCE, lambda: self.client.run(look, on_error="ignore"))
        except (TimeoutError, OSError):
            return  # a worker is busy or leaving: each checks itself again before it computes
        for worker, found in engines.items():
            if isinstance(found, str):
                raise _missing(f"the worker at {worker}", found)
            different = differences(engine_here(), Engine(*found), "there")
            if different:
                raise _other_numbers(f"the worker at {worker}", different)

    def outcomes(self, work: Work, missing: Sequence[int]) -> Iterator[tuple[int, Block]]:
        """Yield tasks and their blocks in order of completion.

        Raises
        ------
        RunError
            If the scheduler or all workers are lost, or a task's workers die repeatedly.
        """
        waiting = iter(missing)
        while True:
            room = PER_THREAD * max(self.threads, 1) - len(self.out)
            for task in itertools.islice(waiting, max(room, 0)):
                self._hand_out(work.piece(task), task)
            if not self.out:
                return
            try:
                future = self.finished.get(timeout=_TICK)
            except Empty:
                self._look_after_workers()
                continue
            yield self._result(future)
            self.out.discard(future)
            future.release()
            self._look_after_workers()

    def _hand_out(self, piece: Piece, task: int) -> None:
        """Submit a task; its future enters the queue of finished ones when it is done."""
        try:
            future = self.client.submit(compute, piece, task, engine_here(), pure=False)
        except Exception:
            if self.client.status != "running":
                raise self._lost() from None
            raise
        self.out.add(future)
        future.add_done_callback(self.finished.put)

    def _look_after_workers(self) -> None:
        """Update the number of workers: a batch system may start them one by one.

        Raises
        ------
        RunError
            If there were no workers for `PATIENCE`, or the scheduler does not answer.
        """
        now = time.monotonic()
        if now - self.asked <= ASK_AGAIN:
            return
        self.threads, self.asked = self._ask_threads(), now
        if self.threads > 0:
            self.seen = now
        elif now - self.seen > PATIENCE:
            raise RunError(f"no worker is left at the Dask scheduler {self.address}")

    def _ask_threads(self) -> int:
        """Return the total number of threads of all workers."""
        try:
            threads: dict[str, int] = _within(PATIENCE - ASK_AGAIN, self.client.nthreads)
        except Exception:  # of any type: the scheduler does not answer
            raise self._lost() from None
        return sum(threads.values())

    def _result(self, future: Any) -> tuple[int, Block]:
        """Return the result of a task; the worker that holds it may be lost by then."""
        from distributed.scheduler import KilledWorker

        patience = PATIENCE
        while True:
            try:
                found: tuple[int, Block] = future.result(timeout=patience)
            except TimeoutError:
                self._look_after_workers()
                patience *= 2.0
            except KilledWorker as error:
                raise RunError(f"workers of the cluster died repeatedly: {error}") from error
            except CancelledError:
                raise self._lost() from None
            except (InputError, RunError):
                raise
            except ImportError as error:
                raise _missing("a worker", error) from error
            except Exception as error:
                if self.client.status != "running":
                    raise self._lost() from error
                if "deserialization" in str(error):  # part of Dask's message from the scheduler
                    raise _missing("the scheduler", error.__cause__ or error) from error
                raise
            else:
                return found

    def _lost(self) -> RunError:
        return RunError(f"the Dask scheduler {self.address} is lost: it no longer answers")


def _missing(where: str, error: object) -> ClusterError:
    return ClusterError(
        f"--dask: {where} cannot import the code of the run ({error}); install the same "
        "echobeam there"
    )


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    """Yield a client of a scheduler that has answered; silence Dask's own log.

    Raises
    ------
    ClusterError
        If Dask is not installed, or no scheduler listens at the address.
    """
    try:
        from distributed import Client
        from distributed.comm.core import CommClosedError
    except ImportError:
        raise ClusterError("--dask needs Dask: pip install 'echobeam[cluster]'") from None
    with _silenced("distributed"):  # one message of ours replaces its log
        try:
            kind = _within(PATIENCE, lambda: asyncio.run(_identity(address)))
            if kind != "Scheduler":
                raise ClusterError(f"--dask {address}: a Dask {kind} listens there; {_USUAL}")
            client = _within(PATIENCE, lambda: Client(address, timeout=PATIENCE))
        except ClusterError:
            raise
        except (
            ValueError,
            TypeError,
            ImportError,
        ) as error:  # a malformed address, or TLS without its files
            raise ClusterError(f"--dask {address}: cannot be used: {error}") from error
        except Exception as error:
            if isinstance(error, OSError) and not isinstance(
                error, (TimeoutError, CommClosedError)
            ):
                raise ClusterError(
                    f"--dask {address}: no scheduler answers there ({error})"
                ) from None
            said = str(error) or "it does not answer like one"
            raise ClusterError(
                f"--dask {address}: something listens there, but it is no Dask scheduler "
                f"({said}); {_USUAL}"
            ) from error
        try:
            yield client
        finally:
            with suppress(TimeoutError):  # the scheduler no longer answers
                _within(_GOODBYE, lambda: client.close(timeout=_GOODBYE))


@contextmanager
def _silenced(package: str) -> Iterator[None]:
    """Silence the loggers of a package."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == package]
    levels = {name: logging.getLogger(name).level for name in names}
    try:
        for name in names:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


async def _identity(address: str) -> str:
    """Return the type of Dask server at an address, such as "Scheduler".

    Raises
    ------
    TimeoutError
        If a server listens but does not answer.
    OSError
        If nothing listens there.
    """
    from distributed import Security
    from distributed.core import rpc

    connection = Security().get_connection_args("client")
    async with rpc(address, timeout=PATIENCE / 2, connection_args=connection) as there:
        found = await asyncio.wait_for(there.identity(), 0.9 * PATIENCE)
    return str(found["type"])


def _within(seconds: float, call: Callable[[], Found]) -> Found:
    """Return the result of a call, run in a thread that is abandoned at the time limit.

    Raises
    ------
    TimeoutError
        At the time limit.
    """
    outcome: SimpleQueue[tuple[Found | None, BaseException | None]] = SimpleQueue()

    def run() -> None:
        try:
            outcome.put((call(), None))
        except BaseException as error:
            outcome.put((None, error))

    threading.Thread(target=run, daemon=True).start()
    try:
        found, error = outcome.get(timeout=seconds)
    except Empty:
        raise TimeoutError from None
    if error is not None:
        raise error
    return found  # type: ignore[return-value]
