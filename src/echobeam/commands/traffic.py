"""Traces from a traffic simulator: what `echobeam traffic` does."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import SupportsIndex

from echobeam.commands.asking import Faults
from echobeam.commands.progress import Bar, interactive_bar
from echobeam.commands.traffic_request import Quantity, Wanted
from echobeam.store.writing import clear_leftovers, replacing
from echobeam.traces.traffic.making import Tally, make_trace
from echobeam.traces.traffic.plan import Plan
from echobeam.traces.traffic.simulator import find_simulator


@dataclass(frozen=True, slots=True)
class Traffic:
    """Trace that was made; it is accepted wherever a path is.

    Attributes
    ----------
    path
        File of the trace.
    vehicles
        Number of vehicles.
    at_once, most_at_once
        Mean and largest number of vehicles on the road at one time.
    mean_speed, slowest, fastest
        Mean, smallest and largest speed over all samples, m/s.
    duration, step
        Time of the trace and time between samples, s.
    stretch, width
        Smallest and largest x, and y, of a vehicle, m; (0, 0) is the middle of the road or roads.
    """

    path: Path
    vehicles: int
    at_once: float
    most_at_once: int
    mean_speed: float
    slowest: float
    fastest: float
    duration: float
    step: float
    stretch: tuple[float, float]
    width: tuple[float, float]

    def __fspath__(self) -> str:
        """Return the path of the trace."""
        return os.fspath(self.path)


def traffic(
    out: str | PathLike[str],
    *,
    kind: str = "road",
    vehicles: SupportsIndex | None = None,
    length: Quantity = 1000.0,
    speed: Quantity = 20.0,
    lanes: SupportsIndex = 2,
    both_directions: bool = False,
    duration: Quantity = 30.0,
    step: Quantity = 0.1,
    seed: SupportsIndex = 0,
    force: bool = False,
    quiet: bool = False,
) -> Traffic:
    """Make roads and their vehicles with SUMO, and write a trace: `echobeam traffic`.

    The middle of the road is x = 0, and y = 0 where another one crosses it. Drivers have desired
    speeds of their own, from 0.6 to 1.4 times the mean, and overtake. The same arguments and
    version of SUMO give the same file, bit for bit.

    Parameters
    ----------
    out
        File of the trace, ``.xml`` or ``.xml.gz``.
    kind
        ``"road"``: straight along the x axis; ``"intersection"``: a second one along the y axis
        crosses it, with traffic lights and a quarter of the vehicles turning to either side.
    vehicles
        Number of vehicles in the trace; by default 15 at once on each km of a lane.
    length
        Length of the road, of either one at an intersection, m.
    speed
        Mean desired speed, m/s.
    lanes
        Number of lanes in each direction.
    both_directions
        Whether half of the vehicles drive the other way; at an intersection they do.
    duration, step
        Time of the trace and time between its samples, s.
    seed
        Seed of all randomness.
    force
        Replace an existing file.
    quiet
        Show no progress.

    Raises
    ------
    InputError
        If an argument is not accepted, SUMO is not installed, or the vehicles do not fit.
    RunError
        If SUMO fails.
    """
    bar = partial(interactive_bar, quiet=quiet)
    wanted = Wanted(
        Path(out),
        vehicles,
        length,
        speed,
        lanes,
        both_directions,
        duration,
        step,
        seed,
        force,
        kind,
    )
    return record_traffic(wanted, bar)


def record_traffic(wanted: Wanted, bar: Bar) -> Traffic:
    """Make a trace; for the command and `traffic` alike."""
    faults = Faults()
    plan, simulator = faults.of(wanted.plan), faults.of(find_simulator)
    faults.check()
    assert plan is not None
    assert simulator is not None
    clear_leftovers(wanted.out)
    packed = wanted.out.name.endswith(".gz")
    try:
        with replacing(wanted.out) as place, bar("traffic: simulation") as progress:
            tally = make_trace(plan, simulator, place, packed, progress)
    except OSError as error:  # a full disk names no file
        name = error.filename or str(wanted.out)
        raise OSError(error.errno, error.strerror, name) from None
    return _made(wanted.out, plan, tally)


def _made(path: Path, plan: Plan, tally: Tally) -> Traffic:
    return Traffic(
        path,
        len(tally.names),
        tally.samples / tally.steps,
        tally.most,
        tally.speeds / tally.samples,
        tally.slowest,
        tally.fastest,
        plan.duration / 1e3,
        plan.step / 1e3,
        (tally.low, tally.high),
        (tally.south, tally.north),
    )
