"""Geometry against points in the plane, and noise along the road against conditioning."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echobeam.physics.geometry import (
    along_road,
    along_road_variance,
    offset,
    offset_cov,
    polar_state,
)
from echobeam.values import UavState

UAV = UavState(position=np.array([12.0, 0.0, 80.0]), velocity=np.array([3.0, 0.0, -9.0]))
STDS = (0.02, 0.7)


def states(*shape):
    """Random states (theta, d, v) and the place of each relative to the UAV."""
    rng = np.random.default_rng(21)
    theta, d = rng.uniform(0.05, np.pi - 0.05, shape), rng.uniform(20.0, 200.0, shape)
    return np.stack([theta, d, rng.normal(0.0, 20.0, shape)], axis=-1)


def test_angle_and_distance_are_those_of_the_triangle():
    position = np.array([[12.0 + 80.0, 0.0, 0.0], [12.0 - 60.0, 0.0, 0.0], [12.0, 0.0, 0.0]])
    velocity = np.array([[5.0, 0.0, 0.0], [-7.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    seen = polar_state(position, velocity, UAV)
    expected_angle = [np.pi / 4, np.pi - math.asin(0.8), np.pi / 2]
    np.testing.assert_allclose(seen[:, 0], expected_angle, rtol=1e-15)
    np.testing.assert_allclose(seen[:, 1], [80 * math.sqrt(2), 100.0, 80.0], rtol=1e-15)
    np.testing.assert_array_equal(seen[:, 2], velocity[:, 0])


def test_object_below_the_uav_is_at_exactly_90_degrees_and_not_above_the_horizon():
    above = np.array([[12.0, 0.0, 0.0], [20.0, 0.0, 81.0], [5.0, 0.0, 90.0], [12.0, 0.0, 80.0]])
    seen = polar_state(above, np.zeros((4, 3)), UAV)
    np.testing.assert_array_equal(seen[:, 0], [np.pi / 2, 0.0, np.pi, 0.0])
    np.testing.assert_array_equal(seen[:, 1], [80.0, 8.0, 7.0, 0.0])


def test_absent_objects_are_nan_and_leave_the_others():
    position = np.array([[40.0, 0.0, 0.0], [np.nan] * 3])
    seen = polar_state(position, position, UAV)
    assert np.isnan(seen[1]).all()
    np.testing.assert_array_equal(seen[0], polar_state(position[0], position[0], UAV))
    assert polar_state(np.zeros((3, 0, 3)), np.zeros((3, 0, 3)), UAV).shape == (3, 0, 3)


def test_offset_is_the_inverse_of_the_view():
    there = np.random.default_rng(22).uniform([-150, 0, 0], [150, 0, 30], (4, 5, 3))
    seen = polar_state(there, np.zeros((4, 5, 3)), UAV)
    expected = (there - UAV.position)[..., [0, 2]]
    np.testing.assert_allclose(offset(seen), expected, rtol=1e-13, atol=1e-12)


def test_covariance_of_the_offset_is_that_of_its_complex_step():
    state = states(3, 2)
    root = np.random.default_rng(23).normal(size=(3, 2, 3, 3))
    cov = root @ np.swapaxes(root, -1, -2)
    columns = [offset(state + 1e-30j * unit).imag / 1e-30 for unit in np.eye(3)]
    jacobian = np.stack(columns, axis=-1)
    expected = jacobian @ cov @ np.swapaxes(jacobian, -1, -2)
    np.testing.assert_allclose(offset_cov(state, cov), expected, rtol=1e-11, atol=1e-9)


def displacement_cov(theta, d, stds):
    """Covariance of an object's displacement (x, z) by noise on angle and distance."""
    turn = np.array(
        [[-d * math.sin(theta), math.cos(theta)], [-d * math.cos(theta), -math.sin(theta)]]
    )
    return turn @ np.diag(np.square(stds)) @ turn.T


def coefficients(state, stds):
    """Displacement along the road per radian and per metre: it is linear in the noise."""
    return np.stack([along_road(state, unit, stds) for unit in np.eye(2)], axis=-1)


