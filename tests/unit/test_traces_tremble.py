"""Positions that tremble: told where the motion is no vehicle's, and nowhere else."""

import numpy as np
import pytest

from echobeam.traces.tremble import trembling

from .test_traces_motion import road_samples

TIMES = np.arange(0.0, 20.0, 0.1)


def car(noise, seed, v=20.0, a=0.0):
    """A car of known motion, seen with errors of a standard deviation in m."""
    errors = np.random.default_rng(seed).normal(0.0, noise, TIMES.size)
    return TIMES, v * TIMES + a * TIMES**2 / 2 + errors


@pytest.mark.parametrize("speeds", [True, False], ids=["speeds given", "speeds absent"])
def test_a_receivers_errors_are_told_with_the_worst_vehicle(speeds):
    tracks = [car(0.0, 0), car(0.3, 1), car(1.0, 2)]
    if speeds:
        tracks = [(*track, np.full(TIMES.size, 20.0)) for track in tracks]
    (note,) = trembling(road_samples(*tracks))
    assert note.startswith("the positions of 2 of 3 vehicles tremble")
    assert "most those of '2'" in note
    assert "smooth the positions" in note


@pytest.mark.parametrize(
    "track",
    [
        car(0.0, 0, v=5.0, a=3.0),
        (TIMES, np.round(20.03 * TIMES, 2)),
        (TIMES[::10], 20.0 * TIMES[::10] + np.random.default_rng(3).normal(0.0, 0.3, 20)),
        (TIMES, np.minimum(14.0 * TIMES, 70.0)),
        (TIMES, np.zeros(TIMES.size)),
        (TIMES[:3], np.array([0.0, 9.0, 1.0])),
    ],
    ids=["accelerates", "rounded", "seldom seen", "stops at once", "stands", "few samples"],
)
def test_motion_of_vehicles_is_not(track):
    assert list(trembling(road_samples(track))) == []


def test_no_samples_do_not_tremble():
    assert list(trembling(road_samples(([], [])))) == []
