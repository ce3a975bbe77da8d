"""Refinement of an echo's delay, Doppler and direction on the likelihood of one point target.

With unknown amplitude in white noise the likelihood ratio is |c|^2 / (noise N_r |r|^2),

    c = sum_nm b(u)^H y_nm (a(u)^H F s_nm)^* phi_nm(tau, mu)^*,   r_nm = a(u)^H F s_nm.

Delay and Doppler take Newton's steps, the direction Fisher's scoring, in turns; the three do not
couple in the mean. Steps are bounded by half of a cell of the search.
"""

from __future__ import annotations

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.waveform import Waveform
from echobeam.sensing.directions import rates, steering
from echobeam.sensing.planar_steps import planar_step
from echobeam.sensing.target import Point, Receiver, at, compress, conjugate
from echobeam.values import Array, ComplexArray

ROUNDS = 8
_BOUND = 0.5


def refine(signal: ComplexArray, start: Point, known: Receiver, rounds: int = ROUNDS) -> Point:
    """Return the maximum of the likelihood near a start.

    Parameters
    ----------
    signal
        ``(T, N_r, N M)``.
    start
        Within half of a cell of the maximum in each parameter.
    known
        The receiver.
    rounds
        Of steps in delay and Doppler, and in direction.
    """
    u, delay, doppler = start.u, start.delay, start.doppler
    for _ in range(rounds):
        compressed = compress(signal, u, known)
        delay, doppler = _delay_doppler_step(compressed, delay, doppler, known.waveform)
        u = _direction_step(signal, u, delay, doppler, known)
    return at(signal, u, delay, doppler, known)


def _delay_doppler_step(
    compressed: ComplexArray, delay: Array, doppler: Array, waveform: Waveform
) -> tuple[Array, Array]:
    """Return delay and Doppler after one of Newton's steps on log |c|^2.

    The logarithm is concave over the whole main lobe, and delay and Doppler separate in it, where
    |c|^2 itself is neither.
    """
    f, t = waveform.places()
    turned = compressed * conjugate(delay, doppler, waveform)
    grid = turned.reshape(*turned.shape[:-1], f.size, t.size)
    wf, wt = 2j * np.pi * f, -2j * np.pi * t
    over_t = grid.sum(axis=-1)
    moved = grid @ wt
    c = over_t.sum(axis=-1)
    c = np.where(c == 0.0, np.finfo(np.float64).tiny, c)
    c_f, c_t = over_t @ wf / c, moved.sum(axis=-1) / c
    gradient = 2.0 * np.real(np.stack([c_f, c_t]))
    h_ff = 2.0 * np.real(over_t @ wf**2 / c - c_f**2)
    h_ft = 2.0 * np.real(moved @ wf / c - c_f * c_t)
    h_tt = 2.0 * np.real((grid @ wt**2).sum(axis=-1) / c - c_t**2)
    # Newton where it is concave, else along the expected curvature
    determinant = h_ff * h_tt - h_ft**2
    concave = (h_ff < 0.0) & (h_tt < 0.0) & (determinant > 0.0)
    smallest = np.finfo(np.float64).tiny
    expected_f = -2.0 * max(float(np.mean(np.abs(wf) ** 2)), smallest)
    expected_t = -2.0 * max(float(np.mean(np.abs(wt) ** 2)), smallest)
    safe = np.where(concave, determinant, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        step_f = np.where(
            concave, (h_tt * gradient[0] - h_ft * gradient[1]) / safe, gradient[0] / expected_f
        )
        step_t = np.where(
            concave, (h_ff * gradient[1] - h_ft * gradient[0]) / safe, gradient[1] / expected_t
        )
    most_f, most_t = _BOUND / waveform.bandwidth, _BOUND / waveform.duration
    return (
        delay - np.clip(np.nan_to_num(step_f), -most_f, most_f),
        doppler - np.clip(np.nan_to_num(step_t), -most_t, most_t),
    )


def _direction_step(
    signal: ComplexArray, u: Array, delay: Array, doppler: Array, known: Receiver
) -> Array:
    """Return the direction after one step of scoring on |c|^2 / |r|^2."""
    if isinstance(known.receiver, LinearArray):
        return _linear_step(signal, u, delay, doppler, known)
    return planar_step(signal, u, delay, doppler, known)


def _linear_step(
    signal: ComplexArray, u: Array, delay: Array, doppler: Array, known: Receiver
) -> Array:
    """Return the direction of a linear array after one step."""
    turned = signal * conjugate(delay, doppler, known.waveform)[:, None, :]
    correlated = turned @ np.conj(np.swapaxes(known.streams, -1, -2))  # (T, N_r, L)
    transmitter, receiver = known.transmitter, known.receiver
    assert isinstance(transmitter, LinearArray)
    assert isinstance(receiver, LinearArray)
    a, b = steering(transmitter, u), steering(receiver, u)
    da, db = 1j * rates(transmitter) * a, 1j * rates(receiver) * b
    adjoint = np.conj(np.swapaxes(known.precoder, -1, -2))
    f, df = (adjoint @ one[..., None] for one in (a, da))  # (T, L, 1)
    row, drow = (np.conj(one)[:, None, :] @ correlated for one in (b, db))
    c = (row @ f)[:, 0, 0]
    dc = (drow @ f + row @ df)[:, 0, 0]
    lit = np.real(np.conj(np.swapaxes(f, -1, -2)) @ known.gram @ f)[:, 0, 0]
    dlit = 2.0 * np.real(np.conj(np.swapaxes(df, -1, -2)) @ known.gram @ f)[:, 0, 0]
    shared = (np.conj(np.swapaxes(f, -1, -2)) @ known.gram @ df)[:, 0, 0]
    spread = np.real(np.conj(np.swapaxes(df, -1, -2)) @ known.gram @ df)[:, 0, 0]
    positive = np.where(lit > 0.0, lit, 1.0)
    power = np.abs(c) ** 2
    slope = 2.0 * np.real(np.conj(c) * dc) / positive - power * dlit / positive**2
    aperture = float(np.var(rates(receiver)))
    transmit = np.maximum(spread / positive - np.abs(shared) ** 2 / positive**2, 0.0)
    curvature = 2.0 * power / positive * (aperture + transmit)
    step = np.where(curvature > 0.0, slope / np.where(curvature > 0.0, curvature, 1.0), 0.0)
    most = _BOUND / (2.0 * max(receiver.n, transmitter.n))
    low, high = receiver.visible
    moved: Array = np.clip(u + np.clip(step, -most, most), low, high)
    return moved
