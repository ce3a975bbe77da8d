"""Survey of a trace, the first pass over it: properties and consistency of the whole.

It reads the whole file, so that a damaged one is refused even if the damage is outside the slots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from echobeam.traces.breaks import Breaks, Visit, unbroken
from echobeam.traces.check import check_trace
from echobeam.traces.clock import EvenStep
from echobeam.traces.outline import Outline
from echobeam.traces.road import Road, RoadError, fit_road
from echobeam.traces.sample import Sample, fault
from echobeam.traces.speeds import Verdict
from echobeam.traces.totals import Totals, Vehicle

_INEXACT = (Verdict.INEXACT, Verdict.GROSS)


@dataclass(frozen=True, slots=True)
class Survey:
    """Properties of a whole trace.

    Attributes
    ----------
    first, last
        Times of its first and last sample, s.
    road
        Given or fitted road.
    extent
        Smallest and largest distance along the road of the vehicles on it, m; None if the samples
        must be read again, since the road was fitted and not all of them are on it.
    width
        The same across the road.
    vehicles
        Number of vehicles.
    dropped
        Number of vehicles without two linked samples.
    broken
        Whether the trace has jumps, or samples without a position.
    step
        Even step behind rounded times; None if the times are not rounded.
    period
        Typical time between samples, s.
    position_digits
        Number of decimals of the positions.
    speed_share, speeds_at_samples
        Timing of speeds within the step before their sample, and whether it is the sample's time.
    marked, inexact
        Vehicles whose speeds are marks, and those whose speeds differ from the positions; both are
        not used for motion.
    notes
        Sentences on data that are omitted or reinterpreted.
    """

    first: float
    last: float
    road: Road
    extent: tuple[float, float] | None
    width: tuple[float, float] | None
    vehicles: int
    dropped: int
    broken: bool
    step: EvenStep | None
    period: float
    position_digits: int
    speed_share: float
    speeds_at_samples: bool
    marked: frozenset[str]
    inexact: frozenset[str]
    notes: tuple[str, ...]


def survey_trace(path: Path, samples: Iterable[Sample], road: Road | None = None) -> Survey:
    """Return the properties of a whole trace.

    Parameters
    ----------
    path
        Name of the file, for messages.
    samples
        All samples of the trace.
    road
        Road of the vehicles; fitted if not given.

    Raises
    ------
    TraceError
        If there is no sample, no vehicle has two, none is on the given road, or no road can be
        fitted; if speeds, times and positions are inconsistent.
    """
    totals = Totals()
    found: dict[str, Breaks] = {}
    for sample, visit in unbroken(samples, found):
        totals.take(sample, visit, road)
    vehicles = totals.vehicles
    for vehicle in vehicles.values():
        vehicle.speeds.end()
    step = totals.clock.even_step(vehicle.ticks for vehicle in vehicles.values())
    totals.timing.rounding = 0.0 if step is None else step.digit
    dropped = sum(vehicle.speeds.steps == 0 for vehicle in vehicles.values())
    _check_samples(path, found, vehicles)
    notes = check_trace(path, totals, found)
    _check_motion(path, vehicles, dropped, totals.outline, road)
    fitted = _fitted(path, vehicles) if road is None else road
    verdicts = {name: vehicle.speeds.verdict() for name, vehicle in vehicles.items()}
    return Survey(
        totals.first,
        totals.last,
        fitted,
        _extent(totals.outline, fitted, Road.along),
        _extent(totals.outline, fitted, Road.across),
        len(vehicles),
        dropped,
        any(each.jumps or each.unplaced for each in found.values()),
        step,
        totals.clock.period,
        totals.position_digits,
        totals.timing.share,
        totals.timing.at_samples,
        frozenset(name for name, verdict in verdicts.items() if verdict is Verdict.MARK),
        frozenset(name for name, verdict in verdicts.items() if verdict in _INEXACT),
        notes,
    )


def extent_on(road: Road, samples: Iterable[Sample]) -> tuple[float, float]:
    """Return the smallest and largest distance along a road of the samples on it, m."""
    low, high = math.inf, -math.inf
    last: dict[str, Visit] = {}
    for visit in unbroken(samples, {}):
        before = last.get(visit.sample.name)
        last[visit.sample.name] = visit
        if before is None or before.number != visit.number:
            continue  # the single sample of a visit may be at any position
        for each in (before.sample, visit.sample):
            if road.holds(each.x, each.y):
                along = road.along(each.x, each.y)
                low, high = min(low, along), max(high, along)
    return low, high


def _extent(
    outline: Outline, road: Road, distance: Callable[[Road, float, float], float]
) -> tuple[float, float] | None:
    if not all(road.holds(x, y) for x, y in outline.points):
        return None
    reach = [distance(road, x, y) for x, y in outline.points]
    return min(reach), max(reach)


_WANTED = "accepted is a trace with at least two samples of one vehicle"


def _check_samples(path: Path, found: dict[str, Breaks], vehicles: dict[str, Vehicle]) -> None:
    if not found:
        raise fault(path, None, f"the trace holds no vehicle; {_WANTED}")
    if not vehicles:
        raise fault(path, None, f"no sample of the trace has a position; {_WANTED}")
    if not any(each.steps for each in found.values()):
        raise fault(
            path, None, f"the trace holds one sample of each of {len(found)} vehicle(s); {_WANTED}"
        )


def _check_motion(
    path: Path, vehicles: dict[str, Vehicle], dropped: int, outline: Outline, road: Road | None
) -> None:
    if dropped == len(vehicles):
        raise fault(path, None, f"no two samples of a vehicle are linked by motion; {_WANTED}")
    if road is not None and not outline.points:
        raise fault(
            path,
            None,
            f"no vehicle comes within {road.half_width:g} m of the road through "
            f"({road.x:g}, {road.y:g}) with heading {road.heading:g} rad; accepted is a road that "
            "vehicles of the trace drive on",
        )


def _fitted(path: Path, vehicles: dict[str, Vehicle]) -> Road:
    scatters = [each for vehicle in vehicles.values() for each in vehicle.scatters]
    try:
        return fit_road(scatters)
    except RoadError as error:
        raise fault(path, None, f"{error}; accepted is such a trace with a road given") from None
