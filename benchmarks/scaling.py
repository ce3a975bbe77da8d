"""How runs and sweeps scale: ``python benchmarks/scaling.py [--scenario NAME] [--scheme NAME]``.

The same job is done by one process, two processes and two Dask workers (a scheduler on 127.0.0.1),
each at two numbers of trials: what grows with the trials is work, the rest is start-up. After that
come the constants of the model in docs/sweeps.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from echobeam.simulation.digest import digest

from echobeam.scenario import load_scenario
from echobeam.scenario.model import Scenario
from echobeam.simulation.blocks import Block, cut, run_block
from echobeam.simulation.run import resolve_schemes
from echobeam.store.block_files import BlockFiles
from echobeam.store.cluster import do_on_cluster
from echobeam.store.recording import Recording, record
from echobeam.store.result import write_result
from echobeam.store.workers import Workers

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SCHEMES = ("temporal", "pilot", "water-filling", "genie", "omni")
TRIAL_SLOTS = 1e9
WORKERS = (1, 10, 100, 1000)


@contextmanager
def two_dask_workers() -> Iterator[str]:
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        yield cluster.scheduler_address


def seconds(action: Callable[[], object]) -> float:
    begun = time.perf_counter()
    action()
    return time.perf_counter() - begun


def run_seconds(scenario: Scenario, scheme: str, trials: int, workers: Workers) -> float:
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "r.nc"
        return seconds(lambda: record(Recording(scenario, (scheme,), trials, 0, out, workers)))


def scaling(scenario: Scenario, scheme: str, few: int, many: int) -> None:
    """Print times, start-up apart from work, and ratios to one process."""
    print(f"{scenario.name}, {scheme}: {few} and {many} trials of {scenario.n_slots} slots")
    print(
        f"{'who works':<16}{'few, s':>10}{'many, s':>10}{'start-up, s':>13}{'work, s':>10}", end=""
    )
    print(f"{'ratio':>8}{'of work':>9}")
    with two_dask_workers() as address:
        kinds = {
            "1 process": Workers(1),
            "2 processes": Workers(2),
            "2 Dask workers": Workers(dask=address),
        }
        for workers in kinds.values():  # what is loaded or compiled only once
            run_seconds(scenario, scheme, few, workers)
        first: tuple[float, float] | None = None
        for name, workers in kinds.items():
            short, long = (run_seconds(scenario, scheme, n, workers) for n in (few, many))
            work = (long - short) / (many - few) * many
            first = first or (long, work)
            print(f"{name:<16}{short:>10.2f}{long:>10.2f}{long - work:>13.2f}{work:>10.2f}", end="")
            print(f"{first[0] / long:>8.2f}{first[1] / work:>9.2f}", flush=True)


@dataclass(frozen=True)
class Constants:
    """Of blocks of one scenario and scheme; seconds per block unless said otherwise."""

    trial_slots: int
    trial_slot: float
    kept: float
    bytes: int
    joined: float
    sent: float


def constants(scenario: Scenario, scheme: str, address: str, *, full: bool) -> Constants:
    """Measure what one block costs, as a run keeps it (``full``) or as a sweep does."""
    trials = cut(scenario, 10_000)[0]
    schemes = resolve_schemes(scenario, [scheme])
    computed: list[Block] = []
    work = median(
        lambda: computed.append(run_block(scenario, schemes, 0, trials)), least=1, budget=10.0
    )
    block = computed[-1]
    if not full:
        work += median(lambda: digest(block.arrays, scenario))
        block = Block(0, digest(block.arrays, scenario))
    with tempfile.TemporaryDirectory() as place:
        files = BlockFiles(Path(place))
        kept = median(lambda: files.write(0, block))
        size = files.path(0).stat().st_size
        joined = median(lambda: files.read(0)) + median(lambda: files.missing(1))
        if full:
            joined += writing(Path(place) / "r.nc", scenario, scheme, block)
    slots = len(trials) * scenario.n_slots
    return Constants(slots, work / slots, kept, size, joined, sent(block, address))


def writing(out: Path, scenario: Scenario, scheme: str, block: Block) -> float:
    """Return what one more block costs when blocks become a result."""
    count = len(block.arrays["truth"])

    def write(blocks: int) -> None:
        parts = (Block(index * count, block.arrays) for index in range(blocks))
        write_result(out, scenario, [scheme], 0, blocks * count, parts)

    return (median(lambda: write(6)) - median(lambda: write(1))) / 5


def median(action: Callable[[], object], least: int = 5, budget: float = 1.0) -> float:
    begun, taken = time.perf_counter(), []
    while len(taken) < least or (len(taken) < 15 and time.perf_counter() - begun < budget):
        taken.append(seconds(action))
    return float(np.median(taken))


@dataclass(frozen=True)
class Idle:
    """Tasks without work: what is left is what the cluster costs."""

    shapes: dict[str, tuple[tuple[int, ...], str]]
    count: int

    def sizes(self) -> list[int]:
        return [1] * self.count

    def missing(self) -> list[int]:
        return list(range(self.count))

    def piece(self, task: int) -> Any:
        return Made(self.shapes)

    def write(self, task: int, block: Block) -> None:
        pass


@dataclass(frozen=True)
class Made:
    """Makes arrays of given shapes, on the worker."""

    shapes: dict[str, tuple[tuple[int, ...], str]]

    def __call__(self, advance: Any) -> Block:
        return Block(0, {name: np.ones(shape, kind) for name, (shape, kind) in self.shapes.items()})


def sent(block: Block, address: str) -> float:
    """Return Dask's cost per block in this process, apart from starting up."""
    shapes = {name: (array.shape, array.dtype.str) for name, array in block.arrays.items()}

    def through(count: int) -> float:
        return seconds(lambda: do_on_cluster(Idle(shapes, count), range(count), address, quiet))

    through(20)
    few, many = through(40), through(240)
    return (many - few) / 200


