"""One beam from a relaxed covariance, with the same pattern and the same power.

Problem (38) sees W_k only through its pattern a^H(theta) W_k a(theta) and its trace: a
non-negative trigonometric polynomial and its zeroth coefficient. By the theorem of Fejer and Riesz
every such polynomial is |a^H(theta) w|^2 for one vector w, so the rank constraint (38d) costs
nothing, and w is found by spectral factorisation of the sums along W_k's diagonals.
"""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, ComplexArray, IntArray

MOST_STEPS = 60
ENOUGH = 1e-12

NEGLIGIBLE = 1e-15
"""Share of the power outside one column at which the column is the beam."""


def autocorrelation(columns: ComplexArray) -> ComplexArray:
    """Return the sums along the diagonals of W = columns columns^H: all that its pattern is.

    Parameters
    ----------
    columns
        ``(..., N, r)`` complex: a factor of the covariance, on the antennas.

    Returns
    -------
    ComplexArray
        ``(..., N)``: r_l = sum_m W[m + l, m]; r_0 is the power, and the pattern is
        sum_l r_l exp(-j l phase) over l from -(N-1) to N-1 with r_{-l} = conj(r_l).
    """
    n_tx = columns.shape[-2]
    spectrum = np.fft.fft(columns, 2 * n_tx, axis=-2)
    return np.fft.ifft(np.sum(np.abs(spectrum) ** 2, axis=-1), axis=-1)[..., :n_tx]


def spectral_factor(lags: ComplexArray) -> tuple[ComplexArray, Array]:
    """Return the vector whose autocorrelation is given: Wilson's Newton iteration.

    Started from one antenna, whose polynomial has no zero outside the unit disc, the iteration
    keeps that property and converges for every non-negative pattern. Where the pattern itself has
    zeros, as good ones do, w is approached by halves; each time the point twice as far is
    looked at, too, which then is nearly the limit.

    Parameters
    ----------
    lags
        ``(..., N)`` complex: `autocorrelation` of a covariance, with r_0 > 0.

    Returns
    -------
    factor, residual
        ``(..., N)``: w; ``(...)``: the largest error of its autocorrelation relative to its
        power.
    """
    power = lags[..., :1].real
    wanted = lags / power
    present = np.zeros(lags.shape, dtype=complex)
    present[..., 0] = 1.0
    has = autocorrelation(present[..., np.newaxis])
    best, error = present, _distance(has, wanted)
    indices = _indices(lags.shape[-1])
    for _ in range(MOST_STEPS):
        past, present = present, _newton_step(present, wanted + has, indices)
        has = autocorrelation(present[..., np.newaxis])
        ahead = 2.0 * present - past
        would_have = autocorrelation(ahead[..., np.newaxis])
        for candidate, its in ((present, has), (ahead, would_have)):
            distance = _distance(its, wanted)
            better = distance < error
            best = np.where(better[..., np.newaxis], candidate, best)
            error = np.where(better, distance, error)
        if np.all(error < ENOUGH):
            break
    return best * np.sqrt(power), error


def _distance(lags: ComplexArray, wanted: ComplexArray) -> Array:
    worst: Array = np.max(np.abs(lags - wanted), axis=-1)
    return worst


def _indices(n_tx: int) -> tuple[IntArray, IntArray]:
    """Return where the Hankel and the Toeplitz matrix of a padded vector take their entries."""
    row, column = np.arange(n_tx)[:, np.newaxis], np.arange(n_tx)
    return row + column, (column - row) % (2 * n_tx)


def _newton_step(
    factor: ComplexArray, target: ComplexArray, indices: tuple[IntArray, IntArray]
) -> ComplexArray:
    """Solve sum_m (w_{m+l} conj(v_m) + v_{m+l} conj(w_m)) = r_l + r_l(w) for v, v_0 real."""
    n_tx = factor.shape[-1]
    padded = np.concatenate([factor, np.zeros_like(factor)], axis=-1)
    hankel = padded[..., indices[0]]
    toeplitz = np.conj(padded)[..., indices[1]]
    plus, minus = toeplitz + hankel, toeplitz - hankel
    # Real and imaginary parts are the unknowns; the imaginary part of v_0 and of lag 0 are none.
    system = np.empty((*factor.shape[:-1], 2 * n_tx - 1, 2 * n_tx - 1))
    system[..., :n_tx, :n_tx] = plus.real
    system[..., :n_tx, n_tx:] = -minus.imag[..., 1:]
    system[..., n_tx:, :n_tx] = plus.imag[..., 1:, :]
    system[..., n_tx:, n_tx:] = minus.real[..., 1:, 1:]
    right = np.concatenate([target.real, target.imag[..., 1:]], axis=-1)
    solved = np.linalg.solve(system, right[..., np.newaxis])[..., 0]
    step = solved[..., :n_tx].astype(complex)
    step[..., 1:] += 1j * solved[..., n_tx:]
    return step


def beam_of(columns: ComplexArray) -> ComplexArray:
    """Return one beam with the pattern and the power of columns columns^H, Eq. (38d).

    Parameters
    ----------
    columns
        ``(N, r)`` complex.

    Returns
    -------
    ComplexArray
        ``(N,)``; zero if the columns are.
    """
    strength = np.sum(np.abs(columns) ** 2, axis=0)
    strongest = int(np.argmax(strength))
    if np.sum(strength) - strength[strongest] <= NEGLIGIBLE * strength[strongest]:
        return columns[:, strongest]
    beam, _ = spectral_factor(autocorrelation(columns))
    return beam
