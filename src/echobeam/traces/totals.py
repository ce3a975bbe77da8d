"""Sums over a trace: some numbers for each vehicle, and the convex hull of the positions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echobeam.traces.breaks import Breaks
from echobeam.traces.clock import ClockFit, Ticks, last_digit
from echobeam.traces.motion import GAP_PERIODS
from echobeam.traces.outline import Outline, Point
from echobeam.traces.road import Road, Scatter
from echobeam.traces.sample import Sample
from echobeam.traces.speeds import SpeedTally, Timing


@dataclass(slots=True)
class Vehicle:
    """What is known of one vehicle."""

    first: Sample
    speeds: SpeedTally
    found: Breaks
    ticks: Ticks = field(default_factory=Ticks)
    visit: int = -1
    scatters: list[Scatter] = field(default_factory=list)


@dataclass(slots=True)
class Totals:
    """What is known of all vehicles together."""

    first: float = math.inf
    last: float = -math.inf
    low: Point = (math.inf, math.inf)
    high: Point = (-math.inf, -math.inf)
    position_digits: int = 0
    outline: Outline = field(default_factory=Outline)
    timing: Timing = field(default_factory=Timing)
    clock: ClockFit = field(default_factory=ClockFit)
    vehicles: dict[str, Vehicle] = field(default_factory=dict)

    def take(self, sample: Sample, visit: int, found: dict[str, Breaks], road: Road | None) -> None:
        """Take account of a sample."""
        vehicle = self.vehicles.get(sample.name)
        if vehicle is None:
            vehicle = Vehicle(sample, SpeedTally(self.timing), found[sample.name])
            self.vehicles[sample.name] = vehicle
        self._place(sample, road)
        duration = self.clock.take(vehicle.ticks, sample.time)
        speeds = vehicle.speeds
        gap = speeds.steps > 0 and duration > GAP_PERIODS * speeds.time / speeds.steps
        if visit != vehicle.visit or gap:
            vehicle.visit = visit
            speeds.begin(sample)
            vehicle.scatters.append(Scatter(sample.x, sample.y))
        else:
            speeds.take(sample, duration)
        vehicle.scatters[-1].add(sample.x, sample.y)

    def _place(self, sample: Sample, road: Road | None) -> None:
        x, y = sample.x, sample.y
        self.first, self.last = min(self.first, sample.time), max(self.last, sample.time)
        if not (self.low[0] <= x <= self.high[0] and self.low[1] <= y <= self.high[1]):
            self.low = (min(self.low[0], x), min(self.low[1], y))
            self.high = (max(self.high[0], x), max(self.high[1], y))
        self.position_digits = last_digit(y, last_digit(x, self.position_digits))
        if road is None or road.holds(x, y):
            self.outline.add(x, y)
