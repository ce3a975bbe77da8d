"""Laws of the physics room that hold for every transmission, geometry and mask."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.physics import link
from echobeam.physics.array import LinearArray
from echobeam.physics.bounds import effective_variance
from echobeam.physics.geometry import along_road, along_road_variance
from echobeam.physics.link import rate
from echobeam.physics.measurement import measure, velocity_from_doppler
from echobeam.physics.motion import initial_distance
from echobeam.physics.transmission import choose, directional, omni, pilot, radiated_power
from echobeam.values import NOBODY, Transmission

from ..forms import (
    echo_snr,
    illumination,
    measurement_variance,
    move_object,
    sinr,
    square_aperture,
    stream_gains,
    transmit_aperture,
    uav_path,
)

RADAR = {"rcs": 120 + 120j, "gain": 10.0, "noise": 1.0}
BOUND = {"n_rx": 5, "bandwidth": 8e7, "pulse_length": 1e-5}

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(0, 5)
antennas = st.integers(1, 9)
angles = st.floats(0.05, np.pi - 0.05)
axes = st.sampled_from(["vertical", "horizontal"])


def scene(seed, trials, k, n):
    """Random streams of every kind and random states, ``(trials, k)``."""
    rng = np.random.default_rng(seed)
    beams = rng.normal(size=(trials, k, n)) + 1j * rng.normal(size=(trials, k, n))
    sent = Transmission(beams, rng.random((trials, k, n)), rng.random((trials, n)))
    theta = rng.uniform(0.05, np.pi - 0.05, (trials, k))
    return sent, theta, rng.uniform(1.0, 200.0, (trials, k))


def cut(sent, index):
    return Transmission(sent.beams[index], sent.antenna_power[index], sent.probing[index])


def everything(sent, theta, d, axis):
    """All that the room says of a transmission, in one array of trailing shape (K, 9)."""
    snr = echo_snr(sent, theta, d, axis=axis, **RADAR)
    columns = [snr[..., None], sinr(sent, theta, d, noise=1.0, axis=axis)[..., None]]
    for crb in ("paper", "exact"):
        columns.append(measurement_variance(sent, theta, snr, crb=crb, axis=axis, **BOUND))
    columns.append(illumination(sent, theta, axis=axis)[..., None])
    return np.concatenate(columns, axis=-1)


@given(seeds, sizes, antennas, axes)
@pytest.mark.slow
def test_a_trial_has_the_same_bits_alone_and_in_a_batch(seed, k, n, axis):
    sent, theta, d = scene(seed, 7, k, n)
    whole = everything(sent, theta, d, axis)
    for part in (slice(0, 1), slice(2, 7), 3):
        alone = everything(cut(sent, part), theta[part], d[part], axis)
        np.testing.assert_array_equal(alone, whole[part])


@given(seeds, st.integers(1, 5), antennas, axes, st.data())
@pytest.mark.slow
def test_absent_objects_are_as_good_as_never_there(seed, k, n, axis, data):
    sent, theta, d = scene(seed, 1, k, n)
    there = np.array(data.draw(st.lists(st.booleans(), min_size=k, max_size=k)))
    there[data.draw(st.integers(0, k - 1))] = True
    mask = there[:, None]
    masked = Transmission(sent.beams * mask, sent.antenna_power * mask, sent.probing)
    kept = Transmission(sent.beams[:, there], sent.antenna_power[:, there], sent.probing)
    full = everything(masked, np.where(there, theta, np.nan), np.where(there, d, np.nan), axis)
    assert np.isnan(full[:, ~there]).all()
    remaining = everything(kept, theta[:, there], d[:, there], axis)
    np.testing.assert_allclose(full[:, there], remaining, rtol=1e-9)


@given(seeds, st.integers(1, 4), antennas, axes)
def test_gains_are_quadratic_forms_of_positive_semidefinite_covariances(seed, k, n, axis):
    sent, theta, _ = scene(seed, 1, k, n)
    gains = stream_gains(cut(sent, 0), theta[0], axis=axis)
    a = LinearArray(n, axis=axis).steering(theta[0])
    for i in range(k):
        w = sent.beams[0, i]
        covariance = np.outer(w, w.conj()) + np.diag(sent.antenna_power[0, i])
        for j in range(k):
            expected = np.real(a[j].conj() @ covariance @ a[j])
            np.testing.assert_allclose(gains[j, i], expected, rtol=1e-10, atol=1e-12)


@given(seeds, st.integers(1, 4), antennas)
def test_the_vertical_array_cannot_tell_an_object_from_its_mirror_image(seed, k, n):
    sent, theta, d = scene(seed, 2, k, n)
    ahead, behind = (everything(sent, x, d, "vertical") for x in (theta, np.pi - theta))
    np.testing.assert_allclose(ahead, behind, rtol=1e-7)


@given(seeds, antennas, angles, st.floats(1.0, 1e8))
def test_sinrs_of_objects_of_one_sine_multiply_to_at_most_one(seed, n, theta, power):
    sent, _, d = scene(seed, 1, 2, n)
    beams = directional(np.sqrt(power) * sent.beams)
    pair = np.array([[theta, theta]])
    assert sinr(beams, pair, d, noise=1.0).prod() <= 1.0 + 1e-9


@given(st.lists(st.booleans(), max_size=8), antennas, st.floats(1e-3, 1e6), angles)
def test_omni_slots_radiate_the_budget_and_light_all_directions(present, n, power, theta):
    present = np.array(present, dtype=bool)
    sent = omni(present, power, n)
    np.testing.assert_allclose(radiated_power(sent), power, rtol=1e-12)
    everywhere = illumination(sent, np.full((1, present.size), theta))
    np.testing.assert_allclose(everywhere, power, rtol=1e-12)
    if present.any():  # Eq. (7) for those who are present
        gains = stream_gains(sent, np.where(present, theta, np.nan))[present][:, present]
        np.testing.assert_allclose(gains, power / present.sum(), rtol=1e-12)


@given(seeds, st.integers(1, 4), antennas, st.floats(1e-3, 1e3))
def test_power_and_noise_matter_only_by_their_ratio(seed, k, n, factor):
    sent, theta, d = scene(seed, 1, k, n)
    louder = Transmission(
        sent.beams * np.sqrt(factor), sent.antenna_power * factor, sent.probing * factor
    )
    reference = sinr(sent, theta, d, noise=0.3)
    np.testing.assert_allclose(sinr(louder, theta, d, noise=0.3 * factor), reference, rtol=1e-12)
    np.testing.assert_allclose(
        transmit_aperture(louder, theta), transmit_aperture(sent, theta), rtol=1e-7, atol=1e-12
    )
    assert np.all(rate(reference) >= 0.0)


@given(seeds, st.integers(1, 4), sizes, antennas, axes, st.data())
@pytest.mark.slow
def test_order_and_division_of_streams_do_not_matter(seed, k, c, n, axis, data):
    sent, _, _ = scene(seed, 1, c, n)
    sent = cut(sent, 0)
    _, theta, d = scene(seed, 1, k, n)
    addressee = np.array(data.draw(st.lists(st.integers(NOBODY, k - 1), min_size=c, max_size=c)))
    array = LinearArray(n, axis=axis)

    def quality(part, whose):
        own = whose == np.arange(k)[:, None] if c else np.zeros((k, 0), dtype=bool)
        return link.sinr(part, own, theta[0], link.channel_loss(d[0], 1.0), array)

    reference = quality(sent, addressee)
    order = np.array(data.draw(st.permutations(range(c))), dtype=int)
    shuffled = Transmission(sent.beams[order], sent.antenna_power[order], sent.probing)
    np.testing.assert_allclose(quality(shuffled, addressee[order]), reference, rtol=1e-10)
    share = data.draw(st.floats(0.0, 1.0))
    parts = [np.sqrt(share) * sent.beams, np.sqrt(1 - share) * sent.beams]
    powers = [share * sent.antenna_power, (1 - share) * sent.antenna_power]
    divided = Transmission(np.concatenate(parts), np.concatenate(powers), sent.probing)
    twice = np.concatenate([addressee, addressee])
    np.testing.assert_allclose(quality(divided, twice), reference, rtol=1e-10)
    silent = [0 * sent.beams, 0 * sent.antenna_power]
    padded = Transmission(
        np.concatenate([sent.beams, silent[0]]),
        np.concatenate([sent.antenna_power, silent[1]]),
        sent.probing,
    )
    nobody = np.concatenate([addressee, np.full(c, NOBODY)])
    np.testing.assert_allclose(quality(padded, nobody), reference, rtol=1e-10)


@given(seeds, st.integers(1, 4), antennas, axes, st.lists(st.booleans(), min_size=5, max_size=5))
@pytest.mark.slow
def test_each_trial_of_a_choice_has_the_physics_of_its_own_mode(seed, k, n, axis, mask):
    sent, theta, d = scene(seed, 5, k, n)
    silent = pilot(np.ones((5, k), dtype=bool), 1.0, n)
    mixed = everything(choose(np.array(mask), silent, sent), theta, d, axis)
    expected = np.where(
        np.array(mask)[:, None, None],
        everything(silent, theta, d, axis),
        everything(sent, theta, d, axis),
    )
    np.testing.assert_array_equal(mixed, expected)


@given(seeds, antennas, angles)
def test_antennas_apart_never_give_more_aperture_than_their_two_ends(seed, n, theta):
    # the weighted variance of positions 0 .. n - 1 is at most ((n - 1) / 2)^2 (Popoviciu)
    sent, _, _ = scene(seed, 1, 1, n)
    apart = Transmission(0 * sent.beams, sent.antenna_power, sent.probing)
    aperture = transmit_aperture(apart, np.array([[theta]]))
    limit = (np.pi * np.cos(theta) * (n - 1) / 2) ** 2
    assert aperture <= limit * (1 + 1e-9) + 1e-20


@given(seeds, antennas, st.floats(0.05, 1.5), st.floats(1e-12, 1e12))
def test_what_is_measured_has_the_bounds_variance(seed, n, theta, level):
    sent, _, _ = scene(seed, 1, 1, n)
    angle, snr = np.array([[theta]]), np.array([[level]])
    for crb in ("paper", "exact"):
        bound = measurement_variance(sent, angle, snr, crb=crb, **BOUND)
        effective = effective_variance(bound, snr)
        np.testing.assert_array_equal(effective[..., :1], bound[..., :1])
        np.testing.assert_array_equal(effective[..., 1:], bound[..., 1:])
    # the sensing aperture of the receive array is always there, whatever is sent
    assert bound[0, 0, 0] <= 1 / (2 * level * 5 * square_aperture(theta, 5)) * (1 + 1e-9)


states = st.tuples(angles, st.floats(20.0, 300.0), st.floats(-50.0, 50.0))
flights = st.tuples(st.floats(0.0, 20.0), st.floats(-np.pi, np.pi))


@given(states, st.floats(-5.0, 5.0), flights, st.floats(1e-3, 0.05))
def test_motion_is_that_of_points_in_the_plane(state, acceleration, flight, dt):
    (theta, d, v), (speed, heading) = state, flight
    uav = np.array([0.0, d * np.sin(theta)])
    target = np.array([d * np.cos(theta), 0.0])
    uav = uav + dt * speed * np.array([np.cos(heading), np.sin(heading)])
    target = target + np.array([v * dt + acceleration * dt**2 / 2, 0.0])
    along, below = target[0] - uav[0], uav[1] - target[1]
    if below < 0.0:  # the flight would end under the ground
        below = 0.0
    angle, distance, velocity = move_object(theta, d, v, acceleration, speed, heading, dt)
    np.testing.assert_allclose(distance * np.cos(angle), along, atol=1e-11)
    np.testing.assert_allclose(distance * np.sin(angle), below, atol=1e-11)
    assert velocity == v + acceleration * dt
    assert 0.0 <= angle <= np.pi


@given(states, st.floats(-5.0, 5.0), st.floats(0.0, 20.0), st.floats(0.0, np.pi))
def test_two_half_slots_are_one_slot(state, acceleration, speed, heading):
    whole = move_object(*state, acceleration, speed, heading, 0.04)
    half = move_object(*state, acceleration, speed, heading, 0.02)
    twice = move_object(*half, acceleration, speed, heading, 0.02)
    np.testing.assert_allclose(twice, whole, rtol=1e-12, atol=1e-12)


deviations = st.floats(1e-4, 0.2), st.floats(1e-3, 5.0)


@given(states, *deviations)
def test_noise_along_the_road_is_less_than_the_noise_it_comes_from(state, angle_std, distance_std):
    stds, here = (angle_std, distance_std), np.array(state)
    variance = float(along_road_variance(here, stds))
    theta, d, _ = state
    free = (np.cos(theta) * distance_std) ** 2 + (d * np.sin(theta) * angle_std) ** 2
    assert 0.0 < variance <= free * (1 + 1e-9)
    parts = np.array([along_road(here, unit, stds) for unit in np.eye(2)]) * stds
    # what distance and angle say of the place along the road adds up as information
    information = (np.cos(theta) / distance_std) ** 2 + (np.sin(theta) / (d * angle_std)) ** 2
    np.testing.assert_allclose(variance * information, 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.sum(parts**2), variance, rtol=1e-12)


@given(states, flights)
def test_velocity_comes_back_from_a_noiseless_doppler(state, flight):
    theta, d, v = state
    mu = measure(theta, d, v, *flight, 30e9)[2]
    back = velocity_from_doppler(mu, theta, *flight, 30e9)
    if abs(np.cos(theta)) > 1e-6:
        np.testing.assert_allclose(back, v, atol=1e-13 * 70 / abs(np.cos(theta)))


@settings(max_examples=50)
@given(st.floats(0.1, 200.0), flights, st.floats(1e-3, 1.0), st.floats(0.5, 20.0))
def test_a_flight_is_the_sum_of_its_slots_and_never_below_its_floor(height, flight, dt, floor):
    path = uav_path(height, *flight, dt, 60, floor)
    assert path.height[0] == height
    assert np.all(path.height >= min(floor, height))
    climbs = dt * path.speed * np.sin(path.heading)
    steps = dt * path.speed * np.cos(path.heading)
    scale = 1e-12 * (height + 60 * dt * 20)
    np.testing.assert_allclose(np.diff(path.height), climbs[:-1], atol=scale)
    np.testing.assert_allclose(np.diff(path.x), steps[:-1], atol=scale)
    assert np.all(np.abs(steps - steps[0]) <= scale)
    theta = np.array([0.4, 2.0])
    seen = initial_distance(theta, path.height[0]) * np.sin(theta)
    np.testing.assert_allclose(seen, height, rtol=1e-14)
