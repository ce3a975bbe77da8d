"""Sums over a trace for each vehicle, and the convex hull of the positions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echobeam.traces.clock import ClockFit, Ticks, last_digit
from echobeam.traces.motion import GAP_PERIODS
from echobeam.traces.outline import Outline, Point
from echobeam.traces.road import Road, Scatter
from echobeam.traces.sample import Sample
from echobeam.traces.speeds import SpeedTally, Timing


@dataclass(slots=True)
class Vehicle:
    """Sums over the samples of one vehicle."""

    first: Sample
    speeds: SpeedTally
    ticks: Ticks = field(default_factory=Ticks)
    visit: int = -1
    begin: Sample | None = None
    scatters: list[Scatter] = field(default_factory=list)


@dataclass(slots=True)
class Totals:
    """Sums over the samples of all vehicles."""

    first: float = math.inf
    last: float = -math.inf
    low: Point = (math.inf, math.inf)
    high: Point = (-math.inf, -math.inf)
    position_digits: int = 0
    outline: Outline = field(default_factory=Outline)
    timing: Timing = field(default_factory=Timing)
    clock: ClockFit = field(default_factory=ClockFit)
    vehicles: dict[str, Vehicle] = field(default_factory=dict)

    def take(self, sample: Sample, visit: int, road: Road | None) -> None:
        """Add a sample."""
        vehicle = self.vehicles.get(sample.name)
        if vehicle is None:
            vehicle = Vehicle(sample, SpeedTally(self.timing))
            self.vehicles[sample.name] = vehicle
        self._place(sample)
        duration = self.clock.take(vehicle.ticks, sample.time)
        speeds = vehicle.speeds
        gap = speeds.steps > 0 and duration > GAP_PERIODS * speeds.time / speeds.steps
        if visit != vehicle.visit or gap:
            vehicle.visit = visit
            speeds.begin(sample)
            vehicle.begin = sample
            vehicle.scatters.append(Scatter(sample.x, sample.y))
        else:
            speeds.take(sample, duration)
            self._outline(vehicle, sample, road)
        vehicle.scatters[-1].add(sample.x, sample.y)

    def _place(self, sample: Sample) -> None:
        x, y = sample.x, sample.y
        self.first, self.last = min(self.first, sample.time), max(self.last, sample.time)
        if not (self.low[0] <= x <= self.high[0] and self.low[1] <= y <= self.high[1]):
            self.low = (min(self.low[0], x), min(self.low[1], y))
            self.high = (max(self.high[0], x), max(self.high[1], y))
        self.position_digits = last_digit(y, last_digit(x, self.position_digits))

    def _outline(self, vehicle: Vehicle, sample: Sample, road: Road | None) -> None:
        """Add a sample to the outline, and the first one of its visit before the second."""
        for each in (vehicle.begin, sample):
            if each is not None and (road is None or road.holds(each.x, each.y)):
                self.outline.add(each.x, each.y)
        vehicle.begin = None
