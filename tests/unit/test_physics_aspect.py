"""Aspect of a target from geometry and heading, by hand and by rotation matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from echobeam.physics.aspect import OnGround, OnRoad, aspect, road_aspect
from echobeam.physics.plane import GROUND_GEOMETRY
from echobeam.physics.road import ROAD_GEOMETRY
from echobeam.physics.targets import TARGETS
from echobeam.values import UavState

VEHICLE = TARGETS["3gpp-vehicle"]


def test_the_aspect_is_that_of_rotated_coordinates():
    """The standard's frame: x forward, y left, z up; azimuth from x to y, zenith from z."""
    rng = np.random.default_rng(2)
    turn = rng.uniform(-np.pi, np.pi, 200)
    sight = rng.standard_normal((200, 3)) * [100.0, 100.0, 10.0] - [0.0, 0.0, 80.0]
    heading = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1) * rng.uniform(1, 9)
    own = Rotation.from_euler("z", -turn[:, None]).apply(-sight)
    zenith, azimuth = aspect(sight, heading)
    np.testing.assert_allclose(zenith, np.arccos(own[:, 2] / np.linalg.norm(own, axis=-1)))
    np.testing.assert_allclose(np.exp(1j * azimuth), np.exp(1j * np.arctan2(own[:, 1], own[:, 0])))


@pytest.mark.parametrize(
    ("theta", "velocity", "azimuth"),
    [(60.0, 20.0, 180.0), (60.0, -20.0, 0.0), (120.0, 20.0, 0.0), (120.0, -20.0, 180.0)],
)
def test_on_the_road_the_uav_is_ahead_or_behind(theta, velocity, azimuth):
    """An object ahead of the UAV that drives on shows its back, one that comes its front."""
    found = road_aspect(np.array([np.radians(theta), 100.0, velocity]))
    assert np.degrees(found[0]) == pytest.approx(30.0)
    assert abs(np.degrees(found[1])) == pytest.approx(azimuth)


def test_the_echo_of_a_vehicle_below_is_that_of_its_roof():
    theta = np.radians([90.0, 90.0 + 1e-9])
    place = np.stack([theta, np.full(2, 50.0), [10.0, -3.0]], axis=-1)
    expected = 10.0 ** (0.1 * (21.26 - 11.25))
    np.testing.assert_allclose(OnRoad(VEHICLE).relative(place), expected, rtol=1e-9)


def test_without_a_velocity_it_is_the_mean_of_front_and_back():
    theta = np.radians([20.0, 45.0, 100.0])
    both = [
        OnRoad(VEHICLE).relative(np.stack([theta, theta, np.full(3, v)], axis=-1))
        for v in (5.0, -5.0, 0.0)
    ]
    np.testing.assert_allclose(both[2], 0.5 * (both[0] + both[1]), rtol=1e-12)
    assert not np.allclose(both[0], both[1])


def test_absent_objects_have_no_cross_section_and_disturb_nobody():
    place = np.array([[1.0, 50.0, 3.0], [np.nan, np.nan, np.nan], [2.0, 50.0, 0.0]])
    found = OnRoad(VEHICLE).relative(place)
    assert np.isnan(found[1])
    for row in (0, 2):
        assert found[row] == OnRoad(VEHICLE).relative(place[row : row + 1])[0]
    human = OnRoad(TARGETS["3gpp-human"]).relative(place)
    np.testing.assert_allclose(human, 1.0, rtol=1e-15)


UAV = UavState(np.array([5.0, 0.0, 60.0]), np.array([0.0, 0.0, -3.0]))


@pytest.mark.parametrize("name", ["3gpp-vehicle", "3gpp-agv", "3gpp-large-uav"])
def test_on_the_line_below_the_uav_the_ground_is_the_road(name):
    rng = np.random.default_rng(4)
    position, velocity = np.zeros((2, 200, 3))
    position[:, 0], velocity[:, 0] = rng.uniform(-200, 200, 200), rng.uniform(-20, 20, 200)
    found = [
        seen.relative(geometry.place(geometry.exact(position, velocity, UAV), UAV))
        for geometry, seen in (
            (ROAD_GEOMETRY, OnRoad(TARGETS[name])),
            (GROUND_GEOMETRY, OnGround(TARGETS[name])),
        )
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_a_vehicle_on_the_ground_shows_the_side_that_faces_the_uav():
    """By hand: it drives along y east of the UAV, which is to its left at 45 degrees."""
    state = np.array([5.0 + 60.0, 0.0, 0.0, 9.0, 0.0])
    off = (45.0 - 79.70) / 44.42
    expected = 20.75 - min(12.0 * off**2, 13.68) - 11.25
    found = OnGround(VEHICLE).relative(GROUND_GEOMETRY.place(state, UAV))
    assert 10.0 * np.log10(found) == pytest.approx(expected)


@pytest.mark.parametrize("name", ["3gpp-vehicle", "3gpp-agv", "3gpp-large-uav"])
def test_on_the_ground_an_unknown_heading_is_the_mean_over_all(name):
    """A measurement has no velocity; the mean over 20,000 headings, to 0.03 dB."""
    cosines = np.array([[0.2, 0.1], [0.5, -0.5], [-0.9, 0.2], [np.nan, np.nan]])
    value = np.concatenate([cosines, [[1e-6, 0.0]] * 4], axis=-1)
    found = OnGround(TARGETS[name]).relative(GROUND_GEOMETRY.measured_place(value))
    zenith = np.arcsin(np.hypot(*np.nan_to_num(cosines).T))
    turn = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
    expected = TARGETS[name].relative(zenith[:, None], turn).mean(axis=-1)
    np.testing.assert_allclose(10.0 * np.log10(found / expected), 0.0, atol=0.03)
