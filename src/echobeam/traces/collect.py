"""Second pass over a trace: selection of the samples for the slots of a run.

An interval between two successive samples of a vehicle is selected if it overlaps both the time
window and the stretch of road that the UAV can serve; its two ends are stored, with some samples
before and after for the speeds at the ends. All others are discarded at once, so memory grows with
the window and the number of vehicles, not with the length of the file.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echobeam.traces.breaks import Visit
from echobeam.traces.road import Road
from echobeam.traces.sample import Sample
from echobeam.values import Array, BoolArray, IntArray

CONTEXT = 3
"""Number of samples stored before and after a selected interval."""


class Window(NamedTuple):
    """Selected part of a trace: times in s, distances along the road in m."""

    begin: float
    end: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class RoadSamples:
    """Samples of vehicles on a road, ordered by vehicle and time; ``n`` of them.

    Attributes
    ----------
    names
        The vehicles' ids, sorted.
    vehicle
        ``(n,)``: index into ``names``.
    visit
        ``(n,)``: number of earlier absences of the vehicle, off the road or elsewhere.
    time
        ``(n,)`` s.
    along, across
        ``(n,)`` m, in the road's coordinates.
    speed
        ``(n,)`` m/s; NaN if unknown.
    """

    names: tuple[str, ...]
    vehicle: IntArray
    visit: IntArray
    time: Array
    along: Array
    across: Array
    speed: Array


def taken(samples: RoadSamples, which: BoolArray) -> RoadSamples:
    """Return some of the samples, ``which`` is ``(n,)``."""
    return RoadSamples(
        names=samples.names,
        vehicle=samples.vehicle[which],
        visit=samples.visit[which],
        time=samples.time[which],
        along=samples.along[which],
        across=samples.across[which],
        speed=samples.speed[which],
    )


class _Placed(NamedTuple):
    visit: int
    time: float
    along: float
    across: float
    speed: float


@dataclass(slots=True)
class OffRoad:
    """Samples beside the road.

    Attributes
    ----------
    farthest
        Largest distance from the axis, m, of each vehicle that was ever off the road.
    first
        First sample off the road.
    """

    farthest: dict[str, float] = field(default_factory=dict)
    first: Sample | None = None

    def add(self, sample: Sample, distance: float) -> None:
        """Add a sample."""
        self.farthest[sample.name] = max(distance, self.farthest.get(sample.name, 0.0))
        self.first = self.first or sample


@dataclass(slots=True)
class _Follower:
    """Selection of one vehicle's samples, one by one."""

    context: int
    visit: int = 0
    number: int = 0
    last: _Placed | None = None
    pending: tuple[_Placed, ...] = ()
    keep_next: int = 0

    def leave(self) -> None:
        """Record that the vehicle is absent."""
        if self.last is not None:
            self.visit += 1
        self.last, self.keep_next, self.pending = None, 0, ()

    def follow(self, placed: _Placed, window: Window) -> list[_Placed]:
        """Return the samples that are selected because of this one."""
        matters = self.last is not None and _meets(self.last, placed, window)
        self.last = placed
        if matters:
            keep = [*self.pending, placed]
            self.pending, self.keep_next = (), self.context
        elif self.keep_next > 0:
            keep = [placed]
            self.keep_next -= 1
        else:
            keep = []
            self.pending = (*self.pending, placed)[-1 - self.context :]
        return keep


def collect(
    visits: Iterable[Visit], road: Road, window: Window, off: OffRoad, context: int = CONTEXT
) -> RoadSamples:
    """Return the samples on a road that are needed for a window.

    Parameters
    ----------
    visits
        A trace's samples, each vehicle's in order of time.
    road
        The road; samples off it end the vehicle's visit.
    window
        Times and distances along the road to select.
    off
        Filled with the samples beside the road.
    context
        Number of samples stored before and after a selected interval.
    """
    followers: dict[str, _Follower] = {}
    index: dict[str, int] = {}
    kept = array("d")
    for sample, number in visits:
        follower = followers.get(sample.name)
        if follower is None:
            follower = followers[sample.name] = _Follower(context)
        if number != follower.number:
            follower.number = number
            follower.leave()
        across = road.across(sample.x, sample.y)
        if abs(across) > road.half_width:
            off.add(sample, abs(across))
            follower.leave()
            continue
        along = road.along(sample.x, sample.y)
        placed = _Placed(follower.visit, sample.time, along, across, sample.speed)
        for each in follower.follow(placed, window):
            kept.append(index.setdefault(sample.name, len(index)))
            kept.extend(each)
    return _ordered(index, np.array(kept).reshape(-1, 1 + len(_Placed._fields)))


def _meets(one: _Placed, other: _Placed, window: Window) -> bool:
    """Return whether the interval between two samples overlaps the window.

    The motion between two samples is monotone (see `motion`), so this is exact.
    """
    return (
        one.time <= window.end
        and other.time >= window.begin
        and min(one.along, other.along) <= window.high
        and max(one.along, other.along) >= window.low
    )


def _ordered(index: dict[str, int], rows: Array) -> RoadSamples:
    names = tuple(sorted(index))
    rank = np.zeros(len(names), dtype=np.int64)
    rank[[index[name] for name in names]] = np.arange(len(names))
    vehicle = rank[rows[:, 0].astype(np.int64)]
    order = np.lexsort((rows[:, 2], vehicle))
    visit, time, along, across, speed = rows[order, 1:].T
    return RoadSamples(names, vehicle[order], visit.astype(np.int64), time, along, across, speed)
