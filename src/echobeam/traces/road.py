"""The road as a straight axis: vehicles are placed along it and across it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echobeam.faults import InputError
from echobeam.values import Array

HALF_WIDTH = 30.0
"""m: how far from the axis of a given road a vehicle still counts as on it."""

_ROUNDEST = 1.0 / 9.0
"""Largest ratio of variances across and along: more than this is no road, but a place."""


class RoadError(InputError):
    """Positions or points that do not tell where a road runs."""


@dataclass(frozen=True, slots=True)
class Road:
    """A straight road through a point, in the trace's plane.

    Attributes
    ----------
    x, y
        m: the point where the distance along the road is zero.
    heading
        rad, counter-clockwise from the x axis: where the distance along the road grows.
    half_width
        m: vehicles farther from the axis are on other roads.
    """

    x: float
    y: float
    heading: float
    half_width: float = HALF_WIDTH

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.x, self.y, self.heading))):
            raise RoadError(f"a road needs a finite point and heading, not {self}")
        if not self.half_width > 0:
            raise RoadError(f"a road's half_width must be positive, not {self.half_width!r}")

    def along(self, x: float, y: float) -> float:
        """Return the distance along the road, m, of a point in the trace's plane."""
        return (x - self.x) * math.cos(self.heading) + (y - self.y) * math.sin(self.heading)

    def across(self, x: float, y: float) -> float:
        """Return the offset to the left of the axis, m, of a point in the trace's plane."""
        return (y - self.y) * math.cos(self.heading) - (x - self.x) * math.sin(self.heading)

    def holds(self, x: float, y: float) -> bool:
        """Whether a point is on the road, wherever along it."""
        return abs(self.across(x, y)) <= self.half_width


def road_between(
    start: tuple[float, float], end: tuple[float, float], half_width: float = HALF_WIDTH
) -> Road:
    """Return the road from one point, where it is zero, towards another.

    Raises
    ------
    RoadError
        If the points coincide or are not finite.
    """
    if start == end:
        raise RoadError(f"a road needs two different points, not twice {start}")
    heading = math.atan2(end[1] - start[1], end[0] - start[0])
    return Road(*start, heading, half_width)


def fit_road(within: Array, between: Array, centre: tuple[float, float]) -> Road:
    """Return the road that vehicles have driven, by total least squares.

    One line per vehicle is fitted, all with the same direction, since lanes are parallel: the
    lanes' offsets then do not turn the axis. The axis runs through the centre of all positions.
    Where no vehicle has moved, one line is fitted through all of them; where all stand at one
    point, every direction gives the same motion, and the x axis is taken.

    The road is zero where it is nearest to the trace's own (0, 0), so that a road along the
    trace's x axis keeps its x. It points where its larger component is positive. All vehicles
    are on it, since it was fitted through them.

    Parameters
    ----------
    within
        ``(2, 2)`` m^2: scatter of positions about the mean of their vehicle.
    between
        ``(2, 2)`` m^2: scatter of those means about the centre, weighted by samples.
    centre
        m: mean of all positions.

    Raises
    ------
    RoadError
        If the positions spread too evenly for one straight road.
    """
    scatter = next((each for each in (within, between) if np.trace(each) > 0), None)
    if scatter is None:
        direction = np.array([1.0, 0.0])
    else:
        spread, axes = np.linalg.eigh(scatter)
        if spread[0] > _ROUNDEST * spread[1]:
            raise RoadError(
                "the vehicles do not follow one straight road (they spread "
                f"{math.sqrt(spread[0] / spread[1]):.0%} as much across as along the best axis)"
            )
        direction = axes[:, 1] * np.sign(axes[np.argmax(np.abs(axes[:, 1])), 1])
    normal = np.array([-direction[1], direction[0]])
    foot = normal * (normal @ np.array(centre))
    return Road(float(foot[0]), float(foot[1]), math.atan2(direction[1], direction[0]), math.inf)
