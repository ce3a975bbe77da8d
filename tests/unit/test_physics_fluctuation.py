"""Laws of fluctuation against the standard's closed forms, and against quadrature and draws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from echobeam.physics.detection import detection_probability
from echobeam.physics.fluctuation import STEADY, LogNormal, SwerlingOne

STD = 3.41
"""Deviation of the standard's vehicle, dB."""


def test_the_log_normal_law_has_the_mean_of_the_standard_and_its_cut():
    """mu = -(ln 10 / 20) s^2, so that the linear mean is 1, and 0.997071 with the cut."""
    law = LogNormal(STD)
    assert 10.0 * np.log10(law.strength(np.array(0.0))) == pytest.approx(-1.33873, abs=5e-6)
    assert law.strength(np.array(5.0)) == law.strength(np.array(3.0))
    mean = quad(lambda g: float(law.strength(np.array(g))) * norm.pdf(g), -12.0, 12.0, points=[3.0])
    assert mean[0] == pytest.approx(0.997071, abs=5e-7)


@pytest.mark.parametrize("law", [SwerlingOne(), LogNormal(STD), LogNormal(2.5)])
def test_amplitudes_have_the_mean_power_of_the_law_and_any_phase(law):
    """The band is 4.5 standard errors: a fault of no law in 7e-6 of draws."""
    draws = law.amplitude(np.random.default_rng(3).standard_normal((100_000, 2)))
    power = np.abs(draws) ** 2
    expected = 1.0
    if isinstance(law, LogNormal):
        a = law.std * np.log(10.0) / 10.0  # the mean of a log-normal variable that is cut
        expected = norm.cdf(3.0 - a) + np.exp(3.0 * a - 0.5 * a**2) * norm.sf(3.0)
    assert abs(power.mean() - expected) < 4.5 * power.std() / np.sqrt(power.size)
    turned = draws / np.abs(draws)
    assert abs(turned.mean()) < 4.5 / np.sqrt(power.size)
    assert abs((turned**2).mean()) < 4.5 / np.sqrt(power.size)


def test_a_steady_echo_has_amplitude_one():
    assert STEADY.steady
    np.testing.assert_array_equal(STEADY.amplitude(np.zeros((3, 2, 2))), np.ones((3, 2)))


@pytest.mark.parametrize("false_alarm", [1e-3, 1e-6])
@pytest.mark.parametrize("std", [2.5, 3.94])
def test_detection_is_the_mean_over_the_log_normal_strengths(false_alarm, std):
    law = LogNormal(std)

    def weighted(normal: float, snr: float) -> float:
        strength = float(law.strength(np.array(normal)))
        return norm.pdf(normal) * float(detection_probability(snr * strength, false_alarm))

    for snr in 10.0 ** np.array([-1.0, 0.5, 1.1, 1.6, 3.0]):
        below = quad(weighted, -9.0, 3.0, (snr,), epsabs=1e-11, limit=300)[0]
        at_cut = norm.sf(3.0) / norm.pdf(3.0) * weighted(3.0, snr)
        found = float(detection_probability(snr, false_alarm, law))
        assert found == pytest.approx(below + at_cut, abs=1e-8)


@pytest.mark.parametrize("law", [SwerlingOne(), LogNormal(STD)])
@pytest.mark.parametrize("least", [0.05, 1.0, 3.0])
def test_strengths_beyond_a_threshold_are_those_of_the_law_that_exceed_it(law, least):
    """Means of two independent samples, within 4.5 standard errors of their difference."""
    rng = np.random.default_rng(5)
    every = np.abs(law.amplitude(rng.standard_normal((200_000, 2)))) ** 2
    expected = every[every > least]
    found = law.beyond(np.full(len(expected), least), rng.standard_normal(len(expected)))
    assert found.min() >= least * (1.0 - 1e-9)
    error = np.sqrt((expected.var() + found.var()) / len(expected))
    assert abs(found.mean() - expected.mean()) < 4.5 * error


def test_a_threshold_beyond_the_cut_leaves_the_strength_of_the_cut():
    law = LogNormal(STD)
    found = law.beyond(np.array([1e3, np.inf, np.nan]), np.zeros(3))
    np.testing.assert_allclose(found[:2], law.strength(np.array(3.0)), rtol=1e-14)
    assert np.isnan(found[2])
    assert np.isfinite(law.beyond(np.array([0.0, 1e-300]), np.array([-8.0, 8.0]))).all()
