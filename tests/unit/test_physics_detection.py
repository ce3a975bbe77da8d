"""Probability of detection against simulated detectors, and the spread of false detections."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import i0e

from echobeam.physics.array import LinearArray
from echobeam.physics.detection import DetectionLaw, detection_law, detection_probability
from echobeam.physics.fluctuation import STEADY, LogNormal, SwerlingOne

BAND = 4.5
"""Standard deviations of a binomial share: beyond it with probability 7e-6."""

LAWS = [STEADY, SwerlingOne(), LogNormal(3.41)]


def law_of(axis="vertical", n=8, spacing=0.5, **changes) -> DetectionLaw:
    values = {
        "false_alarm": 1e-5,
        "clutter": 0.5,
        "subcarriers": 100,
        "bandwidth": 80e6,
        "pulse_length": 1e-4,
        "carrier": 30e9,
        "uav_speed": 20.0,
        "fluctuation": STEADY,
    }
    return detection_law(LinearArray(n, spacing, axis), **values | changes)


@pytest.mark.parametrize("false_alarm", [1e-1, 1e-2])
@pytest.mark.parametrize("snr", [0.0, 0.5, 3.0, 10.0])
@pytest.mark.parametrize("fluctuation", LAWS)
def test_a_simulated_square_law_detector_detects_as_often(snr, false_alarm, fluctuation):
    rng = np.random.default_rng(7)
    draws = 200_000
    normals, echo = rng.standard_normal((2, draws, 2))
    noise = (normals @ np.array([1.0, 1j])) / np.sqrt(2.0)
    amplitude = fluctuation.amplitude(echo)
    power = np.abs(np.sqrt(snr) * amplitude + noise) ** 2  # of noise alone: exponential, mean 1
    share = np.mean(power > -np.log(false_alarm))
    expected = float(detection_probability(snr, false_alarm, fluctuation))
    assert abs(share - expected) < BAND * np.sqrt(expected * (1.0 - expected) / draws)


def marcum(a: float, b: float) -> float:
    """Return Q_1(a, b) by its definition, the integral of Rice's density beyond b."""

    def density(x: float) -> float:
        return x * np.exp(-0.5 * (x - a) ** 2) * i0e(a * x)

    middle = max(a, b)
    return quad(density, b, middle + 40.0, epsabs=1e-13, points=[middle], limit=200)[0]


@pytest.mark.parametrize("false_alarm", [0.09, 1e-4, 1e-8])
def test_a_constant_echo_follows_marcums_function(false_alarm):
    snr = np.array([0.0, 0.1, 1.0, 5.0, 12.0, 30.0, 80.0])
    expected = [marcum(np.sqrt(2.0 * s), np.sqrt(-2.0 * np.log(false_alarm))) for s in snr]
    found = detection_probability(snr, false_alarm)
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("false_alarm", [0.09, 1e-4])
@pytest.mark.parametrize("mean", [0.2, 2.0, 25.0])
def test_swerling_one_is_the_mean_over_exponential_strengths(mean, false_alarm):
    def weighted(strength: float) -> float:
        return np.exp(-strength) * float(detection_probability(mean * strength, false_alarm))

    expected = quad(weighted, 0.0, 50.0, epsabs=1e-10, limit=200)[0]
    found = float(detection_probability(mean, false_alarm, SwerlingOne()))
    assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("fluctuation", LAWS)
def test_limits_are_the_false_alarm_and_certainty(fluctuation):
    for false_alarm in (1e-2, 1e-9):
        found = detection_probability([0.0, -1.0], false_alarm, fluctuation)
        np.testing.assert_allclose(found, false_alarm, rtol=1e-10)
    many = detection_probability(np.geomspace(1e-3, 1e12, 60), 1e-6, fluctuation)
    assert np.isfinite(many).all()
    assert (np.diff(many) >= -1e-12).all()
    assert many[-1] == pytest.approx(1.0, abs=1e-9)
    empty = detection_probability(np.empty((3, 0)), 1e-6, fluctuation)
    assert empty.shape == (3, 0)


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_the_density_integrates_to_the_mean_number_of_false_detections(axis):
    law = law_of(axis)
    top = 0.5 * np.pi if axis == "vertical" else np.pi  # a vertical array folds 90 to 180 degrees
    over_angles = quad(lambda angle: float(law.density(np.array(angle))), 0.0, top)[0]
    total = over_angles * law.longest * 2.0 * law.widest
    assert total == pytest.approx(law.mean_false, rel=1e-9)
    assert law.mean_false == pytest.approx(1e-5 * law.cells + 0.5)


def test_the_density_is_that_of_a_uniform_sine_or_cosine():
    """The law of transformed densities: |du / dtheta|, checked by the share below an angle."""
    vertical, horizontal = law_of("vertical"), law_of("horizontal")
    volume = vertical.longest * 2.0 * vertical.widest
    for angle in (0.2, 0.7, 1.3):
        share = quad(lambda x: float(vertical.density(np.array(x))), 0.0, angle)[0] * volume
        assert share / vertical.mean_false == pytest.approx(np.sin(angle))
        share = quad(lambda x: float(horizontal.density(np.array(x))), 0.0, angle)[0] * volume
        assert share / horizontal.mean_false == pytest.approx(0.5 * (1.0 - np.cos(angle)))


def test_what_is_searched_covers_the_grid_and_the_road():
    law = law_of(uav_speed=20.0)
    assert law.longest == pytest.approx(100 / 80e6)
    assert law.widest == pytest.approx(2.0 * 30e9 * 80.0 / 299_792_458.0)
    assert law_of(false_alarm=0.01, clutter=0.0).mean_false == pytest.approx(0.01 * law.cells)
    assert law_of("horizontal").directions == (-1.0, 1.0)
    assert law.directions == (0.0, 1.0)


def test_the_gain_of_the_receive_array_is_in_the_snr_of_a_cell():
    for fluctuation in LAWS:
        law = law_of(n=12, fluctuation=fluctuation)
        snr = np.array([0.0, 0.3, 2.0])
        expected = detection_probability(12 * snr, 1e-5, fluctuation)
        np.testing.assert_array_equal(law.probability(snr), expected)
