"""Covariances and powers of the omnidirectional, pilot and directional transmissions."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.array import LinearArray
from echobeam.physics.echo import illumination
from echobeam.physics.link import sinr, stream_gains
from echobeam.physics.transmission import choose, directional, omni, pilot, radiated_power
from echobeam.values import Transmission


def covariances(transmission, k):
    """The explicit matrices W_k and the total covariance of one unbatched transmission."""
    w, q = transmission.beams, transmission.antenna_power
    streams = [np.outer(w[i], w[i].conj()) + np.diag(q[i]) for i in range(k)]
    return streams, sum(streams, np.diag(transmission.probing).astype(complex))


@pytest.mark.parametrize(("k", "n"), [(4, 4), (9, 4), (1, 1), (3, 1)])
def test_enough_objects_give_the_white_covariance_of_eq_6(k, n):
    streams, total = covariances(omni(np.ones(k, dtype=bool), 2.5, n), k)
    for stream in streams:
        np.testing.assert_allclose(stream, 2.5 / (k * n) * np.eye(n), rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(total, 2.5 / n * np.eye(n), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize(("k", "n"), [(1, 4), (2, 30), (3, 4)])
def test_few_objects_get_one_antenna_each(k, n):
    streams, total = covariances(omni(np.ones(k, dtype=bool), 2.0, n), k)
    for j, stream in enumerate(streams):
        expected = np.zeros((n, n))
        expected[j, j] = 2.0 / k
        np.testing.assert_allclose(stream, expected, rtol=1e-15)
    assert np.linalg.matrix_rank(total) == k


def test_absent_objects_take_no_antenna_and_no_power():
    sent = omni(np.array([False, True, False, True]), 1.0, 5)
    np.testing.assert_array_equal(sent.antenna_power[[0, 2]], 0.0)
    np.testing.assert_array_equal(sent.antenna_power[1], [0.5, 0, 0, 0, 0])
    np.testing.assert_array_equal(sent.antenna_power[3], [0, 0.5, 0, 0, 0])


@pytest.mark.parametrize("k", [0, 3])
def test_without_objects_the_antennas_probe_alike(k):
    sent = omni(np.zeros(k, dtype=bool), 3.0, 6)
    assert sent.antenna_power.shape == sent.beams.shape == (k, 6)
    np.testing.assert_array_equal(sent.antenna_power, 0.0)
    np.testing.assert_array_equal(sent.probing, np.full(6, 0.5))


def test_cases_may_differ_within_a_batch():
    present = np.array([[True] * 4, [True, False, True, False], [False] * 4])
    sent = omni(present, 1.0, 3)
    for trial in range(3):
        alone = omni(present[trial], 1.0, 3)
        np.testing.assert_array_equal(sent.antenna_power[trial], alone.antenna_power)
        np.testing.assert_array_equal(sent.probing[trial], alone.probing)
    np.testing.assert_allclose(radiated_power(sent), 1.0, rtol=1e-15)


def test_directional_radiates_the_beams_and_nothing_else():
    rng = np.random.default_rng(1)
    beams = rng.normal(size=(7, 3, 5)) + 1j * rng.normal(size=(7, 3, 5))
    sent = directional(beams)
    np.testing.assert_array_equal(sent.beams, beams)
    assert not sent.antenna_power.any()
    assert not sent.probing.any()
    assert sent.probing.shape == (7, 5)
    frobenius = [np.linalg.norm(w) ** 2 for w in beams]
    np.testing.assert_allclose(radiated_power(sent), frobenius, rtol=1e-14)


def test_radiated_power_is_the_trace_of_the_covariance():
    rng = np.random.default_rng(2)
    sent = directional(rng.normal(size=(2, 4)) + 1j * rng.normal(size=(2, 4)))
    sent = Transmission(sent.beams, rng.random((2, 4)), rng.random(4))
    assert radiated_power(sent) == pytest.approx(np.trace(covariances(sent, 2)[1]).real, rel=1e-14)


@pytest.mark.parametrize(
    "served", [[], [False], [True], [True, False, True], [True] * 4, [True] * 9]
)
def test_pilot_has_the_covariance_of_the_omnidirectional_slot_and_no_data(served):
    served = np.array(served, dtype=bool)
    data, silent = omni(served, 2.5, 4), pilot(served, 2.5, 4)
    k = served.size
    np.testing.assert_allclose(covariances(silent, k)[1], covariances(data, k)[1], rtol=1e-15)
    theta, array = np.linspace(0.1, 3.0, 7), LinearArray(4)
    np.testing.assert_allclose(
        illumination(silent, theta, array), illumination(data, theta, array), rtol=1e-14
    )
    np.testing.assert_array_equal(stream_gains(silent, theta, array), 0.0)
    everything = np.ones((7, k), dtype=bool)
    np.testing.assert_array_equal(sinr(silent, everything, theta, np.ones(7), array), 0.0)
    assert radiated_power(silent) == pytest.approx(2.5, rel=1e-14)


def test_pilots_of_a_batch_are_those_of_its_trials():
    served = np.array([[True, True], [False, True], [False, False]])
    together = pilot(served, 1.0, 3)
    assert together.beams.shape == together.antenna_power.shape == (3, 2, 3)
    expected = [[0.5, 0.5, 0.0], [1.0, 0.0, 0.0], [1 / 3] * 3]
    np.testing.assert_allclose(together.probing, expected, rtol=1e-15)


def parts(sent):
    return sent.beams, sent.antenna_power, sent.probing


def test_choice_takes_each_trial_from_one_of_two_transmissions():
    rng = np.random.default_rng(3)
    beams = rng.normal(size=(4, 2, 5)) + 1j * rng.normal(size=(4, 2, 5))
    one = Transmission(beams, rng.random((4, 2, 5)), rng.random((4, 5)))
    other = Transmission(-beams, rng.random((4, 2, 5)), rng.random((4, 5)))
    for mask in ([True] * 4, [False] * 4, [False, True, True, False]):
        mixed = choose(np.array(mask), one, other)
        for trial, first in enumerate(mask):
            source = one if first else other
            for chosen, given in zip(parts(mixed), parts(source), strict=True):
                np.testing.assert_array_equal(chosen[trial], given[trial])


def test_choice_between_modes_keeps_the_power_and_illumination_of_each():
    power, mask = 2.0, np.array([True, False, False])
    silent = pilot(np.ones((3, 1), dtype=bool), power, 4)
    beam = LinearArray(4).steering(0.9) * np.sqrt(power / 4)
    mixed = choose(mask, silent, directional(np.broadcast_to(beam, (3, 1, 4))))
    np.testing.assert_allclose(radiated_power(mixed), power, rtol=1e-14)
    theta = np.full((3, 1), 0.9)
    level = illumination(mixed, theta, LinearArray(4))[:, 0]
    np.testing.assert_allclose(level, [power, 4 * power, 4 * power], rtol=1e-14)
    own = np.ones((3, 1, 1), dtype=bool)
    quality = sinr(mixed, own, theta, np.ones((3, 1)), LinearArray(4))[:, 0]
    np.testing.assert_allclose(quality, [0.0, 4 * power, 4 * power], rtol=1e-14)


def test_choice_has_any_leading_axes_or_none():
    one, other = omni(np.ones((2, 3, 1), dtype=bool), 1.0, 2), omni(np.zeros((2, 3, 1)), 1.0, 2)
    mask = np.array([[True, False, True], [False, False, True]])
    mixed = choose(mask, one, other)
    np.testing.assert_array_equal(mixed.probing.any(axis=-1), ~mask)
    np.testing.assert_array_equal(mixed.antenna_power.any(axis=(-2, -1)), mask)
    single = omni(np.ones(1, dtype=bool), 1.0, 2)
    assert choose(np.array(False), other, single) is single
