"""Motion against positions in the plane, symbolic geometry and closed forms of the flight."""

from __future__ import annotations

import math
import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
import sympy

from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.physics.geometry import polar_state
from echobeam.physics.measurement import closing_speed
from echobeam.physics.motion import MIN_HEIGHT, Flight, initial_distance, move_along_road

from ..forms import uav_path

DOWN = -np.pi / 2


def move_object(theta, d, v, acceleration, speed, heading, dt):
    """Angle, distance and velocity one slot later, in ground coordinates between.

    The UAV starts at the origin and the objects below it, so that one flight serves objects of
    any angle and distance.
    """
    theta, d, v, acceleration = np.broadcast_arrays(*map(np.asarray, (theta, d, v, acceleration)))
    uav = Flight(0.0, speed, heading, dt, floor=-np.inf).at(1)
    x, faster = move_along_road(d * exact_cosine(theta), v, acceleration, dt)
    across = np.zeros(x.shape)
    position = np.stack([x, across, -d * exact_sine(theta)], axis=-1)
    seen = polar_state(position, np.stack([faster, across, across], axis=-1), uav)
    return tuple(np.moveaxis(seen, -1, 0))


def test_sinking_flight_levels_off_exactly_at_the_floor():
    path = uav_path(10.0, 15.0, DOWN, 0.25, 6, floor=2.0)
    np.testing.assert_allclose(path.height, [10.0, 6.25, 2.5, 2.0, 2.0, 2.0], rtol=1e-15)
    np.testing.assert_allclose(path.speed, [15.0, 15.0, 2.0, 0.0, 0.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(path.heading[:3], DOWN)
    np.testing.assert_array_equal(path.x, 0.0)


def test_slanted_flight_keeps_its_horizontal_velocity_at_the_floor():
    path = uav_path(10.0, 10.0, math.radians(-150), 0.5, 8)
    east, up = path.speed * np.cos(path.heading), path.speed * np.sin(path.heading)
    np.testing.assert_allclose(east, -10 * math.cos(math.radians(30)), rtol=1e-12)
    np.testing.assert_allclose(np.diff(path.x), east[:-1] * 0.5, rtol=1e-12)
    np.testing.assert_allclose(np.diff(path.height), up[:-1] * 0.5, atol=1e-12)
    np.testing.assert_array_equal(path.height[4:], MIN_HEIGHT)
    np.testing.assert_array_equal(path.heading[4:], np.pi)  # level, backwards


def test_undisturbed_flight_has_the_given_velocity_to_the_bit():
    path = uav_path(100.0, 15.0, DOWN, 0.01, 50)
    np.testing.assert_array_equal(path.speed, 15.0)
    np.testing.assert_array_equal(path.heading, DOWN)
    assert path.height[-1] == pytest.approx(100 - 49 * 0.15, rel=1e-15)


@pytest.mark.parametrize("heading", [0.0, np.pi, np.pi / 2, 0.3])
def test_level_and_climbing_flights_never_meet_the_floor(heading):
    path = uav_path(60.0, 15.0, heading, 0.05, 40)
    np.testing.assert_allclose(path.speed, 15.0, rtol=1e-15)  # of a velocity: one rounding
    np.testing.assert_allclose(path.heading, heading, rtol=1e-15)
    velocity = np.array([Flight(60.0, 15.0, heading, 0.05).at(n).velocity for n in range(40)])
    np.testing.assert_array_equal(velocity, velocity[0] * np.ones((40, 1)))
    np.testing.assert_allclose(
        path.height, 60 + 15 * math.sin(heading) * 0.05 * np.arange(40), rtol=1e-14
    )
    np.testing.assert_allclose(
        path.x, 15 * math.cos(heading) * 0.05 * np.arange(40), rtol=1e-13, atol=1e-13
    )


@pytest.mark.parametrize("height", [0.5, 1.0])
def test_flight_that_starts_at_or_below_the_floor_sinks_no_further(height):
    path = uav_path(height, 10.0, math.radians(-30), 0.1, 5)
    np.testing.assert_array_equal(path.height, height)
    np.testing.assert_array_equal(path.heading, 0.0)
    np.testing.assert_allclose(path.speed, 10 * math.cos(math.radians(30)), rtol=1e-15)


def test_flight_is_frozen():
    flight = Flight(100.0, 15.0, DOWN, 0.01)
    with pytest.raises(FrozenInstanceError):
        flight.height = 5.0
    assert pickle.loads(pickle.dumps(flight)) == flight


def test_flight_is_in_the_roads_vertical_plane_and_starts_above_the_origin():
    flight = Flight(80.0, 12.0, math.radians(-20), 0.05)
    start = flight.at(0)
    np.testing.assert_array_equal(start.position, [0.0, 0.0, 80.0])
    turned = math.radians(-20)
    expected = [12 * math.cos(turned), 0.0, 12 * math.sin(turned)]
    np.testing.assert_allclose(start.velocity, expected, rtol=1e-15)
    for slot in (1, 7, 300):
        later = flight.at(slot)
        assert later.position[1] == later.velocity[1] == 0.0
        along = 12 * math.cos(turned) * 0.05 * slot
        below = max(80 + 12 * math.sin(turned) * 0.05 * slot, MIN_HEIGHT)
        np.testing.assert_allclose(later.position, [along, 0.0, below], rtol=1e-14)


@pytest.mark.parametrize("heading", [-np.pi / 2, -2.0, -0.4, 0.0, 0.4, np.pi / 2])
def test_velocity_leads_from_each_slot_exactly_to_the_next(heading):
    flight = Flight(3.0, 9.0, heading, 0.1, floor=1.5)
    for slot in range(12):
        here, there = flight.at(slot), flight.at(slot + 1)
        reached = here.position + 0.1 * here.velocity
        np.testing.assert_allclose(reached, there.position, rtol=1e-14, atol=1e-14)


def test_a_slot_far_ahead_needs_no_slots_before_it():
    far = Flight(100.0, 15.0, math.radians(-60), 0.01).at(10**7)
    np.testing.assert_allclose(far.position, [7.5e5, 0.0, MIN_HEIGHT], rtol=1e-13)
    np.testing.assert_allclose(far.velocity, [7.5, 0.0, 0.0], rtol=1e-15)
    assert far.heading == 0.0


def test_object_moves_by_constant_acceleration_along_the_road():
    x, v = np.array([3.0, -40.0, np.nan]), np.array([[10.0, -5.0, np.nan], [0.0, 30.0, 1.0]])
    acceleration = np.array([-5.0, 2.0, 0.0])
    moved, faster = move_along_road(x, v, acceleration, 0.2)
    np.testing.assert_allclose(moved[:, :2], [[4.9, -40.96], [2.9, -33.96]], rtol=1e-14)
    np.testing.assert_allclose(faster[:, :2], [[9.0, -4.6], [-1.0, 30.4]], rtol=1e-14)
    assert np.isnan(moved[:, 2]).all()
    twice = move_along_road(*move_along_road(x, v, acceleration, 0.1), acceleration, 0.1)
    np.testing.assert_allclose(twice, (moved, faster), rtol=1e-14)


def test_motion_satisfies_the_papers_distance_equation():
    # Eq. (28), with I and II of Eqs. (26) and (27) read as v DT sin and not sin(v DT)
    theta, d, v, a, vu, tu, dt = 1.1, 110.0, 25.0, -4.0, 12.0, -0.8, 0.5
    _, moved, _ = move_object(theta, d, v, a, vu, tu, dt)
    one = vu * math.sin(tu) * dt
    two = v * dt + a * dt**2 / 2 - vu * math.cos(tu) * dt
    h = d * math.sin(theta)
    squared = d**2 + one**2 + two**2 + 2 * one * h + 2 * two * d * math.cos(theta)
    assert moved**2 == pytest.approx(squared, rel=1e-14)


@pytest.mark.slow
def test_motion_is_the_exact_rotation_of_the_ledgers_closed_form():
    # theta' = theta - atan2(q, d + p), d' = hypot(d + p, q); SymPy shows that it is the geometry
    theta, d, one, two = sympy.symbols("theta d I II", real=True)
    p = one * sympy.sin(theta) + two * sympy.cos(theta)
    q = two * sympy.sin(theta) - one * sympy.cos(theta)
    turned = (sympy.exp(sympy.I * theta) * (d + p - sympy.I * q)).rewrite(sympy.cos)
    place = (d * sympy.cos(theta) + two) + sympy.I * (d * sympy.sin(theta) + one)
    assert sympy.simplify(sympy.expand(turned - place)) == 0

    rng = np.random.default_rng(13)
    angle, far = rng.uniform(0.1, 3.0, 300), rng.uniform(30, 200, 300)
    v, dt, vu, tu = rng.normal(0, 30, 300), 0.05, 15.0, -1.3
    rise, advance = vu * math.sin(tu) * dt, (v - vu * math.cos(tu)) * dt
    along = far + rise * np.sin(angle) + advance * np.cos(angle)
    across = advance * np.sin(angle) - rise * np.cos(angle)
    moved = move_object(angle, far, v, 0.0, vu, tu, dt)
    np.testing.assert_allclose(moved[0], angle - np.arctan2(across, along), rtol=1e-14)
    np.testing.assert_allclose(moved[1], np.hypot(along, across), rtol=1e-14)
    np.testing.assert_array_equal(moved[2], v)


def test_distance_shrinks_at_the_closing_speed():
    theta, d, v, step = 0.9, 120.0, -28.0, 1e-4
    forward = move_object(theta, d, v, 0.0, 15.0, -1.0, step)[1]
    back = move_object(theta, d, v, 0.0, 15.0, -1.0, -step)[1]
    rate = float((back - forward) / (2 * step))
    assert rate == pytest.approx(float(closing_speed(theta, v, 15.0, -1.0)), rel=1e-8)


def test_object_straight_below_is_at_exactly_90_degrees():
    theta, d, _ = move_object(np.pi / 2, 100.0, 0.0, 0.0, 15.0, DOWN, 0.01)
    assert theta == np.pi / 2
    assert d == pytest.approx(99.85, rel=1e-15)
    arriving = move_object(math.atan2(100.0, 3.0), math.hypot(100.0, 3.0), -30.0, 0.0, 0, 0, 0.1)
    assert arriving[0] == pytest.approx(np.pi / 2, abs=1e-15)
    passed = move_object(arriving[0], arriving[1], -30.0, 0.0, 0.0, 0.0, 0.1)
    assert passed[0] == pytest.approx(math.atan2(100.0, -3.0), rel=1e-14)


def test_braking_object_stops_and_reverses():
    theta, d, v = np.array([0.5]), np.array([100.0]), np.array([30.0])
    start = d * np.cos(theta)
    for _ in range(120):
        theta, d, v = move_object(theta, d, v, -5.0, 0.0, 0.0, 0.1)
    np.testing.assert_allclose(d * np.cos(theta), start, atol=1e-10)  # there and back in 12 s
    np.testing.assert_allclose(v, -30.0, rtol=1e-12)


def test_object_on_the_road_stays_on_it_while_the_uav_sinks_to_the_floor():
    dt, n = 0.1, 120
    path = uav_path(100.0, 15.0, math.radians(-80), dt, n)
    theta = np.radians([60.0, 135.0])
    d, v = initial_distance(theta, 100.0), np.array([30.0, -3.0])
    flight = Flight(100.0, 15.0, math.radians(-80), dt)
    road = d * np.cos(theta)
    for slot in range(n - 1):
        road, v = move_along_road(road, v, np.array([-5.0, 1.0]), dt)
        ground = np.stack([road, 0 * road, 0 * road], axis=-1)
        theta, d, _ = polar_state(ground, ground, flight.at(slot + 1)).T
        np.testing.assert_allclose(d * np.sin(theta), path.height[slot + 1], rtol=1e-11)
    t = (n - 1) * dt
    x = 100 / np.tan(np.radians([60.0, 135.0])) + np.array([30.0, -3.0]) * t
    x = x + np.array([-5.0, 1.0]) * t**2 / 2 - path.x[-1]
    np.testing.assert_allclose(d * np.cos(theta), x, rtol=1e-11)
    assert path.height[-1] == MIN_HEIGHT


def test_uav_on_the_ground_sees_objects_ahead_and_behind_at_0_and_180_degrees():
    theta, d, _ = move_object(np.array([0.1, np.pi - 0.1]), 10.0, 0.0, 0.0, 10.0, DOWN, 1.0)
    np.testing.assert_array_equal(theta, [0.0, np.pi])
    np.testing.assert_allclose(d, 10 * math.cos(0.1), rtol=1e-15)
    again, _, _ = move_object(theta, d, 0.0, 0.0, 10.0, DOWN, 1.0)
    np.testing.assert_array_equal(again, [0.0, np.pi])
    assert move_object(0.0, 10.0, -10.0, 0.0, 0.0, 0.0, 1.0)[:2] == (0.0, 0.0)  # d = 0


def test_absent_objects_stay_nan_and_leave_the_others():
    theta, d, v = np.array([1.0, np.nan]), np.array([50.0, np.nan]), np.array([3.0, np.nan])
    moved = move_object(theta, d, v, np.array([1.0, np.nan]), 15.0, -1.0, 0.01)
    alone = move_object(1.0, 50.0, 3.0, 1.0, 15.0, -1.0, 0.01)
    for both, one in zip(moved, alone, strict=True):
        assert np.isnan(both[1])
        assert both[0] == one
    empty = np.zeros((2, 0))
    assert move_object(empty, empty, empty, 0.0, 15.0, -1.0, 0.01)[0].shape == (2, 0)


def test_initial_distance_is_the_hypotenuse():
    theta = np.radians([60.0, 75.0, 135.0])
    d = initial_distance(theta, 100.0)
    np.testing.assert_allclose(d, [115.4700538, 103.5276180, 141.4213562], rtol=1e-9)
    np.testing.assert_allclose(np.hypot(100 / np.tan(theta), 100.0), d, rtol=1e-14)
    np.testing.assert_array_equal(initial_distance([0.0, np.pi], 100.0), np.inf)
    assert np.isnan(initial_distance(0.0, 0.0))
