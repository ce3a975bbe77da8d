"""Making of a trace: SUMO simulates a plan, and its floating-car data are written meanwhile."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import IO

from echobeam.faults import InputError, RunError
from echobeam.traces.traffic import documents
from echobeam.traces.traffic.plan import Plan, entries
from echobeam.traces.traffic.simulator import Simulator

_LANE_CHANGE = 2.0
"""Time of a change of lane, s, where positions are taken in two dimensions."""

Advance = Callable[[int, int], None]
"""Called with the simulated time and the whole one, ms."""

_SEED_BITS = 31
"""Size of SUMO's seeds."""

_TIME = re.compile(rb'\s*<timestep time="([^"]+)"')
_VEHICLE = re.compile(rb'\s*<vehicle id="([^"]+)" x="([^"]+)" y="([^"]+)".* speed="([^"]+)"')


@dataclass(slots=True)
class Tally:
    """Counts of a trace that is being written.

    Attributes
    ----------
    names
        Ids of the vehicles.
    steps, samples
        Numbers of time steps and of samples.
    most
        Largest number of vehicles at one time.
    low, high
        Smallest and largest x, m.
    south, north
        Smallest and largest y, m.
    slowest, fastest, speeds
        Smallest and largest speed, m/s, and the sum of all.
    """

    names: set[bytes] = field(default_factory=set)
    steps: int = 0
    samples: int = 0
    most: int = 0
    low: float = float("inf")
    high: float = float("-inf")
    south: float = float("inf")
    north: float = float("-inf")
    slowest: float = float("inf")
    fastest: float = 0.0
    speeds: float = 0.0
    _now: int = 0

    def time(self) -> None:
        """Begin a time step."""
        self.steps += 1
        self._now = 0

    def vehicle(self, name: bytes, x: float, y: float, speed: float) -> None:
        """Add a sample."""
        self.names.add(name)
        self.samples += 1
        self._now += 1
        self.most = max(self.most, self._now)
        self.low, self.high = min(self.low, x), max(self.high, x)
        self.south, self.north = min(self.south, y), max(self.north, y)
        self.slowest, self.fastest = min(self.slowest, speed), max(self.fastest, speed)
        self.speeds += speed


def make_trace(plan: Plan, simulator: Simulator, path: Path, packed: bool, show: Advance) -> Tally:
    """Simulate a plan and write its trace, SUMO's floating-car data in metres.

    Times run from 0 to the plan's duration. SUMO's ballistic steps are taken, whose speeds are
    those at the samples' times: a position advances by the mean of both ends' speeds times the step
    (https://sumo.dlr.de/docs/Simulation/Basic_Definition.html). The file has no date or path of
    this machine: the same plan and version of SUMO give the same bytes.

    Parameters
    ----------
    plan
        The traffic.
    simulator
        Installed SUMO.
    path
        File to write.
    packed
        Whether it is gzip-compressed.
    show
        Called with the progress.

    Raises
    ------
    InputError
        If the road was too full for all vehicles to enter.
    RunError
        If a program of SUMO fails, or its output is cut off.
    """
    with TemporaryDirectory(prefix="echobeam-traffic-") as name, _writer(path, packed) as file:
        folder = Path(name)
        (folder / "nodes.xml").write_text(documents.nodes(plan))
        (folder / "edges.xml").write_text(documents.edges(plan))
        (folder / "routes.xml").write_text(documents.routes(plan, entries(plan)))
        simulator.run("netconvert", NETWORK, folder)
        tally, line = Tally(), b""
        with closing(simulator.lines("sumo", simulation(plan), folder)) as printed:
            for line in _with_comment(printed, _comment(plan, simulator)):
                _count(line, tally, plan, show)
                file.write(line + b"\n")
        if line.strip() != b"</fcd-export>":
            raise RunError("SUMO's output is cut off")
    if len(tally.names) < plan.vehicles:
        raise InputError(
            f"vehicles: only {len(tally.names)} of {plan.vehicles} found a gap to enter the road; "
            "give fewer --vehicles, more --lanes or a longer --duration"
        )
    return tally


NETWORK = [
    *("--node-files", "nodes.xml", "--edge-files", "edges.xml", "--output-file", "net.xml"),
    *("--offset.disable-normalization", "true"),  # (0, 0) stays the middle
    *("--no-turnarounds", "true", "--precision", "3", "--xml-validation", "never"),
]
"""Arguments of `netconvert`."""


def simulation(plan: Plan) -> list[str]:
    """Return the arguments of `sumo`."""
    # at an intersection a jump to the next lane would look like a turn
    lanes = ("--lanechange.duration", f"{_LANE_CHANGE:g}") if plan.kind == "intersection" else ()
    return [
        *("--net-file", "net.xml", "--route-files", "routes.xml"),
        *lanes,
        *("--begin", "0", "--end", f"{(plan.duration + plan.step) / 1e3:.3f}"),
        *("--step-length", f"{plan.step / 1e3:.3f}", "--step-method.ballistic", "true"),
        *("--seed", str(Random(plan.seed).getrandbits(_SEED_BITS)), "--no-step-log", "true"),
        # nobody is moved elsewhere, neither from a queue nor after a collision
        *("--time-to-teleport", "-1", "--collision.action", "warn"),
        *("--fcd-output", "stdout", "--fcd-output.attributes", "id,x,y,angle,type,speed,lane"),
        *("--precision", "4", "--xml-validation", "never", "--xml-validation.net", "never"),
    ]


def _count(line: bytes, tally: Tally, plan: Plan, show: Advance) -> None:
    if vehicle := _VEHICLE.match(line):
        tally.vehicle(vehicle[1], *(float(vehicle[place]) for place in (2, 3, 4)))
    elif time := _TIME.match(line):
        tally.time()
        show(round(1e3 * float(time[1])), plan.duration)


def _with_comment(lines: Iterable[bytes], comment: str) -> Iterator[bytes]:
    """Yield the lines with another first comment: SUMO's has the date and all its options."""
    inside, done = False, False
    for line in lines:
        if not done and line.startswith(b"<!--"):
            inside = True
            yield f"<!-- {comment} -->".encode()
        if not inside:
            yield line
        elif b"-->" in line:
            inside, done = False, True


def _comment(plan: Plan, simulator: Simulator) -> str:
    both = plan.both_directions and plan.kind == "road"
    directions = ", both directions" if both else ""
    directions += ", intersection" if plan.kind == "intersection" else ""
    return (
        f"echobeam traffic, SUMO {simulator.release}: {plan.vehicles} vehicles, {plan.length:g} m, "
        f"{plan.speed:g} m/s, {plan.lanes} lanes{directions}, {plan.duration / 1e3:g} s, step "
        f"{plan.step / 1e3:g} s, seed {plan.seed}"
    )


@contextmanager
def _writer(path: Path, packed: bool) -> Iterator[IO[bytes]]:
    """Yield the file to write; no name and no time go into the gzip header."""
    with path.open("wb") as raw:
        if not packed:
            yield raw
            return
        with gzip.GzipFile(filename="", mode="wb", fileobj=raw, mtime=0) as file:
            yield file  # type: ignore[misc]
