"""Cramer-Rao bound of all echoes of a slot together, at the estimates.

Each echo has A + 4 unknowns: direction (A = 1, of a planar array 2), delay, Doppler, and a complex
amplitude. In white noise the
Fisher information is J = 2 / sigma^2 Re(D^H D), D the derivatives of the signal. These are sums of
products of a vector over the antennas and one over the grid, so that their inner products are
products of two small ones. Echoes apart by more than a cell have the bound of a single one; closer
ones lose accuracy to each other, without limit as they merge.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from echobeam.sensing.directions import beam_sizes, slopes_of, steering
from echobeam.sensing.target import Point, Receiver
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

MOST_CELLS = 0.2
"""Largest standard deviation stated, resolution cells; a single echo at 11 dB has 0.11."""


class Derivatives(NamedTuple):
    """Derivatives of a slot's signal by all unknowns of D echoes, as sums of products.

    Attributes
    ----------
    antennas
        ``(T, (1 + A) D, N_r)``: b and its derivatives by u.
    grid
        ``(T, (3 + A) D, N M)``: what lights the target and its derivatives by u, tau and mu.
    at_antenna, at_grid
        ``((3 + 2 A) D,)``: which two make each product.
    combined
        ``(T, (3 + 2 A) D, (4 + A) D)``: products of each unknown (column); its order in each echo
        is u, tau, mu, and real and imaginary part of the amplitude.
    """

    antennas: ComplexArray
    grid: ComplexArray
    at_antenna: IntArray
    at_grid: IntArray
    combined: ComplexArray

    def information(self, noise: float) -> Array:
        """Return the Fisher information ``(T, (4 + A) D, (4 + A) D)``."""
        over_antennas = np.conj(self.antennas) @ np.swapaxes(self.antennas, -1, -2)
        over_grid = np.conj(self.grid) @ np.swapaxes(self.grid, -1, -2)
        i, j = self.at_antenna, self.at_grid
        products = over_antennas[:, i[:, None], i] * over_grid[:, j[:, None], j]
        adjoint = np.conj(np.swapaxes(self.combined, -1, -2))
        found: Array = 2.0 / noise * np.real(adjoint @ products @ self.combined)
        return found

    def gradient(self, residual: ComplexArray, noise: float) -> Array:
        """Return the slope of the log-likelihood at a residual ``(T, N_r, N M)``."""
        over_grid = np.conj(self.antennas) @ residual  # (T, (1 + A) D, N M)
        over_both = over_grid @ np.conj(np.swapaxes(self.grid, -1, -2))
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
    axes = known.receiver.axes
    products, unknowns = 3 + 2 * axes, 4 + axes
    combined = np.zeros((trials, products * count, unknowns * count), dtype=np.complex128)
    for place, point in enumerate(points):
        row, column = products * place, unknowns * place
        for axis in range(axes):
            combined[:, row + 1 + axis, column + axis] = point.amplitude
            combined[:, row + 1 + axes + axis, column + axis] = point.amplitude
        for other in range(2):  # delay and Doppler
            place_of = row + 1 + 2 * axes + other
            combined[:, place_of, column + axes + other] = point.amplitude
        combined[:, row, column + axes + 2] = 1.0
        combined[:, row, column + axes + 3] = 1j
    echo = np.repeat(np.arange(count), products)
    own = range(1, 1 + axes)
    antenna = [0, *own, *[0] * (2 + axes)]
    grid = [0] * (1 + axes) + [*own, 1 + axes, 2 + axes]
    return Derivatives(
        np.where(used, over_antennas, 0.0).reshape(trials, (1 + axes) * count, -1),
        np.where(used, over_grid, 0.0).reshape(trials, (3 + axes) * count, -1),
        (1 + axes) * echo + np.tile(antenna, count),
        (3 + axes) * echo + np.tile(grid, count),
        combined,
    )


def stated_variance(points: Sequence[Point], valid: Sequence[BoolArray], known: Receiver) -> Array:
    """Return the bound on angle, delay and Doppler, rad^2, s^2 and Hz^2, ``(T, D, A + 2)``.

    Of a planar array the direction cosines take the place of the angle.

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
    array, wave = known.receiver, known.waveform
    every = _inverse_diagonal(information).reshape(*passed.shape, 4 + array.axes)
    variance = every[..., : array.axes + 2]
    in_cells = variance * np.square([*beam_sizes(array), wave.bandwidth, wave.duration])
    told_apart = (in_cells <= MOST_CELLS**2) | ~np.isfinite(variance)
    if array.axes == 1:
        u = np.stack([one.u for one in points], axis=-1)
        with np.errstate(divide="ignore"):
            variance[..., 0] /= 1.0 - u**2  # (du / dtheta)^2 of either axis
    reliable = passed & told_apart.all(axis=-1)
    return np.where(reliable[..., None], variance, np.inf)


def _antennas(u: Array, known: Receiver) -> ComplexArray:
    """Return b and db / du, ``(T, 1 + A, N_r)``."""
    b = steering(known.receiver, u)
    # around the array's middle, where direction and phase of an echo are told apart
    slopes = slopes_of(known.receiver)
    slopes = slopes - slopes.mean(axis=-1, keepdims=True)
    found: ComplexArray = np.stack([b, *(1j * one * b for one in slopes)], axis=1)
    return found


def _grid(point: Point, known: Receiver) -> ComplexArray:
    """Return what lights the target and its derivatives by u, tau and mu, ``(T, 3 + A, N M)``."""
    f, t = known.waveform.places()
    phases = known.waveform.phases(point.delay, point.doppler)
    adjoint = np.conj(steering(known.transmitter, point.u))
    turning = (-1j * one * adjoint for one in slopes_of(known.transmitter))
    mixture = np.stack([adjoint, *turning], axis=1) @ known.precoder
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
