"""The waveform's grid, its symbols, and the echo signal against sums written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from echobeam.physics import transmission
from echobeam.physics.array import LinearArray
from echobeam.physics.echo_signal import Scatterers, echo_signal, noise_of
from echobeam.physics.waveform import Waveform, factor, orthogonalised, symbols_of

GRID = Waveform(bandwidth=8e6, duration=4e-6, subcarriers=5, symbols=3)


def normals(*shape, seed=1):
    return np.random.default_rng(seed).standard_normal(shape)


def test_the_grid_is_that_of_ofdm():
    assert (GRID.elements, GRID.spacing) == (15, 1.6e6)
    assert GRID.symbol_duration == pytest.approx(4e-6 / 3)
    assert GRID.unambiguous_delay == pytest.approx(1 / 1.6e6)
    assert GRID.unambiguous_doppler == pytest.approx(3 / 8e-6)
    f, t = GRID.places()
    np.testing.assert_allclose([f.mean(), t.mean()], 0.0, atol=1e-9)
    # the mean square of a grid is that of a flat spectrum of the effective width
    assert np.mean(f**2) == pytest.approx(GRID.effective_bandwidth**2 / 12)
    assert np.mean(t**2) == pytest.approx(GRID.effective_duration**2 / 12)


@pytest.mark.parametrize("modulation", ["qpsk", "16qam", "gaussian"])
def test_symbols_have_unit_power_and_no_mean(modulation):
    """Means of 40,000 symbols: within five standard errors."""
    wave = Waveform(1e6, 1e-6, 2, 2, modulation)
    drawn = symbols_of(wave, normals(40_000, 2))
    assert abs(drawn.mean()) < 5 / np.sqrt(40_000)
    assert np.mean(np.abs(drawn) ** 2) == pytest.approx(1.0, abs=5 * np.sqrt(2 / 40_000))
    assert abs(np.mean(drawn**2)) < 5 * np.sqrt(2 / 40_000)  # circular
    points = {"qpsk": 4, "16qam": 16}.get(modulation)
    if points:
        assert len(np.unique(np.round(drawn, 9))) == points
        counts = np.unique(np.round(drawn, 9), return_counts=True)[1]
        assert stats.chisquare(counts).pvalue > 1e-3


def test_streams_of_an_omni_slot_are_orthogonal_and_near_their_data():
    data = symbols_of(GRID, normals(6, 4, 5, 3, 2))
    sent = orthogonalised(data).reshape(6, 4, -1)
    np.testing.assert_allclose(
        sent @ np.conj(np.swapaxes(sent, -1, -2)), 15 * np.broadcast_to(np.eye(4), (6, 4, 4)),
        atol=1e-9,
    )  # fmt: skip


def test_the_factor_has_the_covariance_of_what_is_sent():
    rng = np.random.default_rng(3)
    beams = rng.standard_normal((2, 3, 4)) + 1j * rng.standard_normal((2, 3, 4))
    F, orthogonal = factor(transmission.directional(beams))
    assert not orthogonal
    expected = np.einsum("tcn,tcm->tnm", beams, beams.conj())
    np.testing.assert_allclose(F @ np.conj(np.swapaxes(F, -1, -2)), expected)
    served = np.array([[True, True], [False, False]])
    F, orthogonal = factor(transmission.omni(served, 2.0, 4))
    assert orthogonal
    covariance = F @ np.conj(np.swapaxes(F, -1, -2))
    np.testing.assert_allclose(covariance[0], np.diag([1.0, 1.0, 0.0, 0.0]))
    np.testing.assert_allclose(covariance[1], 0.5 * np.eye(4))


def test_the_echo_is_the_sum_of_eq_11_element_by_element():
    """Fractional delays and Doppler shifts, two objects, three streams, by loops."""
    rng = np.random.default_rng(4)
    tx, rx = LinearArray(4), LinearArray(3, 0.4)
    streams = symbols_of(GRID, normals(1, 3, 5, 3, 2))
    F = rng.standard_normal((1, 4, 3)) + 1j * rng.standard_normal((1, 4, 3))
    angle, delay, doppler = (
        np.array([[0.7, 1.9]]),
        np.array([[1.3e-7, 3.1e-7]]),
        np.array([[2e4, -7e4]]),
    )
    amplitude = np.array([[0.3 + 0.1j, -0.2j]])
    found = echo_signal(Scatterers(angle, delay, doppler, amplitude), streams, F, GRID, (tx, rx))
    f, t = GRID.places()
    for r in range(3):
        for n in range(5):
            for m in range(3):
                value = 0.0
                for k in range(2):
                    a = np.exp(2j * np.pi * 0.5 * np.arange(4) * np.sin(angle[0, k]))
                    x = F[0] @ streams[0, :, n, m]
                    turn = np.exp(2j * np.pi * (t[m] * doppler[0, k] - f[n] * delay[0, k]))
                    b = np.exp(2j * np.pi * 0.4 * r * np.sin(angle[0, k]))
                    value += amplitude[0, k] * b * np.vdot(a, x) * turn
                assert found[0, r, n, m] == pytest.approx(value, abs=1e-12)


def test_a_target_without_an_echo_adds_nothing_whatever_its_place():
    tx = LinearArray(2)
    streams, F = symbols_of(GRID, normals(1, 1, 5, 3, 2)), np.ones((1, 2, 1), dtype=complex)
    nowhere = np.array([[np.nan]])
    silent = Scatterers(nowhere, nowhere, nowhere, np.zeros((1, 1), dtype=complex))
    assert not echo_signal(silent, streams, F, GRID, (tx, tx)).any()


def test_noise_is_circular_with_the_variance_asked_for():
    """50,000 draws: within five standard errors."""
    drawn = noise_of(normals(50_000, 2), 3.0)
    assert np.mean(np.abs(drawn) ** 2) == pytest.approx(3.0, abs=5 * 3 / np.sqrt(50_000))
    assert abs(np.mean(drawn**2)) < 5 * 3 * np.sqrt(2 / 50_000)