def test_displacement_has_the_conditional_variance_given_that_the_height_stays():
    state = states(40)
    variance = along_road_variance(state, STDS)
    for (theta, d, _), actual in zip(state, variance, strict=True):
        cov = displacement_cov(theta, d, STDS)
        schur = 1 / np.linalg.inv(cov)[0, 0]
        assert actual == pytest.approx(schur, rel=1e-10)
        assert actual <= cov[0, 0]
    drawn = np.sum((coefficients(state, STDS) * STDS) ** 2, axis=-1)
    np.testing.assert_allclose(drawn, variance, rtol=1e-13)


def test_displacement_is_uncorrelated_with_the_height_that_is_left_out():
    state = states(40)
    theta, d = state[:, 0], state[:, 1]
    height = np.stack([-d * np.cos(theta), -np.sin(theta)], axis=-1)
    cross = np.sum(coefficients(state, STDS) * height * np.square(STDS), axis=-1)
    scale = np.sqrt(along_road_variance(state, STDS) * np.sum((height * STDS) ** 2, axis=-1))
    np.testing.assert_allclose(cross / scale, 0.0, atol=1e-12)


def test_noise_that_keeps_the_height_is_the_displacement_itself():
    # to first order a step s along the road turns the line of sight by -s sin(theta) / d and
    # stretches it by s cos(theta): nature must move the object by s, whatever the deviations
    state, s = states(40), np.linspace(-2.0, 2.0, 40)
    noise = np.stack([-s * np.sin(state[:, 0]) / state[:, 1], s * np.cos(state[:, 0])], axis=-1)
    for stds in (STDS, (0.001, 5.0)):
        np.testing.assert_allclose(along_road(state, noise, stds), s, rtol=1e-12, atol=1e-12)


def test_displacement_is_linear_in_the_noise_and_batched():
    state, noise = states(3, 4), np.random.default_rng(24).normal(size=(3, 4, 2))
    expected = np.sum(coefficients(state, STDS) * noise, axis=-1)
    np.testing.assert_allclose(along_road(state, noise, STDS), expected, rtol=1e-12, atol=1e-14)


def test_moved_object_stays_on_the_ground():
    # in height nothing moves: d sin(theta) of the displaced object is the UAV's height again
    position = np.zeros((500, 3))
    position[:, 0] = np.linspace(-150.0, 150.0, 500)
    before = polar_state(position, np.zeros((500, 3)), UAV)
    noise = np.random.default_rng(25).normal(size=(500, 2)) * STDS
    shift = along_road(before, noise, STDS)
    after = polar_state(position + shift[:, None] * [1.0, 0.0, 0.0], np.zeros((500, 3)), UAV)
    np.testing.assert_allclose(after[:, 1] * np.sin(after[:, 0]), 80.0, rtol=1e-14)
    moved = after[:, 1] * np.cos(after[:, 0]) - before[:, 1] * np.cos(before[:, 0])
    np.testing.assert_allclose(moved, shift, atol=1e-11)


@pytest.mark.parametrize("stds", [(0.0, 0.7), (0.02, 0.0), (0.0, 0.0)])
def test_noise_on_one_component_alone_would_lift_the_object_and_moves_nothing(stds):
    state = states(40)
    noise = np.random.default_rng(26).normal(size=(40, 2)) * stds
    np.testing.assert_array_equal(along_road_variance(state, stds), 0.0)
    np.testing.assert_array_equal(along_road(state, noise, stds), 0.0)


@pytest.mark.parametrize(
    ("theta", "expected"),
    [(np.pi / 2, 100.0 * 0.02), (1e-9, 0.7), (np.pi - 1e-9, 0.7)],
)
def test_straight_below_the_angle_moves_an_object_and_far_away_the_distance(theta, expected):
    state = np.array([theta, 100.0, 0.0])
    assert np.sqrt(along_road_variance(state, STDS)) == pytest.approx(expected, rel=1e-12)


def test_displacement_of_absent_objects_is_nan():
    state = np.array([[1.0, 50.0, 0.0], [np.nan] * 3])
    noise = np.ones((2, 2))
    for stds in (STDS, (0.0, 0.0)):
        moved = along_road(state, noise, stds), along_road_variance(state, stds)
        alone = along_road(state[0], noise[0], stds), along_road_variance(state[0], stds)
        for both, one in zip(moved, alone, strict=True):
            assert both[0] == one
            assert np.isnan(both[1])
