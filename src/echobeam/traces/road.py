"""Road as a straight axis, with positions of vehicles along and across it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echobeam.faults import InputError
from echobeam.values import Array, BoolArray

HALF_WIDTH = 30.0
"""Largest distance from the axis of a vehicle on the road, m."""

_ROUNDEST = 1.0 / 9.0
"""Largest ratio of the variances across and along a road, 1."""


_FITS = 20
"""Largest number of fits; if the selected visits still change, two roads are too similar."""

_STANDS = 25.0
"""Smallest sum of squares of a visit with a direction, m^2."""


class RoadError(InputError):
    """Error of positions or points that determine no road."""


@dataclass(frozen=True, slots=True)
class Road:
    """Straight road through a point, in the trace's plane.

    Attributes
    ----------
    x, y
        Point at which the distance along the road is zero, m.
    heading
        Direction of increasing distance along the road, rad, counter-clockwise from the x axis.
    half_width
        Largest distance from the axis of a vehicle on the road, m; infinite in the `PLANE`.
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

    @property
    def plane(self) -> bool:
        """Whether it is as wide as the plane: positions in two dimensions, none projected."""
        return math.isinf(self.half_width)

    def along(self, x: float, y: float) -> float:
        """Return the distance along the road, m, of a point in the trace's plane."""
        return (x - self.x) * math.cos(self.heading) + (y - self.y) * math.sin(self.heading)

    def across(self, x: float, y: float) -> float:
        """Return the offset to the left of the axis, m, of a point in the trace's plane."""
        return (y - self.y) * math.cos(self.heading) - (x - self.x) * math.sin(self.heading)

    def holds(self, x: float, y: float) -> bool:
        """Return whether a point is on the road, at any position along it."""
        return abs(self.across(x, y)) <= self.half_width


PLANE = Road(0.0, 0.0, 0.0, math.inf)
"""No road at all: along and across are the trace's x and y."""


def road_between(
    start: tuple[float, float], end: tuple[float, float], half_width: float = HALF_WIDTH
) -> Road:
    """Return the road from one point, its origin, towards another.

    Raises
    ------
    RoadError
        If the points coincide or are not finite.
    """
    if start == end:
        raise RoadError(f"a road needs two different points, not twice {start}")
    heading = math.atan2(end[1] - start[1], end[0] - start[0])
    return Road(*start, heading, half_width)


@dataclass(slots=True)
class Scatter:
    """Sums over one visit's positions, relative to its first one."""

    x: float
    y: float
    count: int = 0
    dx: float = 0.0
    dy: float = 0.0
    xx: float = 0.0
    xy: float = 0.0
    yy: float = 0.0

    def add(self, x: float, y: float) -> None:
        """Add a position."""
        dx, dy = x - self.x, y - self.y
        self.count += 1
        self.dx += dx
        self.dy += dy
        self.xx += dx * dx
        self.xy += dx * dy
        self.yy += dy * dy


def fit_road(scatters: Sequence[Scatter]) -> Road:
    """Return the road of the vehicles' paths by total least squares.

    One line per visit is fitted, all with the same direction, since lanes are parallel: the lanes'
    offsets then do not rotate the axis. The axis passes through the centre of all positions. If no
    vehicle has moved, one line is fitted through all of them; if all are at one point, every
    direction gives the same motion, and the x axis is taken.

    Then the visits on another road, with their middle off this one or a path across it, are omitted
    and the rest is fitted again, until the selection no longer changes.

    The origin of the road is its point nearest to (0, 0) of the trace, so that a road along the
    trace's x axis has the same x. Its direction has a positive larger component.

    Parameters
    ----------
    scatters
        Sums over the positions of each visit.

    Raises
    ------
    RoadError
        If the positions spread too evenly for one straight road, or if less than half of them
        are on the best-fitting road.
    """
    table = np.array(
        [(s.x, s.y, s.count, s.dx, s.dy, s.xx, s.xy, s.yy) for s in scatters], dtype=float
    )
    moved = table[:, 2] > 1  # the single sample of a visit may be at any position
    table = table[moved] if moved.any() else table
    anchor = table[0, :2].copy()  # equal positions give exact zeros
    count = table[:, 2]
    shift = table[:, 3:5] / count[:, None]
    mean = table[:, :2] - anchor + shift
    own = table[:, [5, 6, 6, 7]].reshape(-1, 2, 2) - count[:, None, None] * (
        shift[:, :, None] * shift[:, None, :]
    )
    chosen = np.ones(count.size, dtype=bool)
    for _ in range(_FITS):
        centre, direction = _axis(count[chosen], mean[chosen], own[chosen])
        on_it = _on_axis(mean - centre, own, direction)
        if count[on_it].sum() <= 0.5 * count.sum():  # distant visits have shifted the centre
            centre = _middle(count[chosen], mean[chosen], direction)
            on_it = _on_axis(mean - centre, own, direction)
        if (on_it == chosen).all() or not on_it.any():
            break
        chosen = on_it
    if count[on_it].sum() <= 0.5 * count.sum():
        raise RoadError(
            "the vehicles do not follow one straight road (half of their samples or more are not "
            f"within {HALF_WIDTH:g} m of the best-fitting one)"
        )
    normal = np.array([-direction[1], direction[0]])
    foot = normal * (normal @ (anchor + centre))
    return Road(float(foot[0]), float(foot[1]), math.atan2(direction[1], direction[0]))


def _axis(count: Array, mean: Array, own: Array) -> tuple[Array, Array]:
    """Return the centre of visits and the direction of their largest spread."""
    centre: Array = count @ mean / count.sum()
    apart = mean - centre
    within, between = own.sum(axis=0), (count[:, None] * apart).T @ apart
    scatter = next((each for each in (within, between) if np.trace(each) > 0), None)
    if scatter is None:
        return centre, np.array([1.0, 0.0])
    spread, axes = np.linalg.eigh(scatter)
    if spread[0] > _ROUNDEST * spread[1]:
        raise RoadError(
            "the vehicles do not follow one straight road (they spread "
            f"{math.sqrt(spread[0] / spread[1]):.0%} as much across as along the best axis)"
        )
    direction: Array = axes[:, 1] * np.sign(axes[np.argmax(np.abs(axes[:, 1])), 1])
    return centre, direction


def _middle(count: Array, mean: Array, direction: Array) -> Array:
    """Return the visit with equally many samples to its left and to its right."""
    offset = mean @ np.array([-direction[1], direction[0]])
    order = np.argsort(offset, kind="stable")
    half = np.searchsorted(np.cumsum(count[order]), count.sum() / 2)
    middle: Array = mean[order[half]]
    return middle


def _on_axis(apart: Array, own: Array, direction: Array) -> BoolArray:
    """Return whether visits have their middle on a road and do not cross it."""
    normal = np.array([-direction[1], direction[0]])
    across = np.einsum("i,nij,j->n", normal, own, normal)
    along = np.einsum("i,nij,j->n", direction, own, direction)
    middle_on_it = np.abs(apart @ normal) <= HALF_WIDTH
    on_it: BoolArray = middle_on_it & (across <= np.maximum(along, _STANDS))
    return on_it
