"""Request of a trace: the arguments of `echobeam traffic`, with all their faults together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import SupportsIndex, cast, get_args

from echobeam.commands.asking import Faults
from echobeam.faults import InputError
from echobeam.numerals import whole
from echobeam.simulation.run import check_count
from echobeam.store.writing import check_writable
from echobeam.traces.traffic.plan import Kind, Plan
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
    kind: str = "road"

    def plan(self) -> Plan:
        """Return the traffic that is wanted.

        Raises
        ------
        InputError
            With all faults in one message.
        """
        faults = Faults()
        kind = faults.of(_kind, self.kind, self.both_directions)
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
        if None in (kind, lanes, length, speed, time, step, seed):
            faults.check()
        assert kind
        assert lanes
        assert length
        assert speed
        assert time
        assert step
        assert seed is not None
        plan = Plan(
            count or 1, length, speed, lanes, round(1e3 * time), round(1e3 * step), seed[1],
            bool(self.both_directions), kind,
        )  # fmt: skip
        faults.of(_check_length, self.length, plan)
        faults.of(_check_fit, plan)
        faults.check()
        return plan if count else plan.with_vehicles(plan.usual)


def _kind(value: str, both_directions: bool) -> Kind:
    """Return what kind of road is wanted."""
    for kind in get_args(Kind):
        if value == kind:
            if kind == "intersection" and both_directions:
                raise InputError("both_directions: always so at an intersection; leave it out")
            return cast(Kind, kind)
    raise InputError(
        f"kind: {value!r} is not accepted; expected one of {', '.join(get_args(Kind))}"
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
    if plan.entrance < plan.shortest:
        least = plan.shortest * plan.length / plan.entrance
        raise InputError(
            f"length: {given!r} is not accepted; expected at least {least:.4g} m, on which "
            f"a fast vehicle has four samples at {plan.speed:g} m/s and steps of "
            f"{plan.step / 1e3:g} s"
        )


def _check_fit(plan: Plan) -> None:
    if plan.vehicles > plan.fullest:
        road = plan.kind == "road"
        raise InputError(
            f"vehicles: {plan.vehicles} do not fit; expected at most {plan.fullest} "
            f"{'on a road' if road else 'at an intersection of roads'} of "
            f"{plan.length:g} m with {plan.lanes} lanes, {plan.speed:g} m/s, "
            f"{plan.duration / 1e3:g} s; or more --lanes, a longer --duration"
            f"{' or --both-directions' if road else ''}"
        )
