"""The first pass over a trace: its time span, its road, and how far it reaches along the road.

It reads the whole file, so that a damaged one is refused even where the damage lies outside the
slots, and keeps six numbers per vehicle and the convex hull of the positions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from echobeam.traces.road import Road, RoadError, fit_road
from echobeam.traces.sample import Sample, fault
from echobeam.values import Array

Point = tuple[float, float]

_HULL_BUFFER = 4096


@dataclass(frozen=True, slots=True)
class Survey:
    """What holds for a trace as a whole.

    Attributes
    ----------
    first, last
        s: the times of its first and last sample.
    road
        The given road, or the fitted one.
    extent
        m: the smallest and largest distance along the road of the vehicles on it.
    dropped
        Number of vehicles with one sample only, which tells no motion.
    """

    first: float
    last: float
    road: Road
    extent: tuple[float, float]
    dropped: int


@dataclass(slots=True)
class _Tally:
    """One vehicle's positions in sum, counted from its first one."""

    x: float
    y: float
    count: int = 0
    dx: float = 0.0
    dy: float = 0.0


@dataclass(slots=True)
class _Outline:
    """The convex hull of a stream of points."""

    points: list[Point] = field(default_factory=list)
    limit: int = _HULL_BUFFER

    def add(self, x: float, y: float) -> None:
        self.points.append((x, y))
        if len(self.points) > self.limit:
            self.points = convex_hull(self.points)
            self.limit = max(_HULL_BUFFER, 2 * len(self.points))


def survey_trace(path: Path, samples: Iterable[Sample], road: Road | None = None) -> Survey:
    """Return what holds for a trace as a whole.

    Parameters
    ----------
    path
        The file's name, for messages.
    samples
        All of its samples.
    road
        The road to look at; fitted if not given.

    Raises
    ------
    TraceError
        If there is no sample, no vehicle has two, none is on the given road, or no road can be
        fitted.
    """
    first, last = float("inf"), float("-inf")
    tallies: dict[str, _Tally] = {}
    outline = _Outline()
    squares = [0.0, 0.0, 0.0]
    for sample in samples:
        first, last = min(first, sample.time), max(last, sample.time)
        tally = tallies.get(sample.name)
        if tally is None:
            tally = tallies[sample.name] = _Tally(sample.x, sample.y)
        dx, dy = sample.x - tally.x, sample.y - tally.y
        tally.count += 1
        tally.dx += dx
        tally.dy += dy
        squares[0] += dx * dx
        squares[1] += dx * dy
        squares[2] += dy * dy
        if road is None or road.holds(sample.x, sample.y):
            outline.add(sample.x, sample.y)
    dropped = sum(tally.count == 1 for tally in tallies.values())
    _check(path, tallies, dropped, outline, road)
    road = _fitted(path, tallies, squares) if road is None else road
    reach = [road.along(x, y) for x, y in outline.points]
    return Survey(first, last, road, (min(reach), max(reach)), dropped)


def convex_hull(points: list[Point]) -> list[Point]:
    """Return the corners of the smallest convex polygon around points (monotone chain)."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered
    return _half_hull(ordered) + _half_hull(ordered[::-1])


def _half_hull(ordered: list[Point]) -> list[Point]:
    chain: list[Point] = []
    for x, y in ordered:
        while len(chain) > 1:
            (x0, y0), (x1, y1) = chain[-2:]
            if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0:
                break
            chain.pop()
        chain.append((x, y))
    return chain[:-1]


def _check(
    path: Path, tallies: dict[str, _Tally], dropped: int, outline: _Outline, road: Road | None
) -> None:
    wanted = "accepted is a trace with at least two samples of one vehicle"
    if not tallies:
        raise fault(path, None, f"the trace holds no vehicle; {wanted}")
    if dropped == len(tallies):
        raise fault(
            path, None, f"the trace holds one sample of each of {dropped} vehicle(s); {wanted}"
        )
    if road is not None and not outline.points:
        raise fault(
            path,
            None,
            f"no vehicle comes within {road.half_width:g} m of the road through "
            f"({road.x:g}, {road.y:g}) with heading {road.heading:g} rad; accepted is a road that "
            "vehicles of the trace drive on",
        )


def _fitted(path: Path, tallies: dict[str, _Tally], squares: list[float]) -> Road:
    within, between, centre = _scatter(list(tallies.values()), squares)
    try:
        return fit_road(within, between, centre)
    except RoadError as error:
        raise fault(path, None, f"{error}; accepted is such a trace with a road given") from None


def _scatter(tallies: list[_Tally], squares: list[float]) -> tuple[Array, Array, Point]:
    """Split the scatter of all positions into that within and that between vehicles."""
    xx, xy, yy = squares
    count = np.array([float(tally.count) for tally in tallies])
    shift = np.array([[tally.dx, tally.dy] for tally in tallies]) / count[:, None]
    within = np.array([[xx, xy], [xy, yy]]) - (count[:, None] * shift).T @ shift
    # Counted from the first vehicle's first position: equal positions give exact zeros.
    anchor = np.array([tallies[0].x, tallies[0].y])
    means = np.array([[tally.x, tally.y] for tally in tallies]) - anchor + shift
    mean = count @ means / count.sum()
    apart = means - mean
    between = (count[:, None] * apart).T @ apart
    return within, between, (float(anchor[0] + mean[0]), float(anchor[1] + mean[1]))
