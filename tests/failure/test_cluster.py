"""Runs on a real Dask scheduler with two worker processes."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace

import pytest

import echobeam as eb
from echobeam.faults import RunError
from echobeam.schemes.base import SchemeRunError
from echobeam.simulation.blocks import Block
from echobeam.store.cluster import ClusterError, compute, do_on_cluster
from echobeam.store.engine import engine_here
from echobeam.store.recording import Recording, record
from echobeam.store.workers import Workers

from .test_interrupted_runs import same

distributed = pytest.importorskip("distributed", reason="pip install 'echobeam[cluster]'")


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        yield cluster


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    """Forty blocks of a short run: time enough to meet it at work."""
    monkeypatch.setattr("echobeam.simulation.blocks.MOST_TRIALS", 10)


@pytest.fixture
def whole(tmp_path_factory):
    """Give the result of the run without a cluster; made once, and not to be changed."""
    path = tmp_path_factory.getbasetemp() / "without_a_cluster.nc"
    if not path.exists():
        record(recording(path))
    return path


def recording(out, trials=400, **changes):
    return Recording(
        scenario=eb.load_scenario("paper-single"),
        schemes=("water-filling", "omni"),
        trials=trials,
        seed=1,
        out=out,
        **changes,
    )


@pytest.mark.slow
def test_a_cluster_gives_the_same_as_this_process(cluster, tmp_path, whole):
    seen = []
    on_cluster = Workers(dask=cluster.scheduler_address)
    record(recording(tmp_path / "there.nc", workers=on_cluster), lambda *now: seen.append(now))
    same(whole, tmp_path / "there.nc")
    assert seen[-1][0] == seen[-1][1]


@pytest.mark.slow
def test_a_worker_killed_in_mid_run_costs_nothing(cluster, tmp_path, whole):
    killed = threading.Event()

    def kill(done, total):
        if not killed.is_set():
            killed.set()
            with distributed.Client(cluster.scheduler_address) as client:
                pids = client.run(os.getpid)
            os.kill(next(iter(pids.values())), signal.SIGKILL)
            time.sleep(0.1)

    on_cluster = Workers(dask=cluster.scheduler_address)
    record(recording(tmp_path / "there.nc", workers=on_cluster), kill)
    assert killed.is_set()
    same(whole, tmp_path / "there.nc")


@pytest.mark.slow
def test_no_scheduler_is_one_message(tmp_path, monkeypatch):
    monkeypatch.setattr("echobeam.store.cluster.PATIENCE", 5.0)
    with pytest.raises(ClusterError, match=r"127\.0\.0\.1:9.*no scheduler answers"):
        record(recording(tmp_path / "r.nc", workers=Workers(dask="tcp://127.0.0.1:9")))
    assert not list(tmp_path.iterdir())


@contextmanager
def listening(answer=b""):
    """Give the port of a server that takes connections, says one thing at most, and then waits."""
    server = socket.create_server(("127.0.0.1", 0))

    def serve():
        taken = []
        with suppress(OSError):
            while True:
                taken.append(server.accept()[0])
                taken[-1].sendall(answer)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield server.getsockname()[1]
    finally:
        server.shutdown(socket.SHUT_RDWR)
        server.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "answer",
    [
        pytest.param(b"", id="silent"),
        pytest.param(b"HTTP/1.1 400 Bad Request\r\n\r\n", id="dashboard"),
        pytest.param(b"SSH-2.0-OpenSSH_9.6\r\n", id="ssh"),
        pytest.param(bytes(64), id="zeros"),
    ],
)
def test_what_listens_and_is_no_scheduler_is_one_message(tmp_path, monkeypatch, answer):
    monkeypatch.setattr("echobeam.store.cluster.PATIENCE", 3.0)
    with (
        listening(answer) as port,
        pytest.raises(ClusterError, match=r"no Dask scheduler.*8786, the dashboard's 8787"),
    ):
        record(recording(tmp_path / "r.nc", workers=Workers(dask=f"tcp://127.0.0.1:{port}")))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("tls://127.0.0.1:8786", "ssl_context"),
        ("ucx://127.0.0.1:8786", "cannot be used"),
        ("http://127.0.0.1:8786", "unknown address scheme 'http'"),
        ("somewhere", "missing port number"),
        ("", "missing port number"),
    ],
)
def test_addresses_that_cannot_be_used_are_one_message(tmp_path, address, words):
    with pytest.raises(ClusterError, match=f"--dask {address}: .*{words}"):
        record(recording(tmp_path / "r.nc", workers=Workers(dask=address)))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_workers_address_is_not_the_schedulers(cluster, tmp_path):
    with distributed.Client(cluster.scheduler_address) as client:
        worker = next(iter(client.nthreads()))
    with pytest.raises(
        ClusterError, match="a Dask Worker listens there; the scheduler's usual port"
    ):
        record(recording(tmp_path / "r.nc", workers=Workers(dask=worker)))


def other_libraries():
    """Make this process one with another version of a library."""
    from echobeam.store import engine

    engine.environment = lambda: "python 3.9; numpy 1.26.0"


def no_echobeam():
    """Make this process one in which nobody has installed echobeam."""
    import sys

    for name in [name for name in sys.modules if name.split(".")[0] == "echobeam"]:
        del sys.modules[name]
    sys.modules["echobeam"] = None


@pytest.mark.slow
def test_a_worker_without_echobeam_is_one_message(tmp_path):
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        with distributed.Client(cluster.scheduler_address) as client:
            client.run(no_echobeam)
        there = Workers(dask=cluster.scheduler_address)
        with pytest.raises(ClusterError, match=r"worker at tcp://.* cannot import .*echobeam"):
            record(recording(tmp_path / "r.nc", trials=2, workers=there))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_scheduler_without_workers_is_one_message(tmp_path):
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as cluster:
        there = Workers(dask=cluster.scheduler_address)
        with pytest.raises(ClusterError, match="the scheduler has no workers"):
            record(recording(tmp_path / "r.nc", trials=2, workers=there))


SERVER = """
import asyncio, sys
from distributed import Scheduler, Worker

