"""The echo's SNR against explicit covariances, energy laws and the radar's d^-4."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.array import LinearArray
from echobeam.physics.echo import reflection_coefficient
from echobeam.physics.transmission import directional, omni, radiated_power
from echobeam.values import Transmission

from ..forms import echo_snr, illumination

RADAR = {"rcs": 120 + 120j, "gain": 10.0, "noise": 1.0}


def test_reflection_coefficient_keeps_the_phase_and_falls_with_the_square():
    beta = reflection_coefficient(3 - 4j, np.array([1.0, 10.0]))
    np.testing.assert_allclose(beta, [3 - 4j, 0.03 - 0.04j], rtol=1e-15)


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_snr_agrees_with_the_explicit_covariance(axis):
    rng = np.random.default_rng(6)
    theta, d = rng.uniform(0.2, 2.9, 3), rng.uniform(20.0, 200.0, 3)
    beams = rng.normal(size=(3, 5)) + 1j * rng.normal(size=(3, 5))
    sent = Transmission(beams, rng.random((3, 5)), rng.random(5))
    c = beams.T @ beams.conj() + np.diag(sent.antenna_power.sum(axis=0) + sent.probing)
    a = LinearArray(5, 0.4, axis).steering(theta)
    expected = [
        10.0 * abs((120 + 120j) / d[k] ** 2) ** 2 * (a[k].conj() @ c @ a[k]).real for k in range(3)
    ]
    actual = echo_snr(sent, theta, d, spacing=0.4, axis=axis, **RADAR)
    np.testing.assert_allclose(actual, expected, rtol=1e-12)


@pytest.mark.parametrize("k", [0, 1, 2, 29, 30, 45])
def test_omni_slots_light_every_direction_with_the_whole_power(k):
    sent = omni(np.ones((1, k), dtype=bool), 2.0, 30)
    theta = np.linspace(0.0, np.pi, k)[None]
    np.testing.assert_allclose(illumination(sent, theta), 2.0, rtol=1e-13)
    d = np.full((1, k), 115.47)
    eq_14 = 2.0 * 10.0 * 28800 / 115.47**4
    np.testing.assert_allclose(echo_snr(sent, theta, d, **RADAR), eq_14, rtol=1e-13)


def test_omni_slot_with_nobody_to_talk_to_still_lights_a_newcomer():
    sent = omni(np.zeros(2, dtype=bool), 2.0, 30)
    np.testing.assert_allclose(illumination(sent, np.array([0.3, 1.4])), 2.0, rtol=1e-13)


def test_directional_slots_are_eq_16_and_at_most_the_array_gain():
    rng = np.random.default_rng(7)
    beams = rng.normal(size=(50, 2, 8)) + 1j * rng.normal(size=(50, 2, 8))
    theta, d = rng.uniform(0.1, 3.0, (50, 2)), rng.uniform(50, 150, (50, 2))
    a = LinearArray(8).steering(theta)
    eq_16 = (
        10 * 28800 / d**4 * np.sum(np.abs(np.einsum("tkm,tim->tki", a.conj(), beams)) ** 2, axis=-1)
    )
    sent = directional(beams)
    np.testing.assert_allclose(echo_snr(sent, theta, d, **RADAR), eq_16, rtol=1e-12)
    assert np.all(illumination(sent, theta) <= 8 * radiated_power(sent)[:, None] * (1 + 1e-12))
    matched = directional(LinearArray(8).steering(theta[:, :1]))
    np.testing.assert_allclose(illumination(matched, theta[:, :1]), 8.0 * 8.0, rtol=1e-12)


def test_mean_over_all_sines_is_the_radiated_power():
    # a^H C a is a trigonometric polynomial of degree N - 1 in 2 pi spacing u: its mean over a
    # period, u in [-1, 1) at half a wavelength, is tr(C), and 2 N points give it exactly
    rng = np.random.default_rng(8)
    n = 9
    beams = rng.normal(size=(3, n)) + 1j * rng.normal(size=(3, n))
    sent = Transmission(beams, rng.random((3, n)), rng.random(n))
    u = -1.0 + np.arange(2 * n) / n
    everywhere = illumination(sent, np.arcsin(u).reshape(-1, 1))
    assert everywhere.mean() == pytest.approx(float(radiated_power(sent)), rel=1e-13)


def test_zero_distance_is_an_infinite_echo():
    sent = directional(np.array([[1.0, 0.0], [0.0, 0.0]], dtype=complex))
    theta, d = np.array([0.7, 1.0]), np.zeros(2)
    for rcs in (120 + 120j, 120 + 0j, -5j):
        assert np.abs(reflection_coefficient(rcs, 0.0)) == np.inf
        np.testing.assert_array_equal(
            echo_snr(sent, theta, d, rcs=rcs, gain=10.0, noise=1.0), np.inf
        )
    silent = directional(np.zeros((1, 2), dtype=complex))
    assert np.isnan(echo_snr(silent, theta[:1], d[:1], **RADAR))[0]


def test_absent_objects_get_nan_alone_and_none_at_all_an_empty_answer():
    sent = omni(np.array([True, False]), 1.0, 4)
    snr = echo_snr(sent, np.array([1.0, np.nan]), np.array([100.0, np.nan]), **RADAR)
    assert snr[0] == pytest.approx(10 * 28800 / 100.0**4, rel=1e-14, abs=0)
    assert np.isnan(snr[1])
    empty = np.zeros((3, 0))
    assert echo_snr(omni(empty > 0, 1.0, 4), empty, empty, **RADAR).shape == (3, 0)


@pytest.mark.parametrize("streams", [0, 1])
def test_absent_objects_get_nan_even_without_streams(streams):
    sent = omni(np.zeros(streams, dtype=bool), 3.0, 4)
    lit = illumination(sent, np.array([np.nan, 0.8]))
    assert np.isnan(lit[0])
    assert lit[1] == pytest.approx(3.0, rel=1e-14)


def test_number_of_streams_is_free_of_the_number_of_objects():
    rng = np.random.default_rng(9)
    beams = rng.normal(size=(5, 4)) + 1j * rng.normal(size=(5, 4))
    theta = np.array([0.4, 2.0])
    a = LinearArray(4).steering(theta)
    expected = np.einsum("kn,cn,cm,km->k", a.conj(), beams, beams.conj(), a).real
    np.testing.assert_allclose(illumination(directional(beams), theta), expected, rtol=1e-13)
