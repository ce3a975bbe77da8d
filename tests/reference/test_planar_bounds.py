"""Bounds of planar arrays: closed forms, and the Fisher matrix of a signal differentiated."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics import transmission
from echobeam.physics.array import LinearArray
from echobeam.physics.bounds import measurement_variance
from echobeam.physics.planar import PlanarArray
from echobeam.physics.planar_bounds import cosine_information, transmit_apertures
from echobeam.values import Transmission

BAND = {"bandwidth": 80e6, "pulse_length": 1e-5}
DIRECTION = np.array([[0.3, -0.2]])


def bound(sent, snr, array, receiver=None, crb="exact", direction=DIRECTION):
    return measurement_variance(
        sent, direction, np.atleast_1d(snr), array, receiver or array, crb=crb, **BAND
    )


def matched(array, power=1.0, direction=DIRECTION):
    beams = array.steering(direction) * np.sqrt(power / array.elements)
    return transmission.directional(beams)


@pytest.mark.parametrize(("rows", "columns"), [(8, 8), (4, 6), (30, 1)])
def test_closed_forms_of_orthogonal_waveforms_and_of_a_matched_beam(rows, columns):
    """var(u) = 3 / (pi^2 N (n^2 - 1) SNR), and 6 / (pi^2 N^2 (n^2 - 1) SNR); SNR of one antenna."""
    array, one = PlanarArray(rows, columns), 0.01
    n = rows * columns
    everywhere = transmission.omni(np.zeros(0, dtype=bool), 1.0, n)
    found = bound(everywhere, one, array)[0]
    counts = np.array([rows, columns], dtype=float)
    with np.errstate(divide="ignore"):
        expected = 3.0 / (np.pi**2 * n * (counts**2 - 1.0) * one)
        beam = 6.0 / (np.pi**2 * n**2 * (counts**2 - 1.0) * one)
        printed = 12.0 / (one * n * n * np.pi**2 * (counts**2 - 1.0))
    np.testing.assert_allclose(found[:2], expected, rtol=1e-10)
    sent = matched(array)
    np.testing.assert_allclose(bound(sent, n * one, array)[0, :2], beam, rtol=1e-10)
    np.testing.assert_allclose(bound(sent, one, array, crb="paper")[0, :2], printed, rtol=1e-10)
    assert found.shape == (4,)


def test_the_printed_numbers_of_a_linear_array():
    array = PlanarArray(30, 1)
    everywhere = transmission.omni(np.zeros(0, dtype=bool), 1.0, 30)
    assert bound(everywhere, 0.01, array)[0, 0] == pytest.approx(1.12704e-3, rel=1e-5)
    assert bound(matched(array), 0.3, array)[0, 0] == pytest.approx(7.51362e-5, rel=1e-5)
    assert np.isinf(bound(everywhere, 0.01, array)[0, 1])


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_one_column_has_the_bounds_of_the_linear_array(crb):
    """Var(u) = (du/dtheta)^2 var(theta) of Eq. (22), whatever several beams are sent."""
    rng = np.random.default_rng(1)
    beams = rng.normal(size=(3, 12)) + 1j * rng.normal(size=(3, 12))
    sent, angle = transmission.directional(beams), np.radians([50.0, 75.0, 140.0])
    line, plane = LinearArray(12, axis="horizontal"), PlanarArray(12, 1)
    u = np.stack([np.cos(angle), np.zeros(3)], axis=-1)
    snr = np.array([0.1, 2.0, 30.0])
    ours = bound(sent, snr, plane, crb=crb, direction=u)
    road = measurement_variance(sent, angle, snr, line, line, crb=crb, **BAND)
    np.testing.assert_allclose(ours[:, 0], road[:, 0] * np.sin(angle) ** 2, rtol=1e-9)
    np.testing.assert_array_equal(ours[:, 2:], road[:, 1:])


def factor_of(sent):
    """Return F with F F^H = C of one transmission."""
    single = np.sqrt(sent.antenna_power.sum(axis=0) + sent.probing)
    return np.concatenate([sent.beams.T, np.diag(single)], axis=1)


def fisher(sent, direction, transmitter, receiver, amplitude, noise):
    """Return the information on (u, v) of the echo, the complex amplitude eliminated.

    The signal is alpha b(u, v) (a(u, v)^H F_p) for each polarisation p; derivatives by a step.
    """
    F = factor_of(sent).reshape(transmitter.polarisations, transmitter.elements, -1)

    def signal(p):
        u, v, real, imag = p
        a = transmitter.steering(np.array([u, v]))
        b = receiver.steering(np.array([u, v]))
        lit = np.einsum("n,pnl->pl", a.conj(), F).ravel()
        return ((real + 1j * imag) * np.outer(b, lit)).ravel()

    point, step = np.array([*direction, amplitude.real, amplitude.imag]), 1e-6
    slopes = []
    for index in range(4):
        off = np.zeros(4)
        off[index] = step
        ahead, behind = signal(point + off), signal(point - off)
        slopes.append((ahead - behind) / (2.0 * step))
    D = np.stack(slopes, axis=1)
    J = 2.0 / noise * np.real(D.conj().T @ D)
    return np.linalg.inv(np.linalg.inv(J)[:2, :2])


@pytest.mark.parametrize("polarisations", [1, 2])
@pytest.mark.parametrize("kind", ["beams", "mixture"])
def test_any_covariance_has_the_information_of_the_signal(kind, polarisations):
    rng = np.random.default_rng(7 + polarisations)
    transmitter = PlanarArray(4, 3, polarisations=polarisations)
    receiver = PlanarArray(3, 5, polarisations=polarisations)
    n = transmitter.n
    beams = rng.normal(size=(3, n)) + 1j * rng.normal(size=(3, n))
    loud = 0.0 if kind == "beams" else 1.0
    sent = Transmission(beams, loud * rng.uniform(size=(3, n)), loud * rng.uniform(size=n))
    direction, amplitude, noise = np.array([0.25, -0.4]), 0.3 - 0.2j, 0.7
    expected = fisher(sent, direction, transmitter, receiver, amplitude, noise)
    a = transmitter.steering(direction)
    F = factor_of(sent).reshape(polarisations, transmitter.elements, -1)
    lit = np.sum(np.abs(np.einsum("n,pnl->pl", a.conj(), F)) ** 2)
    snr = abs(amplitude) ** 2 * lit / noise
    J = (
        2.0
        * snr
        * receiver.elements
        * cosine_information(sent, direction[None], transmitter, receiver)[0]
    )
    np.testing.assert_allclose(J, expected, rtol=1e-6, atol=1e-6 * np.abs(J).max())
    assert abs(J[0, 1]) > 1e-3 * J[0, 0]  # several beams correlate the two cosines
    found = bound(sent, snr, transmitter, receiver, direction=direction[None])[0, :2]
    np.testing.assert_allclose(found, np.diag(np.linalg.inv(expected)), rtol=1e-5)


def test_one_beam_adds_nothing_and_dark_directions_give_nothing():
    array = PlanarArray(4, 4)
    assert np.abs(transmit_apertures(matched(array), DIRECTION, array)).max() < 1e-25
    nothing = transmission.directional(np.zeros((1, 16), dtype=complex))
    assert np.isinf(bound(nothing, 0.0, array)).all()
    absent = np.full((1, 2), np.nan)
    assert np.isnan(bound(matched(array), np.nan, array, direction=absent)).all()


def test_the_zenith_and_the_edge_of_the_visible_region_are_no_exceptions():
    array = PlanarArray(8, 8)
    edge = np.array([[0.0, 0.0], [1.0, 0.0], [-0.6, 0.8]])
    everywhere = transmission.omni(np.zeros(0, dtype=bool), 1.0, 64)
    found = bound(everywhere, np.full(3, 0.01), array, direction=edge)
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), rtol=1e-12)
