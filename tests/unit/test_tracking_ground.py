"""Models of a state on the ground against the paper's, finite differences and integration."""

import numpy as np
import pytest

from echobeam.physics.geometry import polar_state
from echobeam.physics.measurement import measure
from echobeam.tracking.ground import GroundMeasurement, GroundMotion, polar_of
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import UavState

CARRIER = 30e9
UAV = UavState(np.array([5.0, 0.0, 100.0]), np.array([12.0, 0.0, -3.0]))
SLOT = 0.01


def states(seed, axes, count=6):
    size = 2 * axes + 1
    scale = np.array([60.0] * axes + [20.0] * axes + [0.7])
    return scale * np.random.default_rng(seed).standard_normal((count, size))


def test_a_state_on_the_road_is_measured_as_the_paper_measures_it():
    state = states(1, 1)
    position = np.zeros((6, 3))
    position[:, 0], position[:, 2] = state[:, 0], -state[:, 2]  # b below where it should be
    seen = polar_state(position, state[:, 1:2], UAV)
    np.testing.assert_allclose(polar_of(state, UAV), seen, rtol=1e-13)
    expected = measure(*seen.T, UAV.speed, UAV.heading, CARRIER)
    found = GroundMeasurement(CARRIER).expected(state, UAV)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)


def test_a_plane_holds_the_road():
    """With nothing across the road both instances tell the same distance and direction."""
    road = states(2, 1)
    plane = np.zeros((6, 5))
    plane[:, [0, 2, 4]] = road
    one = GroundMeasurement(CARRIER).expected(road, UAV)
    two = GroundMeasurement(CARRIER, axes=2).expected(plane, UAV)
    np.testing.assert_allclose(two[:, 0], np.cos(one[:, 0]), rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(two[:, 1], 0.0)
    np.testing.assert_allclose(two[:, 2:], one[:, 1:], rtol=1e-12)


def test_the_plane_is_seen_as_vectors_say():
    state, uav = states(3, 2), UavState(np.array([5.0, -7.0, 90.0]), np.array([4.0, 3.0, -2.0]))
    sight = np.stack([state[:, 0] - 5.0, state[:, 1] + 7.0, -(90.0 + state[:, 4])], axis=-1)
    distance = np.linalg.norm(sight, axis=-1)
    moves = np.stack([state[:, 2], state[:, 3], np.zeros(6)], axis=-1) - uav.velocity
    rate = (moves * sight).sum(axis=-1) / distance
    found = GroundMeasurement(CARRIER, axes=2).expected(state, uav)
    np.testing.assert_allclose(found[:, :2], sight[:, :2] / distance[:, None], rtol=1e-12)
    np.testing.assert_allclose(found[:, 2], 2.0 * distance / SPEED_OF_LIGHT, rtol=1e-12)
    np.testing.assert_allclose(found[:, 3], -2.0 * CARRIER / SPEED_OF_LIGHT * rate, rtol=1e-11)


@pytest.mark.parametrize("axes", [1, 2])
def test_the_slopes_are_those_of_finite_differences(axes):
    model, motion = GroundMeasurement(CARRIER, axes), GroundMotion(SLOT, 0.5, axes)
    state, uav = states(4, axes), UavState(np.array([5.0, -7.0, 90.0]), np.array([4.0, 3.0, -2.0]))
    h = 1e-4
    H, G = model.jacobian(state, uav), motion.jacobian(state, uav)
    unit = np.abs(H).max(axis=(0, 2))  # of each component: seconds and hertz are far apart
    for column in range(state.shape[-1]):
        move = h * np.eye(state.shape[-1])[column]
        slope = (model.expected(state + move, uav) - model.expected(state - move, uav)) / (2 * h)
        np.testing.assert_allclose(H[..., column] / unit, slope / unit, rtol=1e-5, atol=1e-6)
        slope = (motion.step(state + move, uav) - motion.step(state - move, uav)) / (2 * h)
        np.testing.assert_allclose(G[..., column], slope, atol=1e-9)


@pytest.mark.parametrize("axes", [1, 2])
def test_the_noise_is_that_of_an_acceleration_within_the_slot(axes):
    """Integrated in a thousand steps; the altitude error stands still."""
    steps, std = 1000, 0.5
    acceleration = std / SLOT
    x = v = 0.0
    for _ in range(steps):
        x += (v + 0.5 * acceleration * SLOT / steps) * SLOT / steps
        v += acceleration * SLOT / steps
    noise = GroundMotion(SLOT, std, axes).noise()
    for axis in range(axes):
        pair = np.ix_([axis, axes + axis], [axis, axes + axis])
        np.testing.assert_allclose(noise[pair], np.outer([x, v], [x, v]), rtol=1e-9)
    assert not noise[-1].any()
    assert np.count_nonzero(noise) == 4 * axes


def test_spaces_have_a_name_for_every_component():
    for axes, names in ((1, 3), (2, 5)):
        space = GroundMotion(SLOT, 0.5, axes).space
        assert (space.size, len(space.units), space.names[-1]) == (names, names, "altitude_error")
        assert space.valid(np.zeros(names))
        assert not space.valid(np.full(names, np.nan))


def test_an_angle_is_wrapped():
    found = GroundMeasurement(CARRIER).residual(np.array([3.0, 0.0, 0.0]), np.array([-3.0, 0, 0]))
    assert found[0] == pytest.approx(6.0 - 2.0 * np.pi)
