"""Motion between samples."""

import dataclasses

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from echobeam.traces.breaks import whole
from echobeam.traces.collect import OffRoad, RoadSamples, Window, collect
from echobeam.traces.motion import GAP_PERIODS, sight
from echobeam.traces.road import Road
from echobeam.traces.sample import Sample

UNEVEN = np.array([0.0, 0.7, 1.0, 2.6, 3.1, 5.0, 5.4, 7.0])


def road_samples(*tracks):
    """Samples of vehicles on the road, each given as (time, along) or (time, along, speed)."""
    parts = [(*track, np.full(len(track[0]), np.nan))[:3] for track in tracks]
    time, along, speed = (
        np.concatenate([np.asarray(part[i], dtype=float) for part in parts]) for i in range(3)
    )
    vehicle = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
    names = tuple(str(i) for i in range(len(parts)))
    zeros = np.zeros(time.size)
    return RoadSamples(names, vehicle, zeros.astype(int), time, along, zeros, speed)


def at(clock, *tracks):
    return sight(road_samples(*tracks), np.asarray(clock, dtype=float))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("given", [True, False], ids=["speeds given", "speeds absent"])
@pytest.mark.parametrize(("v", "a"), [(14.0, 0.0), (3.0, 1.5), (20.0, -2.0), (0.0, 2.0)])
def test_constant_velocity_and_acceleration_come_out_exactly(sign, given, v, a):
    def position(t):
        return sign * (v * t + a * t**2 / 2) + 30

    clock = np.linspace(0, 7, 501)
    speed = (np.abs(v + a * UNEVEN),) if given else ()
    seen = at(clock, (UNEVEN, position(UNEVEN), *speed))
    np.testing.assert_array_equal(seen.slot, np.arange(501))
    np.testing.assert_allclose(seen.position, position(clock), atol=1e-12)
    np.testing.assert_allclose(seen.velocity, sign * (v + a * clock), atol=1e-12)


def test_given_speeds_make_the_hermite_cubic_that_scipy_makes():
    t = np.array([0.0, 1.0, 2.5, 3.0])
    s = np.array([0.0, 10.0, 28.0, 33.0])
    v = np.array([9.0, 11.0, 10.5, 8.0])
    clock = np.linspace(0, 3, 200)
    seen, spline = at(clock, (t, s, v)), CubicHermiteSpline(t, s, v)
    np.testing.assert_allclose(seen.position, spline(clock), atol=1e-12)
    np.testing.assert_allclose(seen.velocity, spline(clock, 1), atol=1e-12)


def test_absent_speeds_are_the_slopes_of_parabolas_through_neighbours():
    t, s = UNEVEN[:5], np.array([0.0, 6.0, 9.0, 26.0, 30.0])
    seen = at(t, (t, s))
    for node, near in enumerate([(0, 3), (0, 3), (1, 4), (2, 5), (2, 5)]):
        parabola = np.polynomial.Polynomial.fit(t[slice(*near)], s[slice(*near)], 2)
        assert seen.velocity[node] == pytest.approx(parabola.deriv()(t[node]), rel=1e-9)


def test_some_speeds_may_be_absent():
    t = np.arange(4.0)
    speed = [2.0, np.nan, 2.0, np.nan]
    seen = at(np.linspace(0, 3, 61), (t, 2 * t, speed))
    np.testing.assert_allclose(seen.velocity, 2.0, atol=1e-12)


@pytest.mark.parametrize("given", [True, False])
def test_velocity_is_the_derivative_and_has_no_steps(given):
    rng = np.random.default_rng(11)
    t = np.cumsum(rng.uniform(0.3, 1.5, 40))
    s = np.cumsum(rng.uniform(0.0, 20.0, 40))
    speed = (rng.uniform(0.0, 20.0, 40),) if given else ()
    step = 1e-5
    beside = np.concatenate([t[1:-1] - step, t[1:-1], t[1:-1] + step])
    clock = np.unique(np.concatenate([beside, np.linspace(t[0], t[-1], 301)]))
    seen = at(clock, (t, s, *speed))
    slope = np.diff(seen.position) / np.diff(clock)
    middle = (seen.velocity[1:] + seen.velocity[:-1]) / 2
    close = np.diff(clock) < 2 * step
    assert close.sum() >= 2 * 38
    # Both sides of a sample: the accelerations there are at most a few hundred m/s^2.
    np.testing.assert_allclose(slope[close], middle[close], atol=1e-3)
    assert np.abs(np.diff(seen.velocity)[close]).max() < 1e3 * step


