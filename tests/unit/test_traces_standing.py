"""Headings of vehicles that stand, from their samples in a whole trace."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.traces.breaks import Visit
from echobeam.traces.road import PLANE, road_between
from echobeam.traces.sample import Sample
from echobeam.traces.standing import Standing

NORTH = road_between((0.0, -50.0), (0.0, 50.0))


def watched(road, begin, *points):
    """Give (t, x, y) or (t, x, y, visit) of one vehicle; return its heading."""
    standing = Standing(road, begin)
    visits = [
        Visit(Sample(t, "a", x, y, np.nan, line), *(visit or [0]))
        for line, (t, x, y, *visit) in enumerate(points, 1)
    ]
    assert list(standing.watched(visits)) == visits
    (heading,) = standing.headings(["a"])
    return heading.tolist()


@pytest.mark.parametrize(
    ("begin", "heading"),
    [
        (-1.0, [3, 4]),  # before all motion: the first to come
        (0.0, [3, 4]),
        (1.0, [3, 4]),  # after the first, which ends there: the last
        (2.5, [0, -7]),
        (9.0, [0, -7]),
    ],
)
def test_it_is_the_last_motion_before_the_run_or_else_the_first_one_after(begin, heading):
    points = [(0, 0, 0), (1, 3, 4), (1.5, 3, 4), (2, 3, -3), (3, 3, -3), (4, 10, -3)]
    assert watched(PLANE, begin, *points[:5]) == heading


def test_ways_below_a_metre_add_up_and_scatter_does_not():
    creeping = [(t, 0.3 * t, 0.0) for t in range(5)]
    assert watched(PLANE, 0.0, *creeping) == pytest.approx([1.2, 0.0])
    scattered = [(t, 0.4 * (-1) ** t, 0.0) for t in range(9)]
    assert watched(PLANE, 0.0, *scattered) == [0.0, 0.0]


def test_a_jump_between_visits_is_no_motion():
    jumps = [(0, 0, 0), (1, 0, 0), (2, 90, 90, 1), (3, 90, 88, 1)]
    assert watched(PLANE, 0.0, *jumps) == [0.0, -2.0]


def test_on_a_road_it_is_the_direction_along_it():
    assert watched(NORTH, 0.0, (0, 5, 5), (1, 5, 5), (2, 9, 5), (3, 9, 2)) == pytest.approx([-3.0])
