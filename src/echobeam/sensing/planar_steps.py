"""Scoring of both direction cosines of a planar array, the matrix version of the linear step."""

from __future__ import annotations

import numpy as np

from echobeam.sensing.directions import beam_sizes, slopes_of, steering, within
from echobeam.sensing.target import Receiver, conjugate
from echobeam.values import Array, ComplexArray

_BOUND = 0.25
"""Longest step, in widths of a beam."""


def planar_step(
    signal: ComplexArray, u: Array, delay: Array, doppler: Array, known: Receiver
) -> Array:
    """Return the direction cosines ``(T, 2)`` after one step of scoring on |c|^2 / |r|^2.

    Parameters
    ----------
    signal
        ``(T, N_r, N M)``.
    u, delay, doppler
        ``(T, 2)``, ``(T,)``, ``(T,)``: where the target is thought to be.
    known
        The receiver.
    """
    turned = signal * conjugate(delay, doppler, known.waveform)[:, None, :]
    correlated = turned @ np.conj(np.swapaxes(known.streams, -1, -2))  # (T, N_r, L)
    a, b = steering(known.transmitter, u), steering(known.receiver, u)
    da = 1j * slopes_of(known.transmitter) * a[:, None, :]  # (T, 2, N_t)
    db = 1j * slopes_of(known.receiver) * b[:, None, :]
    F = np.conj(known.precoder)
    f, df = a[:, None, :] @ F, da @ F  # rows (F^H a)^T
    row, drow = np.conj(b)[:, None, :] @ correlated, np.conj(db) @ correlated
    c = np.sum(row * f, axis=-1)  # (T, 1)
    dc = np.sum(drow * f + row * df, axis=-1)  # (T, 2)
    weighted = np.conj(f) @ known.gram
    lit = np.maximum(np.real(np.sum(weighted * f, axis=-1)), np.finfo(np.float64).tiny)
    shared = (weighted @ np.swapaxes(df, -1, -2))[:, 0]  # f^H G df
    spread = np.real(np.conj(df) @ known.gram @ np.swapaxes(df, -1, -2))
    power = np.abs(c) ** 2
    slope = 2.0 * np.real(np.conj(c) * dc) / lit - power * 2.0 * np.real(shared) / lit**2
    transmit = spread / lit[..., None]
    transmit -= np.real(np.conj(shared)[:, :, None] * shared[:, None, :]) / lit[..., None] ** 2
    rates = slopes_of(known.receiver)
    curvature = 2.0 * (power / lit)[..., None] * (np.cov(rates, bias=True) + transmit)
    step = _solved(curvature, slope)
    most = _BOUND / np.maximum(beam_sizes(known.receiver), beam_sizes(known.transmitter))
    return within(known.receiver, u + np.clip(step, -most, most))


def _solved(curvature: Array, slope: Array) -> Array:
    """Return the solution ``(T, 2)`` of two equations; zero along an axis without information."""
    diagonal = np.diagonal(curvature, axis1=-2, axis2=-1)
    seen = diagonal > 1e-12 * diagonal.max(axis=-1, keepdims=True)
    both = seen[:, :, None] & seen[:, None, :]
    safe = np.where(both, curvature, np.eye(2))
    found: Array = np.linalg.solve(safe, np.where(seen, slope, 0.0)[..., None])[..., 0]
    return found
