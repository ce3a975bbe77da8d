"""Traces from a traffic simulator: what `echobeam traffic` does."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import SupportsIndex

from echobeam.commands.asking import Faults
from echobeam.commands.progress import Bar, interactive_bar
from echobeam.faults import InputError
from echobeam.numerals import whole
from echobeam.simulation.run import check_count
from echobeam.store.writing import check_writable, clear_leftovers, replacing
from echobeam.traces.traffic.making import Tally, make_trace
from echobeam.traces.traffic.plan import Plan
from echobeam.traces.traffic.simulator import find_simulator
from echobeam.units import parse_quantity

SUFFIXES = (".xml", ".xml.gz")
"""Accepted ends of a trace's name."""

MOST_VEHICLES, MOST_LANES = 100_000, 10
_LONGEST_ROAD, _LONGEST_TIME = 1e5, 86_400.0
_SLOWEST, _FASTEST = 1.0, 50.0
_SHORTEST_STEP, _LONGEST_STEP = 0.001, 1.0
_LEAST_STEPS = 10

Quantity = float | str
"""Number in SI, or a text with a unit."""


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
    stretch
        Smallest and largest position of a vehicle along the road, m; 0 is the road's middle.
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

    def __fspath__(self) -> str:
        """Return the path of the trace."""
        return os.fspath(self.path)


def traffic(
    out: str | PathLike[str],
    *,
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
    """Make a straight road and its vehicles with SUMO, and write a trace: `echobeam traffic`.

    The middle of the road is x = 0. Drivers have desired speeds of their own, from 0.6 to 1.4 times
    the mean, and overtake. The same arguments and version of SUMO give the same file, bit for bit.

    Parameters
    ----------
    out
        File of the trace, ``.xml`` or ``.xml.gz``.
    vehicles
        Number of vehicles in the trace; by default 15 at once on each km of a lane.
    length
        Length of the road, m.
    speed
        Mean desired speed, m/s.
    lanes
        Number of lanes in each direction.
    both_directions
        Whether half of the vehicles drive the other way.
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
        Path(out), vehicles, length, speed, lanes, both_directions, duration, step, seed, force
    )
    return record_traffic(wanted, bar)


@dataclass(frozen=True, slots=True)
class Wanted:
    """Arguments of `traffic`, not validated yet."""

    out: Path
    vehicles: SupportsIndex | None
    length: Quantity
    speed: Quantity
    lanes: SupportsIndex
    both_directions: bool
    duration: Quantity
    step: Quantity
    seed: SupportsIndex
    force: bool

    def plan(self) -> Plan:
        """Return the traffic that is wanted.

        Raises
        ------
        InputError
            With all faults in one message.
        """
        faults = Faults()
        faults.of(_check_name, self.out)
        faults.of(partial(check_writable, force=self.force), self.out)
        lanes = faults.of(_count, "lanes", self.lanes, MOST_LANES)
        length = faults.of(_within, "length", self.length, "length", 0.0, _LONGEST_ROAD, "m")
        speed = faults.of(_within, "speed", self.speed, "speed", _SLOWEST, _FASTEST, "m/s")
        time = faults.of(_within, "duration", self.duration, "time", 0.0, _LONGEST_TIME, "s")
        step = faults.of(
            _within, "step", self.step, "time", _SHORTEST_STEP, _LONGEST_STEP, "s", _milliseconds
        )
        seed = faults.of(check_count, 1, self.seed)
        count = None
        if self.vehicles is not None:
            count = faults.of(_count, "vehicles", self.vehicles, MOST_VEHICLES)
        if time is not None and step is not None:
            faults.of(_check_step, self.step, step, time)
        if None in (lanes, length, speed, time, step, seed):
            faults.check()
        assert lanes
        assert length
        assert speed
        assert time
        assert step
        assert seed is not None
        plan = Plan(
            count or 1, length, speed, lanes, round(1e3 * time), round(1e3 * step), seed[1],
            bool(self.both_directions),
        )  # fmt: skip
        faults.of(_check_length, self.length, plan)
        faults.of(_check_fit, plan)
        faults.check()
        return plan if count else plan.with_vehicles(plan.usual)


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
    )


def _check_name(path: Path) -> None:
    if not path.name.endswith(SUFFIXES) or path.name in SUFFIXES:
        raise InputError(f"{path}: expected a file name that ends in {' or '.join(SUFFIXES)}")


def _count(name: str, value: SupportsIndex, most: int) -> int:
    """Return a whole number from 1."""
    number = whole(value)
    if number is None or not 1 <= number <= most:
        raise InputError(
            f"{name}: {value!r} is not accepted; expected a whole number from 1 to {most}"
        )
    return number


def _within(
    name: str,
    value: Quantity,
    kind: str,
    low: float,
    high: float,
    unit: str,
    check: Callable[[float], str] = lambda number: "",
) -> float:
    """Return a quantity in SI between two limits; a lower limit of 0 is excluded."""
    try:
        number = parse_quantity(value, kind)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    if not (low <= number <= high and number > 0) or check(number):
        least = f"from {low:g}" if low else "above 0, at most"
        limits = f"{least} to {high:g} {unit}" if low else f"{least} {high:g} {unit}"
        raise InputError(f"{name}: {value!r} is not accepted; expected {limits}{check(number)}")
    return number


def _milliseconds(number: float) -> str:
    """Return what is wrong with a step that is no whole number of SUMO's ticks."""
    whole_ticks = abs(1e3 * number - round(1e3 * number)) < 1e-6
    return "" if whole_ticks else ", whole milliseconds"


def _check_step(given: Quantity, step: float, duration: float) -> None:
    if step * _LEAST_STEPS > duration * (1 + 1e-9):
        raise InputError(
            f"step: {given!r} is not accepted; expected at most a tenth of the duration, "
            f"{duration / _LEAST_STEPS:g} s"
        )


def _check_length(given: Quantity, plan: Plan) -> None:
    if plan.length < plan.shortest:
        raise InputError(
            f"length: {given!r} is not accepted; expected at least {plan.shortest:.4g} m, on which "
            f"a fast vehicle has four samples at {plan.speed:g} m/s and steps of "
            f"{plan.step / 1e3:g} s"
        )


def _check_fit(plan: Plan) -> None:
    if plan.vehicles > plan.fullest:
        raise InputError(
            f"vehicles: {plan.vehicles} do not fit; expected at most {plan.fullest} on a road of "
            f"{plan.length:g} m with {plan.lanes} lanes, {plan.speed:g} m/s, "
            f"{plan.duration / 1e3:g} s; or more --lanes, a longer --duration or --both-directions"
        )
