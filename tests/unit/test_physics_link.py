"""SINR and rate against explicit matrices, the paper's closed forms and the edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echobeam.physics import link
from echobeam.physics.array import LinearArray
from echobeam.physics.link import channel_loss, rate
from echobeam.physics.transmission import directional, omni
from echobeam.values import NOBODY, Transmission

from ..forms import channel, sinr, stream_gains


def random_transmission(rng, k, n):
    beams = rng.normal(size=(k, n)) + 1j * rng.normal(size=(k, n))
    return Transmission(beams, rng.random((k, n)), rng.random(n))


def test_channel_is_eq_3_with_its_phase_and_path_loss():
    h = channel(0.7, 120.0, 4, wavelength=0.01, alpha0=2.0)
    assert np.linalg.norm(h) ** 2 == pytest.approx(4 * (2.0 / 120.0) ** 2, rel=1e-14, abs=0)
    turn = h[0] / abs(h[0])  # 120 m are 12000 whole wavelengths
    assert turn == pytest.approx(1.0, abs=1e-9)
    quarter = channel(0.7, 120.0025, 4, wavelength=0.01)[0]
    assert quarter / abs(quarter) == pytest.approx(1j, abs=1e-9)
    np.testing.assert_allclose(h[1:] / h[:-1], np.exp(1j * np.pi * math.sin(0.7)), rtol=1e-12)


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_sinr_agrees_with_channels_and_explicit_covariances(axis):
    rng = np.random.default_rng(3)
    k, n, noise, alpha0, spacing = 3, 5, 0.7, 1.3, 0.4
    theta, d = rng.uniform(0.2, 2.9, k), rng.uniform(1.0, 3.0, k)
    sent = random_transmission(rng, k, n)
    h = channel(theta, d, n, wavelength=0.01, alpha0=alpha0, spacing=spacing, axis=axis)
    streams = [
        np.outer(sent.beams[i], sent.beams[i].conj()) + np.diag(sent.antenna_power[i])
        for i in range(k)
    ]
    power = np.array([[(h[j].conj() @ w @ h[j]).real for w in streams] for j in range(k)])
    probing = np.array([(h[j].conj() @ np.diag(sent.probing) @ h[j]).real for j in range(k)])
    interference = power.sum(axis=1) - np.diag(power) + probing
    expected = np.diag(power) / (interference + noise)
    actual = sinr(sent, theta, d, noise=noise, alpha0=alpha0, spacing=spacing, axis=axis)
    np.testing.assert_allclose(actual, expected, rtol=1e-12)


@pytest.mark.parametrize(("k", "n"), [(1, 30), (2, 30), (5, 30), (30, 30), (45, 30), (3, 1)])
def test_omni_slots_have_the_closed_form_of_eq_7(k, n):
    rng = np.random.default_rng(k)
    theta, d = rng.uniform(0.1, 3.0, k), rng.uniform(10.0, 200.0, k)
    power, noise, alpha0 = 1e4, 0.5, 1.5
    received = alpha0**2 * power / d**2
    expected = received / k / (received * (k - 1) / k + noise)
    actual = sinr(omni(np.ones(k, dtype=bool), power, n), theta, d, noise=noise, alpha0=alpha0)
    np.testing.assert_allclose(actual, expected, rtol=1e-12)


def test_extra_sensing_streams_would_cost_the_users_their_sinr():
    # K = 2, N = 30: streams of P / N with the rest as probing: K / N = 0.067 of Eq. (7)
    n, d = 30, np.array([103.5, 141.4])
    rest = np.where(np.arange(n) < 2, 0.0, 1.0 / n)
    filled = Transmission(np.zeros((2, n), dtype=complex), np.eye(2, n) / n, rest)
    theta = np.radians([75.0, 135.0])
    plain = sinr(omni(np.ones(2, dtype=bool), 1.0, n), theta, d, noise=1.0)
    ratio = sinr(filled, theta, d, noise=1.0) / plain
    np.testing.assert_allclose(ratio, 2 / 30, rtol=1e-4)


def test_matched_beam_reaches_the_array_gain():
    theta, d, n = np.array([1.0]), np.array([115.5]), 30
    beams = channel(theta, d, n, wavelength=0.01)
    beams = beams / np.linalg.norm(beams)
    assert sinr(directional(beams), theta, d, noise=1.0)[0] == pytest.approx(
        n / 115.5**2, rel=1e-12, abs=0
    )


def test_absent_objects_get_nan_and_do_not_touch_the_others():
    rng = np.random.default_rng(4)
    theta, d = np.array([0.5, np.nan, 1.9]), np.array([50.0, np.nan, 80.0])
    sent = random_transmission(rng, 3, 6)
    there = [0, 2]
    mask = np.array([1.0, 0.0, 1.0])[:, None]
    sent = Transmission(sent.beams * mask, sent.antenna_power * mask, sent.probing)
    remaining = Transmission(sent.beams[there], sent.antenna_power[there], sent.probing)
    assert np.isnan(channel(theta, d, 6, wavelength=0.01)[1]).all()
    full = sinr(sent, theta, d, noise=1.0)
    assert np.isnan(full[1])
    np.testing.assert_allclose(
        full[there], sinr(remaining, theta[there], d[there], noise=1.0), rtol=1e-14
    )
    assert np.isnan(stream_gains(sent, theta)[1]).all()


def test_two_objects_of_the_same_sine_share_an_sinr_product_of_one():
    theta, d = np.array([0.8, np.pi - 0.8]), np.array([100.0, 100.0])
    rng = np.random.default_rng(5)
    beams = 1e4 * (rng.normal(size=(200, 2, 8)) + 1j * rng.normal(size=(200, 2, 8)))
    both = sinr(directional(beams), theta, d, noise=1.0)
    assert np.all(both.prod(axis=-1) <= 1.0)
    same = np.repeat(beams[:, :1], 2, axis=1)
    equal = sinr(directional(same), theta, d, noise=1.0)
    assert np.all(equal < 1.0)
    assert equal.max() > 0.99  # the bound of 1 is what high power reaches


def test_object_without_a_stream_gets_nothing():
    beams = np.zeros((2, 4), dtype=complex)
    beams[0, 0] = 1.0
    np.testing.assert_array_equal(
        sinr(directional(beams), np.array([0.4, 1.0]), np.array([10.0, 10.0]), noise=1.0)[1], 0.0
    )


def test_no_objects_is_an_empty_answer():
    sent = omni(np.zeros((4, 0), dtype=bool), 1.0, 8)
    empty = np.zeros((4, 0))
    assert stream_gains(sent, empty).shape == (4, 0, 0)
    assert rate(sinr(sent, empty, empty, noise=1.0)).shape == (4, 0)


def test_zero_distance_and_zero_noise_have_defined_answers():
    sent = directional(np.ones((1, 3), dtype=complex))
    assert sinr(sent, np.array([1.0]), np.array([0.0]), noise=1.0)[0] == np.inf
    assert sinr(sent, np.array([1.0]), np.array([9.0]), noise=0.0)[0] == np.inf


def test_rate_keeps_its_digits_at_the_papers_powers():
    x = 7.5e-9
    series = (x - x**2 / 2 + x**3 / 3) / math.log(2)
    assert rate(x) == pytest.approx(series, rel=1e-15, abs=0)
    np.testing.assert_allclose(rate([0.0, 1.0, 3.0, 1023.0]), [0, 1, 2, 10], rtol=1e-15)
    assert np.isnan(rate(np.nan))
    assert rate(np.inf) == np.inf


def test_loss_is_noise_over_path_gain():
    h = channel(1.2, 80.0, 1, wavelength=0.01, alpha0=1.7)
    expected = 0.3 / np.linalg.norm(h) ** 2
    assert channel_loss(80.0, 0.3, 1.7) == pytest.approx(expected, rel=1e-14)
    np.testing.assert_array_equal(channel_loss([0.0, np.nan], 0.3), [0.0, np.nan])


def addressed(addressee, k):
    """Which of the streams are for each of k objects."""
    return np.asarray(addressee)[..., np.newaxis, :] == np.arange(k)[:, np.newaxis]


def explicit_sinr(sent, addressee, theta, loss, array):
    """SINR of each object, stream by stream and with matrices, for one trial."""
    answer = []
    for k, (angle, lost) in enumerate(zip(theta, loss, strict=True)):
        a = array.steering(angle)
        signal, other = 0.0, (a.conj() @ np.diag(sent.probing) @ a).real + lost
        for c, whose in enumerate(addressee):
            w = np.outer(sent.beams[c], sent.beams[c].conj()) + np.diag(sent.antenna_power[c])
            power = (a.conj() @ w @ a).real
            signal, other = (signal + power, other) if whose == k else (signal, other + power)
        answer.append(signal / other)
    return np.array(answer)


@pytest.mark.parametrize(
    "addressee",
    [
        [2, 0, 1],  # out of order
        [NOBODY, 1, NOBODY, 0, 2],  # more streams than objects, two of them for nobody
        [1],  # fewer streams than objects
        [0, 2, 0, 0],  # several streams for one object, none for another
        [NOBODY, NOBODY],
        [],
    ],
)
@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_sinr_follows_the_addressee_of_each_stream(addressee, axis):
    rng = np.random.default_rng(11)
    theta, loss = rng.uniform(0.2, 2.9, 3), rng.uniform(0.5, 5.0, 3)
    array = LinearArray(6, 0.4, axis)
    sent = random_transmission(rng, len(addressee), 6)
    expected = explicit_sinr(sent, addressee, theta, loss, array)
    actual = link.sinr(sent, addressed(addressee, 3), theta, loss, array)
    np.testing.assert_allclose(actual, expected, rtol=1e-12)
    np.testing.assert_array_equal(actual == 0.0, ~np.isin(np.arange(3), addressee))


def test_addressees_may_differ_between_trials():
    rng = np.random.default_rng(12)
    array, addressee = LinearArray(4), np.array([[1, 0, NOBODY], [0, NOBODY, 1], [1, 1, 0]])
    theta, loss = rng.uniform(0.2, 2.9, (3, 2)), rng.uniform(0.5, 5.0, (3, 2))
    beams = rng.normal(size=(3, 3, 4)) + 1j * rng.normal(size=(3, 3, 4))
    sent = Transmission(beams, rng.random((3, 3, 4)), rng.random((3, 4)))
    together = link.sinr(sent, addressed(addressee, 2), theta, loss, array)
    for trial in range(3):
        one = Transmission(beams[trial], sent.antenna_power[trial], sent.probing[trial])
        expected = explicit_sinr(one, addressee[trial], theta[trial], loss[trial], array)
        np.testing.assert_allclose(together[trial], expected, rtol=1e-12)


def test_two_streams_for_one_object_add_up_to_one_of_their_power():
    w, array = np.array([0.3, 0.4j, -1.0]), LinearArray(3)
    theta, loss = np.array([1.0, 0.4]), np.array([2.0, 3.0])
    single = link.sinr(directional(w[None]), addressed([0], 2), theta, loss, array)
    halves = directional(np.stack([0.6 * w, 0.8 * w]))
    pair = link.sinr(halves, addressed([0, 0], 2), theta, loss, array)
    np.testing.assert_allclose(pair, single, rtol=1e-14)
    apart = link.sinr(halves, addressed([0, 1], 2), theta, loss, array)
    assert apart[0] < 0.6 * single[0]  # the other half is interference now


def test_weak_interference_is_not_lost_beside_a_strong_signal():
    beams = np.array([[1e9, 0.0], [0.0, 1e-3]], dtype=complex)  # powers 1e18 and 1e-6
    alone = link.sinr(
        directional(beams), addressed([0, NOBODY], 1), np.array([0.0]), np.zeros(1), LinearArray(2)
    )
    assert alone[0] == pytest.approx(1e24, rel=1e-14)


@pytest.mark.parametrize("streams", [0, 2])
def test_absent_objects_get_nan_even_without_streams(streams):
    sent = omni(np.zeros((3, streams), dtype=bool), 2.0, 4)  # probing alone
    theta, loss = np.array([[0.3, np.nan]] * 3), np.array([1.0, np.nan])
    own = np.zeros((3, 2, streams), dtype=bool)
    actual = link.sinr(sent, own, theta, loss, LinearArray(4))
    np.testing.assert_array_equal(actual, [[0.0, np.nan]] * 3)
    known_loss = link.sinr(sent, own, theta, np.ones(2), LinearArray(4))
    np.testing.assert_array_equal(known_loss, [[0.0, np.nan]] * 3)
    assert link.stream_gains(sent, theta, LinearArray(4)).shape == (3, 2, streams)
