"""Runs on a real Dask scheduler with two worker processes."""

import os
import signal
import threading
import time
from dataclasses import dataclass, field

import pytest

import echobeam as eb
from echobeam.simulation.blocks import Block
from echobeam.store.cluster import ClusterError, compute, do_on_cluster
from echobeam.store.engine import engine_here
from echobeam.store.recorded import Recording, record
from echobeam.store.workers import Workers

from .test_interrupted_runs import same

distributed = pytest.importorskip("distributed", reason="pip install 'echobeam[cluster]'")


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        yield cluster


def recording(out, trials=400, **changes):
    return Recording(
        scenario=eb.load_scenario("paper-long"),
        schemes=("water-filling", "omni"),
        trials=trials,
        seed=1,
        out=out,
        **changes,
    )


@pytest.mark.slow
def test_a_cluster_gives_the_same_as_this_process(cluster, tmp_path):
    record(recording(tmp_path / "here.nc"))
    seen = []
    on_cluster = Workers(dask=cluster.scheduler_address)
    record(recording(tmp_path / "there.nc", workers=on_cluster), lambda *now: seen.append(now))
    same(tmp_path / "here.nc", tmp_path / "there.nc")
    assert seen[-1][0] == seen[-1][1]


@pytest.mark.slow
def test_a_worker_killed_in_mid_run_costs_nothing(cluster, tmp_path):
    record(recording(tmp_path / "here.nc", trials=1500))
    killed = threading.Event()

    def kill(done, total):
        if not killed.is_set():
            killed.set()
            with distributed.Client(cluster.scheduler_address) as client:
                pids = client.run(os.getpid)
            os.kill(next(iter(pids.values())), signal.SIGKILL)
            time.sleep(0.1)

    on_cluster = Workers(dask=cluster.scheduler_address)
    record(recording(tmp_path / "there.nc", trials=1500, workers=on_cluster), kill)
    assert killed.is_set()
    same(tmp_path / "here.nc", tmp_path / "there.nc")


@pytest.mark.slow
def test_no_scheduler_is_one_message(tmp_path, monkeypatch):
    monkeypatch.setattr("echobeam.store.cluster.PATIENCE", "1s")
    with pytest.raises(ClusterError, match=r"127\.0\.0\.1:9.*no scheduler answers"):
        record(recording(tmp_path / "r.nc", workers=Workers(dask="tcp://127.0.0.1:9")))
    assert not list(tmp_path.iterdir())


def other_libraries():
    """Make this process one with another version of a library."""
    from echobeam.store import engine

    engine.environment = lambda: "python 3.9; numpy 1.26.0"


def test_a_worker_with_other_libraries_refuses():
    ours = engine_here()
    with pytest.raises(ClusterError, match=r"give other numbers.*numpy 1\.26\.0; there.*; install"):
        compute(nap, 0, ours._replace(environment="numpy 1.26.0"))
    with pytest.raises(ClusterError, match=r"version 9\.9; there it is"):
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

        do_on_cluster(naps, naps.missing(), cluster.scheduler_address, progress)
        assert sorted(naps.written) == naps.missing()
        assert naps.most == 6