def quiet(done: int, total: int) -> None:
    pass


def model(found: Constants, workers: int) -> tuple[float, bool]:
    """Return the seconds for 10^9 trial-slots, and whether the process that keeps limits it."""
    blocks = TRIAL_SLOTS / found.trial_slots
    work = found.trial_slots * found.trial_slot
    keep = found.kept + found.sent
    return blocks * (max(work / workers, keep) + found.joined), keep > work / workers


def report(name: str, found: Constants) -> None:
    work = found.trial_slots * found.trial_slot
    print(
        f"{name:<22}{1e6 * found.trial_slot:>10.1f}{found.trial_slots:>8}{work:>9.3f}"
        f"{1e-3 * found.bytes:>10.0f}{1e3 * found.kept:>8.1f}{1e3 * found.sent:>8.1f}"
        f"{1e3 * found.joined:>8.1f}{work / (found.kept + found.sent):>8.0f}   ",
        end="",
    )
    for workers in WORKERS:
        hours, limited = model(found, workers)[0] / 3600, model(found, workers)[1]
        print(f"{hours:>9.3g}{'*' if limited else ' '}", end="")
    print(flush=True)


def main() -> None:
    if not all(name in os.environ for name in THREADS):  # read when NumPy is loaded: begin anew
        one = dict.fromkeys(THREADS, "1")
        os.execve(sys.executable, [sys.executable, *sys.argv], {**one, **os.environ})
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="paper-multi")
    parser.add_argument("--scheme", default="temporal")
    parser.add_argument("--few", type=int, default=512)
    parser.add_argument("--many", type=int, default=2048)
    given = parser.parse_args()
    scenario = load_scenario(given.scenario)
    print(f"load of the machine {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores\n")
    scaling(scenario, given.scheme, given.few, given.many)
    print("\nper block; us = per trial-slot; W* = workers that one keeper can serve; hours for 1e9")
    print(
        f"{'':<22}{'us':>10}{'slots':>8}{'work, s':>9}{'kB':>10}{'keep ms':>8}{'Dask ms':>8}",
        end="",
    )
    print(f"{'join ms':>8}{'W*':>8}   " + "".join(f"{f'W={w}':>9} " for w in WORKERS))
    with two_dask_workers() as address:
        for full in (False, True):
            for scheme in SCHEMES:
                found = constants(scenario, scheme, address, full=full)
                report(f"{'run' if full else 'sweep'}, {scheme}", found)
    print(f"\nload of the machine {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
