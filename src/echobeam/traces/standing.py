"""Headings of vehicles that stand: as they came, or as they will drive off, in the whole trace."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from echobeam.traces.breaks import Visit
from echobeam.traces.road import Road
from echobeam.values import Array

WAY = 1.0
"""m: displacement that is a motion; shorter ones may be the scatter of a vehicle that stands."""


@dataclass(slots=True)
class _Vehicle:
    visit: int
    along: float
    across: float
    heading: tuple[float, float] = (0.0, 0.0)
    decided: bool = False


@dataclass(frozen=True, slots=True)
class Standing:
    """Headings at the beginning of a run: of the last motion before, or else of the first after.

    Attributes
    ----------
    road
        The road, or the plane.
    begin
        Beginning of the run on the trace's clock, s.
    """

    road: Road
    begin: float
    _vehicles: dict[str, _Vehicle] = field(default_factory=dict)

    def watched(self, visits: Iterable[Visit]) -> Iterator[Visit]:
        """Yield samples as they are, and note where their vehicles go."""
        for visit in visits:
            vehicle = self._vehicles.get(visit.sample.name)
            if vehicle is None or not vehicle.decided:
                self._note(vehicle, visit)
            yield visit

    def headings(self, names: Sequence[str]) -> Array:
        """Return vectors along the vehicles' headings, zero for one that never moves.

        ``(names, 1)`` along the road, or ``(names, 2)`` in the plane.
        """
        found = [self._vehicles[name].heading for name in names]
        return np.array(found).reshape(-1, 2)[:, : 2 if self.road.plane else 1]

    def _note(self, vehicle: _Vehicle | None, visit: Visit) -> None:
        sample, number = visit
        along = self.road.along(sample.x, sample.y)
        across = self.road.across(sample.x, sample.y) if self.road.plane else 0.0
        if vehicle is None:
            self._vehicles[sample.name] = _Vehicle(number, along, across)
            return
        way = along - vehicle.along, across - vehicle.across
        same = number == vehicle.visit
        if same and math.hypot(*way) < WAY:
            return
        vehicle.visit, vehicle.along, vehicle.across = number, along, across
        if not same:
            return
        later = sample.time > self.begin
        if not (later and any(vehicle.heading)):
            vehicle.heading = way
        vehicle.decided = later
