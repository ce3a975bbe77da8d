"""Bounds against a Fisher matrix built numerically from the received signal, and the edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echobeam.physics.array import LinearArray
from echobeam.physics.bounds import effective_variance
from echobeam.physics.transmission import directional, omni
from echobeam.values import Transmission

from ..forms import illumination, measurement_variance, square_aperture, transmit_aperture

BANDWIDTH, PULSE = 80e6, 1e-5
RADAR = {"bandwidth": BANDWIDTH, "pulse_length": PULSE}


def covariance(sent):
    """C of one unbatched transmission as a matrix."""
    single = sent.antenna_power.sum(axis=0) + sent.probing
    return sent.beams.T @ sent.beams.conj() + np.diag(single)


def numerical_bounds(sent, theta, n_rx, *, cells=6, axis="vertical", centres=(0.0, 0.0)):
    """Bounds from the Fisher matrix of (theta, tau, mu, Re beta, Im beta), and the SNR.

    The echo r = beta b(theta) a(theta)^H x exp(j 2 pi (mu t - f tau)) + z, Eq. (11), is sampled
    on ``cells`` flat subcarriers by ``cells`` time cells, with codes that realise the transmit
    covariance exactly in each cell. Derivatives are fourth-order differences. ``centres`` moves
    the phase centres of the arrays. A uniform grid of M cells has (1 - 1 / M^2) of the mean
    square width of the continuous band, which the answer is corrected for.
    """
    n_tx = sent.beams.shape[-1]
    values, vectors = np.linalg.eigh(covariance(sent))
    codes = np.exp(2j * np.pi * np.outer(np.arange(n_tx), np.arange(n_tx)) / n_tx)
    x = vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * codes)  # x x^H = n_tx C
    grid = (np.arange(cells) - (cells - 1) / 2) / cells
    project = np.sin if axis == "vertical" else np.cos

    def response(angle, n, centre):
        return np.exp(1j * np.pi * (np.arange(n) - centre) * project(angle))

    def echo(p):
        angle, tau, mu, re, im = p
        pattern = np.outer(
            response(angle, n_rx, centres[0]), response(angle, n_tx, centres[1]).conj() @ x
        )
        delay, doppler = np.exp(-2j * np.pi * grid * tau), np.exp(2j * np.pi * grid * mu)
        return (re + 1j * im) * np.einsum("nl,f,t->nlft", pattern, delay, doppler).ravel()

    point, columns = np.array([theta, 0.3, -0.2, 0.6, -0.8]), []  # |beta| = 1, noise = 1
    for step in 1e-3 / n_rx * np.eye(5):
        near = echo(point + step) - echo(point - step)
        far = echo(point + 2 * step) - echo(point - 2 * step)
        columns.append((8 * near - far) / (12 * step.max()))
    jacobian = np.stack(columns, axis=-1)
    scale = np.linalg.norm(jacobian, axis=0)
    fisher = 2 * (jacobian.conj().T @ jacobian).real / np.outer(scale, scale)
    bounds = np.diag(np.linalg.inv(fisher))[:3] / scale[:3] ** 2
    continuous = 1 - 1 / cells**2
    a = response(theta, n_tx, 0.0)
    snr = n_tx * cells**2 * (a.conj() @ covariance(sent) @ a).real
    return bounds * np.array([1, continuous / BANDWIDTH**2, continuous / PULSE**2]), snr


def one(sent, theta, snr, crb, n_rx, **kwargs):
    """`measurement_variance` of a single object."""
    angle, level = np.array([theta]), np.array([snr])
    return measurement_variance(sent, angle, level, crb=crb, n_rx=n_rx, **RADAR, **kwargs)[0]


def random_transmission(seed, k, n):
    rng = np.random.default_rng(seed)
    beams = rng.normal(size=(k, n)) + 1j * rng.normal(size=(k, n))
    return Transmission(beams, rng.random((k, n)), rng.random(n))


def single_beam(theta, n):
    return directional(LinearArray(n).steering(np.array([theta])) / math.sqrt(n))


OMNI = {k: omni(np.ones(k, dtype=bool), 1.0, 30) for k in (0, 1, 2, 30, 45)}


@pytest.mark.parametrize("degrees", [10.0, 45.0, 75.0, 135.0])
@pytest.mark.parametrize("k", [0, 1, 2, 30, 45])
def test_exact_bound_is_the_numerical_one_in_omni_slots(k, degrees):
    theta = math.radians(degrees)
    expected, snr = numerical_bounds(OMNI[k], theta, 30)
    np.testing.assert_allclose(one(OMNI[k], theta, snr, "exact", 30), expected, rtol=1e-8)


@pytest.mark.parametrize(("n_tx", "n_rx"), [(6, 6), (8, 5), (4, 9), (1, 6), (5, 1)])
@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_exact_bound_is_the_numerical_one_for_any_covariance(n_tx, n_rx, axis):
    sent = random_transmission(n_tx, 2, n_tx)
    expected, snr = numerical_bounds(sent, 1.1, n_rx, axis=axis)
    actual = one(sent, 1.1, snr, "exact", n_rx, axis=axis)
    np.testing.assert_allclose(actual, expected, rtol=1e-8)


@pytest.mark.parametrize("mispointing", [0.0, 1.0, 4.0])
def test_exact_bound_is_the_numerical_one_for_one_beam_wherever_it_points(mispointing):
    sent = single_beam(math.radians(60 + mispointing), 12)
    expected, snr = numerical_bounds(sent, math.radians(60), 12)
    np.testing.assert_allclose(one(sent, math.radians(60), snr, "exact", 12), expected, rtol=1e-7)


@pytest.mark.parametrize("centres", [(0.0, 4.5), (3.0, 0.0), (17.0, -8.0)])
def test_numerical_bound_does_not_depend_on_the_phase_centres(centres):
    sent = random_transmission(11, 2, 6)
    reference, snr = numerical_bounds(sent, 0.8, 7)
    moved, _ = numerical_bounds(sent, 0.8, 7, centres=centres)
    np.testing.assert_allclose(moved, reference, rtol=1e-7)
    np.testing.assert_allclose(one(sent, 0.8, snr, "exact", 7), moved, rtol=1e-7)


@pytest.mark.parametrize(
    ("n_tx", "n_rx", "k", "factor"),
    [
        (30, 30, 30, 30 / 4),  # full rank: N_t / 4 = 7.5
        (30, 30, 1, 30 / 2),  # rank one: N_t / 2 = 15
        (30, 30, 2, 15 * (899 / 12) / (899 / 12 + 1 / 4)),  # 14.95
        (30, 20, 30, 30 * 899 / (2 * (399 + 899))),  # 10.4
        (20, 30, 30, 20 * 399 / (2 * (899 + 399))),  # 3.07
    ],
)
def test_how_far_the_printed_angle_bound_is_from_the_numerical_one(n_tx, n_rx, k, factor):
    sent, theta = omni(np.ones(k, dtype=bool), 1.0, n_tx), math.radians(60)
    numerical, snr = numerical_bounds(sent, theta, n_rx, cells=2)
    printed = one(sent, theta, snr, "paper", n_rx)
    assert numerical[0] / printed[0] == pytest.approx(factor, rel=1e-7)


def test_how_far_the_printed_delay_and_doppler_bounds_are_from_the_numerical_ones():
    numerical, snr = numerical_bounds(OMNI[30], 1.0, 30)
    printed = one(OMNI[30], 1.0, snr, "paper", 30)
    factor = 30 * 12 / (2 * (2 * math.pi) ** 2)  # N_t / (2 (2 pi / sqrt 12)^2) = 4.56
    np.testing.assert_allclose(numerical[1:] / printed[1:], factor, rtol=1e-8)


def test_printed_bound_gives_the_papers_sizes():
    # single object at 60 degrees from 100 m, P_T = 1: 3.49 degrees, 1.55 m, 8.3e4 Hz
    d = 100 / math.sin(math.radians(60))
    snr = 10 * 28800 / d**4
    std = np.sqrt(one(OMNI[1], math.radians(60), snr, "paper", 30))
    slope = math.pi * 0.5 * math.sqrt(899 / 12)
    assert std[0] == pytest.approx(1 / math.sqrt(snr * 900) / slope, rel=1e-12)
    assert math.degrees(std[0]) == pytest.approx(3.49, abs=0.005)
    assert std[1] * 299792458 / 2 == pytest.approx(1.55, abs=0.005)
    assert std[2] == pytest.approx(8.3e4, rel=5e-3)


def test_square_aperture_is_the_variance_of_the_phase_slopes():
    positions = 0.4 * np.arange(11)
    expected = np.var(2 * np.pi * positions * math.cos(0.7))
    assert square_aperture(0.7, 11, 0.4) == pytest.approx(expected, rel=1e-13)
    sideways = np.var(2 * np.pi * positions * math.sin(0.7))
    assert square_aperture(0.7, 11, 0.4, "horizontal") == pytest.approx(sideways, rel=1e-13)


def test_exact_bound_is_the_trace_formula_with_explicit_matrices():
    sent, n_rx, theta = random_transmission(12, 3, 5), 4, 0.9
    m_tx, m_rx = np.arange(5) - 1.3, np.arange(n_rx) + 7.0  # any phase centres
    a, b = (np.exp(1j * np.pi * m * math.sin(theta)) for m in (m_tx, m_rx))
    da, db = (1j * np.pi * math.cos(theta) * m * s for m, s in ((m_tx, a), (m_rx, b)))
    c = covariance(sent)
    pair, slope = np.outer(b, a.conj()), np.outer(db, a.conj()) + np.outer(b, da.conj())
    cross = np.trace(pair @ c @ slope.conj().T)
    echo_power = np.trace(pair @ c @ pair.conj().T).real
    total = np.trace(slope @ c @ slope.conj().T).real - abs(cross) ** 2 / echo_power
    level = illumination(sent, np.array([theta]))[0]  # G_m |beta|^2 / sigma^2 = 1
    actual = one(sent, theta, level, "exact", n_rx)[0]
    assert actual == pytest.approx(1 / (2 * total), rel=1e-12, abs=0)


def test_rank_one_has_no_transmit_aperture_even_far_off_the_beam():
    theta = np.radians([[60.0], [61.0], [75.0], [20.0]])
    beam = single_beam(math.radians(60), 30)
    aperture = transmit_aperture(beam, theta)
    np.testing.assert_array_less(aperture, 1e-9 * square_aperture(theta, 30))


def test_white_covariance_has_the_transmit_aperture_of_the_whole_array():
    theta = np.radians([[10.0], [60.0], [170.0]])
    aperture = transmit_aperture(OMNI[0], theta)
    np.testing.assert_allclose(aperture, square_aperture(theta, 30), rtol=1e-12)


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_no_echo_means_infinite_variances(crb):
    np.testing.assert_array_equal(one(OMNI[30], 1.0, 0.0, crb, 30), np.inf)
    silent = directional(np.zeros((1, 4), dtype=complex))
    np.testing.assert_array_equal(one(silent, 1.0, 0.0, crb, 4), np.inf)
    np.testing.assert_array_equal(transmit_aperture(silent, np.array([1.0])), 0.0)


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_the_angle_is_not_measurable_where_the_array_is_blind(crb):
    for theta, axis in [(np.pi / 2, "vertical"), (np.pi, "horizontal"), (0.0, "horizontal")]:
        for snr in (3.0, np.inf):
            variance = one(OMNI[30], theta, snr, crb, 30, axis=axis)
            assert variance[0] == np.inf
            assert np.isfinite(variance[1:]).all()


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_a_single_antenna_measures_no_angle(crb):
    variance = one(omni(np.ones(1, dtype=bool), 1.0, 1), 1.0, 2.0, crb, 1)
    assert variance[0] == np.inf
    assert np.isfinite(variance[1:]).all()


def test_a_single_receive_antenna_still_measures_by_what_is_sent():
    assert np.isfinite(one(OMNI[30], 1.0, 2.0, "exact", 1)[0])
    assert one(OMNI[1], 1.0, 2.0, "exact", 1)[0] == np.inf


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_absent_objects_get_nan_and_no_objects_an_empty_answer(crb):
    sent = omni(np.array([True, False]), 1.0, 6)
    theta, snr = np.array([1.0, np.nan]), np.array([2.0, np.nan])
    variance = measurement_variance(sent, theta, snr, crb=crb, n_rx=6, **RADAR)
    assert np.isnan(variance[1]).all()
    alone = omni(np.array([True]), 1.0, 6)
    np.testing.assert_allclose(variance[0], one(alone, 1.0, 2.0, crb, 6), rtol=1e-14)
    none = omni(np.zeros((3, 0), dtype=bool), 1.0, 6)
    empty = np.zeros((3, 0))
    shape = measurement_variance(none, empty, empty, crb=crb, n_rx=6, **RADAR).shape
    assert shape == (3, 0, 3)


def test_what_has_no_echo_or_no_bound_is_not_measured():
    variance = np.array([[1e-4, 1e-16, 1e8], [7.0, 1e-10, 1e12], [np.inf, 1e-16, 1e8]])
    effective = effective_variance(variance, np.array([1.0, 1e-9, 1.0]))
    np.testing.assert_array_equal(effective, variance)
    np.testing.assert_array_equal(effective_variance(variance[0], 0.0), np.inf)
    np.testing.assert_array_equal(effective_variance(np.full(3, np.nan), np.nan), np.inf)