@pytest.mark.parametrize("given", [True, False])
def test_vehicle_that_stops_never_rolls_back_or_ahead(given):
    t = np.arange(0, 6.5, 0.5)
    s = np.array([0, 5, 9, 11, 11.1, 11.1, 11.1, 11.1, 11.1, 11.8, 14, 18, 23])
    speed = [10, 9, 7, 5, 3, 0, 0, 0, 0.5, 3, 6, 9, 10]
    clock = np.linspace(0, 6, 2401)
    seen = at(clock, (t, s, *([speed] if given else [])))
    assert seen.velocity.min() >= 0
    assert np.diff(seen.position).min() >= -1e-12
    stands = (clock >= 2.0) & (clock <= 4.0)
    np.testing.assert_allclose(seen.position[stands], 11.1, atol=1e-12)
    np.testing.assert_allclose(seen.velocity[stands], 0.0, atol=1e-12)


def test_vehicle_that_turns_round_does_so_at_a_sample():
    seen = at(np.linspace(0, 4, 401), (np.arange(5.0), [0, 8, 10, 7, 0]))
    assert seen.position.max() == 10.0
    assert seen.slot[seen.position.argmax()] == 200
    assert seen.velocity[200] == 0.0


@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_direction_comes_from_the_positions_whatever_the_sign_of_the_speed(speed):
    t = np.arange(3.0)
    seen = at([0.5, 1.5], (t, -5 * t, np.full(3, speed)))
    np.testing.assert_allclose(seen.velocity, -5.0)


def test_speed_is_projected_on_the_road():
    t, angle = np.arange(4.0), 0.3
    track = road_samples((t, 10 * np.cos(angle) * t, np.full(4, 10.0)))
    slanted = dataclasses.replace(track, across=10 * np.sin(angle) * t)
    seen = sight(slanted, np.linspace(0, 3, 31))
    np.testing.assert_allclose(seen.velocity, 10 * np.cos(angle), atol=1e-12)


def test_change_of_lane_in_one_step_does_not_slow_the_vehicle():
    t = np.arange(8.0)
    track = road_samples((t, 3 * t, np.full(8, 3.0)))
    jumps = dataclasses.replace(track, across=np.where(t < 3.5, -4.8, -1.6))
    seen = sight(jumps, np.linspace(0, 7, 71))
    np.testing.assert_allclose(seen.velocity, 3.0, atol=1e-12)


def test_nothing_is_extrapolated_outside_a_vehicles_own_time():
    seen = at(np.arange(0, 10, 0.25), ([2, 3, 4], [0, 10, 20]), ([3.1, 3.6], [5, 9]))
    times = np.arange(0, 10, 0.25)[seen.slot]
    assert (times[seen.vehicle == 0].min(), times[seen.vehicle == 0].max()) == (2, 4)
    assert times[seen.vehicle == 1].tolist() == [3.25, 3.5]


def test_slot_at_the_first_or_last_sample_but_for_rounding_is_seen():
    assert 35 * 0.01 > 0.35
    seen = at(0.01 * np.arange(40), ([0.0, 0.2, 0.35], [0, 1, 2]))
    assert seen.slot.tolist() == list(range(36))
    assert seen.position[-1] == 2.0
    assert 0.3 < 0.1 + 0.2
    early = at([0.3], ([0.1 + 0.2, 0.5], [7, 9]))
    assert early.position.tolist() == [7.0]


@pytest.mark.parametrize(("gap", "there"), [(GAP_PERIODS, True), (GAP_PERIODS + 0.1, False)])
def test_long_gap_means_that_the_vehicle_was_gone(gap, there):
    back = 2 + gap
    seen = at(np.arange(0, 9, 0.5), ([0, 1, 2, back, back + 1], [0, 5, 10, 40, 45]))
    clock = np.arange(0, 9, 0.5)[seen.slot]
    inside = (clock > 2) & (clock < back)
    assert inside.any() == there
    assert (clock <= 2).sum() == 5
    assert (clock >= back).sum() == (3 if there else 2)


