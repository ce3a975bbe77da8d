from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.relaxation.rank_one import autocorrelation, beam_of, spectral_factor

PHASES = np.linspace(-np.pi, np.pi, 400)


def _pattern(columns: np.ndarray) -> np.ndarray:
    """a^H W a written out, on the antennas."""
    steering = np.exp(1j * np.outer(PHASES, np.arange(len(columns))))
    return np.sum(np.abs(steering.conj() @ columns) ** 2, axis=1)


def _random(rng: np.random.Generator, n_tx: int, rank: int) -> np.ndarray:
    return rng.normal(size=(n_tx, rank)) + 1j * rng.normal(size=(n_tx, rank))


def test_autocorrelation_sums_the_diagonals() -> None:
    columns = _random(np.random.default_rng(0), 6, 3)
    covariance = columns @ columns.conj().T
    expected = [np.trace(covariance, offset=-lag) for lag in range(6)]
    np.testing.assert_allclose(autocorrelation(columns), expected, atol=1e-12)


@pytest.mark.parametrize(("n_tx", "rank"), [(1, 1), (2, 2), (5, 3), (16, 4), (30, 30), (64, 2)])
def test_one_beam_has_the_pattern_and_power_of_the_covariance(n_tx: int, rank: int) -> None:
    columns = _random(np.random.default_rng(n_tx), n_tx, rank)
    beam = beam_of(columns)
    power = np.sum(np.abs(columns) ** 2)
    assert np.sum(np.abs(beam) ** 2) == pytest.approx(power, rel=1e-10)
    np.testing.assert_allclose(_pattern(beam[:, None]), _pattern(columns), atol=1e-10 * power)


def test_patterns_with_zeros_are_factored_too() -> None:
    # A real symmetric taper has all its zeros on the unit circle, each twice in the pattern.
    taper = np.hanning(22)[1:-1].astype(complex)
    lags = autocorrelation(taper[:, None])
    beam, residual = spectral_factor(lags)
    assert residual < 1e-11
    np.testing.assert_allclose(autocorrelation(beam[:, None]), lags, atol=1e-11 * lags[0].real)


def test_several_patterns_are_factored_at_once() -> None:
    rng = np.random.default_rng(2)
    lags = np.stack([autocorrelation(_random(rng, 12, 3)) for _ in range(4)])
    beams, residual = spectral_factor(lags)
    assert residual.shape == (4,)
    for own, beam in zip(lags, beams, strict=True):
        np.testing.assert_allclose(autocorrelation(beam[:, None]), own, atol=1e-10 * own[0].real)


def test_rank_one_is_returned_as_it_is_and_nothing_as_nothing() -> None:
    column = _random(np.random.default_rng(3), 7, 1)
    np.testing.assert_array_equal(beam_of(np.hstack([0 * column, column])), column[:, 0])
    np.testing.assert_array_equal(beam_of(np.zeros((5, 2), dtype=complex)), np.zeros(5))
