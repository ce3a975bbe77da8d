"""What is sent: covariances and powers of the omnidirectional and directional phases."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.transmission import directional, omni, radiated_power


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
    sent = type(sent)(sent.beams, rng.random((2, 4)), rng.random(4))
    assert radiated_power(sent) == pytest.approx(np.trace(covariances(sent, 2)[1]).real, rel=1e-14)
