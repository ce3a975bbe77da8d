"""Convex hull of a stream of points: the extent of a trace along any road."""

from __future__ import annotations

from dataclasses import dataclass, field

Point = tuple[float, float]

_HULL_BUFFER = 4096


@dataclass(slots=True)
class Outline:
    """Convex hull of a stream of points."""

    points: list[Point] = field(default_factory=list)
    limit: int = _HULL_BUFFER

    def add(self, x: float, y: float) -> None:
        """Add a point."""
        self.points.append((x, y))
        if len(self.points) > self.limit:
            self.points = convex_hull(self.points)
            self.limit = max(_HULL_BUFFER, 2 * len(self.points))


def convex_hull(points: list[Point]) -> list[Point]:
    """Return the vertices of the convex hull of points (monotone chain)."""
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