def test_gap_beside_a_single_ordinary_step_is_a_gap():
    seen = at(np.arange(25.0), ([0, 1, 20], [0, 5, 100]))
    assert seen.slot.tolist() == [0, 1]


def test_speeds_on_both_sides_of_a_gap_are_not_mixed():
    # 5 m/s before, 1 m/s after: a parabola across the gap would show in the edge speeds.
    seen = at([2.0, 15.0, 30.0], ([0, 1, 2, 30, 31, 32], [0, 5, 10, 100, 101, 102]))
    np.testing.assert_allclose(seen.velocity, [5.0, 1.0], atol=1e-12)


def test_single_samples_and_empty_traces_are_seen_nowhere():
    seen = at([0.0, 1.0], ([0.5], [3.0]), ([0.0, 1.0], [1.0, 2.0]))
    assert seen.vehicle.tolist() == [1, 1]
    for tracks in ([([0.5], [3.0])], [([0.5], [3.0]), ([0.7], [3.0])]):
        assert at([0.0, 1.0], *tracks).slot.size == 0


@pytest.mark.parametrize(("time", "along"), [(0.0, 1e4), (0.0, -1e4), (1e4, 0.0), (-1e4, 0.0)])
def test_vehicle_far_from_the_window_on_any_side_is_not_kept(time, along):
    far = [Sample(time + t, "a", along + t, 0.0, 1.0, 0) for t in range(5)]
    samples = collect(whole(far), Road(0.0, 0.0, 0.0), Window(0.0, 4.0, -100.0, 100.0), OffRoad())
    assert samples.names == ()
    assert sight(samples, np.arange(5.0)).slot.size == 0


def test_vehicle_that_crosses_the_window_in_one_step_is_kept():
    jump = [Sample(2.0 * t, "a", 500.0 * t - 250, 0.0, 250.0, 0) for t in range(2)]
    samples = collect(whole(jump), Road(0.0, 0.0, 0.0), Window(0.9, 1.1, -1.0, 1.0), OffRoad())
    seen = sight(samples, np.array([1.0]))
    assert (seen.position.item(), seen.velocity.item()) == (0.0, 250.0)


@pytest.mark.parametrize("speed", [np.nan, 11.0], ids=["speeds absent", "speeds given"])
def test_samples_outside_the_window_are_forgotten_and_not_missed(speed):
    rng = np.random.default_rng(2)
    time = np.arange(0, 100, 0.5)
    stream = sorted(
        Sample(t, f"v{i}", float(x), float(rng.normal(0, 2)), speed, 0)
        for i in range(30)
        for t, x in zip(
            time, rng.uniform(-800, 0) + np.cumsum(rng.uniform(0, 12, time.size)), strict=True
        )
    )
    road = Road(0.0, 0.0, 0.0)
    everything = collect(whole(stream), road, Window(-np.inf, np.inf, -np.inf, np.inf), OffRoad())
    some = collect(whole(stream), road, Window(40.0, 50.0, -100.0, 100.0), OffRoad())
    assert everything.time.size == 30 * time.size
    assert 0 < some.time.size < everything.time.size / 8
    clock = np.linspace(40, 50, 401)
    seen = {}
    for samples in (everything, some):
        found = sight(samples, clock)
        near = np.abs(found.position) <= 100
        names = np.array(samples.names)[found.vehicle[near]]
        seen[samples.time.size] = (
            names.tolist(),
            found.slot[near].tolist(),
            found.position[near].tolist(),
            found.velocity[near].tolist(),
        )
    one, other = seen.values()
    assert one == other
    assert len(one[0]) > 1000


def test_way_off_the_road_splits_the_presence():
    ways = [(0, 0, 0), (1, 10, 0), (2, 20, 0), (3, 25, 50), (4, 30, 0), (5, 40, 0)]
    stream = [Sample(float(t), "a", float(x), float(y), np.nan, 0) for t, x, y in ways]
    road = Road(0.0, 0.0, 0.0, half_width=30.0)
    samples = collect(whole(stream), road, Window(-np.inf, np.inf, -np.inf, np.inf), OffRoad())
    clock = np.arange(0, 5.5, 0.5)
    seen = clock[sight(samples, clock).slot]
    assert seen.tolist() == [0, 0.5, 1, 1.5, 2, 4, 4.5, 5]
