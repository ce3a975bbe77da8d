"""Cramer-Rao bound of all echoes of a slot together, at the estimates.

Each echo has five unknowns: direction, delay, Doppler, and a complex amplitude. In white noise the
Fisher information is J = 2 / sigma^2 Re(D^H D), D the derivatives of the signal. These are sums of
products of a vector over the antennas and one over the grid, so that their inner products are
products of two small ones. Echoes apart by more than a cell have the bound of a single one; closer
ones lose accuracy to each other, without limit as they merge.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from echobeam.sensing.directions import rates, steering
from echobeam.sensing.refine import Point, Receiver
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

MOST_CELLS = 0.2
"""Largest standard deviation stated, resolution cells; a single echo at 11 dB has 0.11."""

_ANTENNA = (0, 1, 0, 0, 0)
"""Of the five products of an echo, the vector over antennas: b, or db / du."""

_GRID = (0, 0, 1, 2, 3)
"""And that over the grid: r, dr / du, dr / dtau, dr / dmu, with the phases of delay and Doppler."""


class Derivatives(NamedTuple):
    """Derivatives of a slot's signal by all unknowns of D echoes, as sums of products.

    Attributes
    ----------
    antennas
        ``(T, 2 D, N_r)``.
    grid
        ``(T, 4 D, N M)``.
    at_antenna, at_grid
        ``(5 D,)``: which two make each product.
    combined
        ``(T, 5 D, 5 D)``: products of each unknown (column); its order in each echo is u, tau, mu,
        and real and imaginary part of the amplitude.
    """

    antennas: ComplexArray
    grid: ComplexArray
    at_antenna: IntArray
    at_grid: IntArray
    combined: ComplexArray

    def information(self, noise: float) -> Array:
        """Return the Fisher information ``(T, 5 D, 5 D)``."""
        over_antennas = np.conj(self.antennas) @ np.swapaxes(self.antennas, -1, -2)
        over_grid = np.conj(self.grid) @ np.swapaxes(self.grid, -1, -2)
        i, j = self.at_antenna, self.at_grid
        products = over_antennas[:, i[:, None], i] * over_grid[:, j[:, None], j]
        adjoint = np.conj(np.swapaxes(self.combined, -1, -2))
        found: Array = 2.0 / noise * np.real(adjoint @ products @ self.combined)
        return found

    def gradient(self, residual: ComplexArray, noise: float) -> Array:
        """Return the slope of the log-likelihood at a residual ``(T, N_r, N M)``, ``(T, 5 D)``."""
        over_grid = np.conj(self.antennas) @ residual  # (T, 2 D, N M)
        over_both = over_grid @ np.conj(np.swapaxes(self.grid, -1, -2))  # (T, 2 D, 4 D)
        products = over_both[:, self.at_antenna, self.at_grid]
        adjoint = np.conj(np.swapaxes(self.combined, -1, -2))
        found: Array = 2.0 / noise * np.real(adjoint @ products[..., None])[..., 0]
        return found


def derivatives(
    points: Sequence[Point], valid: Sequence[BoolArray], known: Receiver
) -> Derivatives:
    """Return the derivatives at D estimates of ``(T,)``; zero where an echo is not valid."""
    passed = np.stack(valid, axis=-1)
    trials, count = passed.shape
    used = passed[:, :, None, None]
    over_antennas = np.stack([_antennas(one.u, known) for one in points], axis=1)
    over_grid = np.stack([_grid(one, known) for one in points], axis=1)
    combined = np.zeros((trials, 5 * count, 5 * count), dtype=np.complex128)
    for place, point in enumerate(points):
        first = 5 * place
        combined[:, first + 1, first] = combined[:, first + 2, first] = point.amplitude
        combined[:, first + 3, first + 1] = combined[:, first + 4, first + 2] = point.amplitude
        combined[:, first, first + 3], combined[:, first, first + 4] = 1.0, 1j
    echo = np.repeat(np.arange(count), 5)
    return Derivatives(
        np.where(used, over_antennas, 0.0).reshape(trials, 2 * count, -1),
        np.where(used, over_grid, 0.0).reshape(trials, 4 * count, -1),
        2 * echo + np.tile(_ANTENNA, count),
        4 * echo + np.tile(_GRID, count),
        combined,
    )


def stated_variance(points: Sequence[Point], valid: Sequence[BoolArray], known: Receiver) -> Array:
    """Return the bound on angle, delay and Doppler, rad^2, s^2 and Hz^2, ``(T, D, 3)``.

    Infinite where an echo is not valid, or so close to another that the bound is above a share of
    a resolution cell: there the likelihood has several maxima, and no estimator is on its bound.

    Parameters
    ----------
    points
        D estimates of ``(T,)``.
    valid
        Which of them are echoes.
    known
        The receiver.
    """
    passed = np.stack(valid, axis=-1)
    information = derivatives(points, valid, known).information(known.noise)
    variance = _inverse_diagonal(information).reshape(*passed.shape, 5)[..., :3]
    array, wave = known.receiver, known.waveform
    in_cells = variance * np.square([array.n * array.spacing, wave.bandwidth, wave.duration])
    told_apart = (in_cells <= MOST_CELLS**2) | ~np.isfinite(variance)
    u = np.stack([one.u for one in points], axis=-1)
    with np.errstate(divide="ignore"):
        variance[..., 0] /= 1.0 - u**2  # (du / dtheta)^2 of either axis
    reliable = passed & told_apart.all(axis=-1)
    return np.where(reliable[..., None], variance, np.inf)


def _antennas(u: Array, known: Receiver) -> ComplexArray:
    """Return b and db / du, ``(T, 2, N_r)``."""
    b = steering(known.receiver, u)
    # around the array's middle, where direction and phase of an echo are told apart
    slopes = rates(known.receiver)
    slopes = slopes - slopes.mean()
    found: ComplexArray = np.stack([b, 1j * slopes * b], axis=1)
    return found


def _grid(point: Point, known: Receiver) -> ComplexArray:
    """Return what lights the target and its derivatives by u, tau and mu, ``(T, 4, N M)``."""
    f, t = known.waveform.places()
    phases = known.waveform.phases(point.delay, point.doppler)
    adjoint = np.conj(steering(known.transmitter, point.u))
    turning = -1j * rates(known.transmitter) * adjoint
    mixture = np.stack([adjoint, turning], axis=1) @ known.precoder
    lit = (mixture @ known.streams) * phases.reshape(len(phases), 1, -1)
    over_f = np.repeat(-2j * np.pi * f, t.size)
    over_t = np.tile(2j * np.pi * t, f.size)
    found: ComplexArray = np.concatenate([lit, lit[:, :1] * over_f, lit[:, :1] * over_t], axis=1)
    return found


def _inverse_diagonal(information: Array) -> Array:
    """Return the diagonal of the inverse; infinite where there is no information."""
    diagonal = np.diagonal(information, axis1=-2, axis2=-1)
    known = diagonal > 0.0
    scale = np.where(known, 1.0 / np.sqrt(np.where(known, diagonal, 1.0)), 0.0)
    unit = information * scale[..., :, None] * scale[..., None, :]
    unit = unit + np.eye(unit.shape[-1]) * ~known[..., None, :]
    values, vectors = np.linalg.eigh(unit)
    lost = values < values.shape[-1] * 1e-12  # dependent to within rounding
    inverse = np.where(lost, np.inf, 1.0 / np.where(lost, 1.0, values))
    with np.errstate(invalid="ignore"):
        terms = np.where(vectors**2 > 1e-24, vectors**2 * inverse[..., None, :], 0.0)
    variance: Array = np.where(known, terms.sum(axis=-1) * scale**2, np.inf)
    return variance