async def serve():
    kind, *arguments = sys.argv[1:]
    server = (
        Scheduler(port=0, host="127.0.0.1", dashboard=False)
        if kind == "scheduler"
        else Worker(*arguments, nthreads=1, host="127.0.0.1", dashboard=False)
    )
    async with server:
        print(server.address, flush=True)
        await server.finished()

asyncio.run(serve())
"""


@pytest.fixture
def servers(tmp_path):
    """Give a call that starts a scheduler or a worker as a process of its own."""
    started = []

    def start(*arguments):
        process = subprocess.Popen(
            [sys.executable, "-c", SERVER, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            cwd=tmp_path,
        )
        started.append(process)
        return process, process.stdout.readline().strip()

    yield start
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lost", "signal_", "patience", "words"),
    [
        ("scheduler", signal.SIGKILL, 15.0, "the Dask scheduler tcp://.* is lost"),
        ("scheduler", signal.SIGSTOP, 3.0, "the Dask scheduler tcp://.* is lost"),
        ("worker", signal.SIGKILL, 5.0, "no worker is left at the Dask scheduler tcp://"),
    ],
    ids=["scheduler killed", "scheduler stopped", "last worker killed"],
)
def test_what_is_lost_in_mid_run_is_one_message_and_resumed(
    tmp_path, monkeypatch, servers, whole, lost, signal_, patience, words
):
    monkeypatch.setattr("echobeam.store.cluster.ASK_AGAIN", 0.5)
    scheduler, address = servers("scheduler")
    worker, _ = servers("worker", address)
    out, hit = tmp_path / "r.nc", threading.Event()

    def progress(done, total):
        if not hit.is_set():
            hit.set()
            monkeypatch.setattr("echobeam.store.cluster.PATIENCE", patience)
            {"scheduler": scheduler, "worker": worker}[lost].send_signal(signal_)

    with pytest.raises(RunError, match=rf"{words}.*; \d+ of \d+ blocks are stored .*--resume"):
        record(recording(out, workers=Workers(dask=address)), progress)
    assert list(tmp_path.glob("r.nc.blocks/*.npz"))
    record(recording(out, resume=True))
    same(whole, out)


def test_a_worker_with_other_libraries_refuses():
    ours = engine_here()
    with pytest.raises(
        ClusterError, match=r"give other numbers.*numpy 1\.26\.0 \(there \d.*; install"
    ):
        compute(nap, 0, ours._replace(environment="numpy 1.26.0"))
    with pytest.raises(ClusterError, match=r"version 9\.9 \(there "):
        compute(nap, 0, ours._replace(version="9.9"))
    assert compute(nap, 7, ours)[0] == 7


@pytest.mark.slow
def test_a_cluster_with_other_libraries_is_one_message(tmp_path):
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        with distributed.Client(cluster.scheduler_address) as client:
            client.run(other_libraries)
        there = Workers(dask=cluster.scheduler_address)
        with pytest.raises(ClusterError, match="would give other numbers"):
            record(recording(tmp_path / "r.nc", trials=2, workers=there))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_scheme_that_fails_on_a_worker_is_named_with_its_line(cluster, tmp_path):
    code = tmp_path / "mine.py"
    code.write_text("def mine(prior, view):\n    return 1 / 0\n")
    asked = recording(tmp_path / "r.nc", workers=Workers(dask=cluster.scheduler_address))
    with pytest.raises(SchemeRunError, match=r"mine\.py, line 2, in mine: Zero.*slot 2") as caught:
        record(replace(asked, schemes=(f"{code}:mine",)))
    assert "return 1 / 0" in caught.value.details
    assert not list(tmp_path.glob("*.blocks"))


@pytest.mark.slow
def test_a_worker_of_other_libraries_that_comes_late_costs_no_block(cluster, tmp_path, monkeypatch):
    """It is refused before it computes; what is done is kept."""
    out = tmp_path / "r.nc"

    def late(self):
        monkeypatch.setattr("echobeam.store.cluster.compute", refuse_some)

    monkeypatch.setattr("echobeam.store.cluster._Cluster.check_workers", late)
    with pytest.raises(
        ClusterError, match=r"numpy 1\.26.*; \d+ of \d+ blocks are stored .*--resume"
    ):
        record(recording(out, workers=Workers(dask=cluster.scheduler_address)))
    monkeypatch.undo()
    record(recording(out, resume=True))


def refuse_some(piece, task, wanted):
    """Be a worker that refuses the later tasks."""
    other = wanted._replace(environment="numpy 1.26.0") if task > 8 else wanted
    return compute(piece, task, other)


@dataclass
class Naps:
    """Tasks that sleep; counts how many are handed out and not yet back."""

    count: int
    out: int = 0
    most: int = 0
    written: list = field(default_factory=list)

    def sizes(self):
        return [1] * self.count

    def missing(self):
        return list(range(self.count))

    def piece(self, task):
        self.out += 1
        self.most = max(self.most, self.out)
        return nap

    def write(self, task, block):
        self.out -= 1
        self.written.append(task)


def nap(advance):
    time.sleep(0.05)
    return Block(0, {})


@pytest.mark.slow
def test_workers_that_come_later_get_work_too(monkeypatch):
    """Those of a batch system do, one by one."""
    monkeypatch.setattr("echobeam.store.cluster.ASK_AGAIN", 0.0)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0"
    ) as cluster:
        naps = Naps(40)

        def progress(done, total):
            if done == 5:
                assert naps.most <= 2
                cluster.scale(3)
                cluster.wait_for_workers(3, timeout=600)

        do_on_cluster(naps, naps.missing(), cluster.scheduler_address, progress)
        assert sorted(naps.written) == naps.missing()
        assert naps.most == 6
