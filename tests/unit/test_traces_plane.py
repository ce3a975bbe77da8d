"""Traces in two dimensions: nothing is projected on a road."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.traces import PLANE, TraceError, load_motion

SLOTS = 0.01 * np.arange(301)


def written(path, tracks, times, digits=9):
    """Write the vehicles ``name: function of time -> (x, y)`` as a trace."""
    lines = ["t,id,x,y"]
    for t in times:
        for name, place in tracks.items():
            x, y = place(t)
            lines.append(f"{t:.3f},{name},{x:.{digits}f},{y:.{digits}f}")
    path.write_text("\n".join(lines))
    return path


def load(path, times=SLOTS, **options):
    given = {"uav_x": (0.0, 0.0), "max_objects": 4, "range_m": 500.0, "road": PLANE}
    return load_motion(path, times, **given | options)


@pytest.fixture
def crossing(tmp_path):
    """One car along x, one along y."""
    tracks = {"east": lambda t: (10 * t - 20, 2.0), "north": lambda t: (-3.0, 12 * t - 8)}
    return written(tmp_path / "crossing.csv", tracks, np.arange(0, 5.1, 0.5))


def test_roads_that_cross_are_no_fault_in_a_plane(crossing):
    with pytest.raises(TraceError, match="one straight road"):
        load_motion(crossing, SLOTS, uav_x=0.0, max_objects=4, range_m=500.0)
    motion = load(crossing, origin=(0.0, 0.0))
    assert motion.position.shape == (301, 4, 2)
    column = {name: int(np.argmax(motion.identity[0] == n)) for n, name in enumerate(motion.names)}
    east, north = motion.position[:, column["east"]], motion.position[:, column["north"]]
    still = np.zeros(SLOTS.size)
    np.testing.assert_allclose(east, np.stack([10 * SLOTS - 20, still + 2], -1), atol=1e-9)
    np.testing.assert_allclose(north, np.stack([still - 3, 12 * SLOTS - 8], -1), atol=1e-9)
    np.testing.assert_allclose(motion.velocity[:, column["east"]], [[10.0, 0.0]] * 301, atol=1e-9)


def test_the_origin_is_the_middle_of_the_rectangle_or_given(crossing):
    middle = load(crossing).position - load(crossing, origin=(0.0, 0.0)).position
    x, y = np.mean([-20.0, 30.0]), np.mean([-8.0, 52.0])
    np.testing.assert_allclose(middle[:, :2], np.broadcast_to([-x, -y], (301, 2, 2)), atol=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0])
def test_a_bend_is_followed(tmp_path, turn):
    """A circle of 20 m at 10 m/s, half a second between samples: 14 degrees apart.

    Between samples the cubic errs by (h^2 a / 2) (h / (2 R)) at most, 5 cm; an axis along which the
    motion turns round stops there, which costs a little more.
    """

    def place(t):
        angle = 0.5 * t + turn
        return 20 * np.cos(angle), 20 * np.sin(angle)

    path = written(tmp_path / "bend.csv", {"car": place}, np.arange(0, 3.1, 0.5))
    motion = load(path, origin=(0.0, 0.0))
    there = np.stack(place(SLOTS), axis=-1)
    assert np.abs(motion.position[:, 0] - there).max() < 0.2
    assert np.abs(np.hypot(*motion.velocity[:, 0].T) - 10.0).max() < 2.0


def test_a_stop_is_a_stop(tmp_path):
    def place(t):
        return (min(t, 2.0) * 8.0, min(t, 2.0) * 6.0)

    path = written(tmp_path / "stop.csv", {"car": place}, np.arange(0, 4.1, 0.5))
    motion = load(path, origin=(0.0, 0.0))
    still = SLOTS > 2.0
    np.testing.assert_allclose(motion.position[still, 0], [[16.0, 12.0]] * still.sum(), atol=1e-9)
    np.testing.assert_array_equal(motion.velocity[still, 0], 0.0)


def test_the_nearest_in_the_plane_are_served(tmp_path):
    tracks = {
        "a": lambda t: (30.0 + t, 40.0),  # 50 m off
        "b": lambda t: (0.0, 45.0 + t),
        "c": lambda t: (60.0, 0.0),
    }
    path = written(tmp_path / "three.csv", tracks, np.arange(0, 4.1, 0.5))
    motion = load(path, origin=(0.0, 0.0), max_objects=2)
    served = {motion.names[n] for n in motion.identity[0]}
    assert served == {"a", "b"}
    near = load(path, origin=(0.0, 0.0), range_m=49.0)
    assert [near.names[n] for n in near.identity[0] if n >= 0] == ["b"]
    moved = load(path, origin=(0.0, 0.0), max_objects=1, uav_x=(60.0, 10.0))
    assert moved.names[moved.identity[0, 0]] == "c"


def test_many_samples_are_thinned_without_a_projection(tmp_path):
    """Two digits at 40 samples a second: samples are left out, and the path across stays."""
    path = written(
        tmp_path / "fine.csv", {"car": lambda t: (8 * t, 6 * t)}, np.arange(0, 4, 0.025), 2
    )
    motion = load(path, origin=(0.0, 0.0))
    np.testing.assert_allclose(motion.position[:, 0, 1], 6 * SLOTS, atol=0.01)
    assert np.abs(motion.velocity[:, 0] - [8.0, 6.0]).max() < 0.05


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"origin": 3.0}, "origin must be a point"),
        ({"origin": (np.nan, 0.0)}, "origin must be finite"),
        ({"road": None, "uav_x": 0.0, "origin": (1.0, 2.0)}, "origin must be a number"),
    ],
)
def test_what_is_no_origin_is_refused(crossing, options, words):
    with pytest.raises(ValueError, match=words):
        load(crossing, **options)
