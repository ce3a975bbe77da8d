"""Positions that jitter: left out where the motion is no vehicle's, and nowhere else."""

import numpy as np
import pytest

from echobeam.traces.jitter import without_jitter

from .test_traces_motion import road_samples

TIMES = np.arange(0.0, 20.0, 0.1)


def car(noise, seed, v=20.0, a=0.0):
    """A car of known motion, seen with errors of a standard deviation in m."""
    errors = np.random.default_rng(seed).normal(0.0, noise, TIMES.size)
    return TIMES, v * TIMES + a * TIMES**2 / 2 + errors


@pytest.mark.parametrize("speeds", [True, False], ids=["speeds given", "speeds absent"])
def test_vehicles_with_a_receivers_errors_are_left_out(speeds):
    tracks = [car(0.0, 0), car(0.3, 1), car(1.0, 2)]
    if speeds:
        tracks = [(*track, np.full(TIMES.size, 20.0)) for track in tracks]
    found = without_jitter(road_samples(*tracks))
    assert found.note.startswith("the positions of 2 of 3 vehicles jitter, most those of '2'")
    assert "smooth the positions" in found.note
    assert set(found.samples.vehicle) == {0}
    assert not found.nobody


def test_nobody_is_left_where_all_jitter():
    assert without_jitter(road_samples(car(1.0, 2), car(1.0, 3))).nobody


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
    samples = road_samples(track)
    assert without_jitter(samples) == (samples, "", False)


def test_no_samples_do_not_jitter():
    assert without_jitter(road_samples(([], []))).note == ""
