"""Climb of the expected sum rate: weighted mean square errors over the nodes.

For every node q of object k let S = own + noise be all the power that it receives and T = noise
what is not its own. Then log(1 + own / T) has a quadratic minorant in the beams, tight at the
present ones (Christensen et al. 2008; Shi et al. 2011), and the power constraint can be put into
the noise, ``loss |W|^2``, which makes the rate a function of the beams' shape alone. The largest
point of the sum of the minorants is

    (A + nu I) w_k = sum_q p_kq (c_kq^T w_k) / T_kq  c_kq,
    A = sum_kq p_kq own / (S T) c_kq c_kq^T,     nu = sum_kq p_kq own / (S T) loss_kq,

one linear system for all beams and polarisations, so that no step lowers the objective. Two such
steps are extrapolated (SQUAREM, Varadhan and Roland, Scand. J. Stat. 35, 2008), and the
extrapolated beams are taken where they are better.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.expected.objective import Received, normalised, received
from echobeam.beamforming.expected.places import Places
from echobeam.values import Array, ComplexArray

MOST_CYCLES = 60
"""Cycles of two steps each."""

GAIN = 1e-6
"""Relative gain of a cycle below which a climb ends."""

LEAST_SHIFT = 1e-14
"""Part of the trace that is added at least: beyond an SNR of 1e14 digits are lost."""


@dataclass(frozen=True, slots=True, eq=False)
class Climbed:
    """Beams ``(T, K, r)``, their expected sum rate ``(T,)`` nats, and the values on the way."""

    beams: ComplexArray
    value: Array
    history: list[Array]


def step(places: Places, at: Received) -> ComplexArray:
    """Return the largest point of the minorant: beams that are no worse, ``(T, P K, r)``."""
    trials, objects, count, size = places.channel.shape
    flat = places.channel.reshape(trials, objects * count, size)
    curvature = places.weight * at.own / (at.own + at.noise) / at.noise
    weighted = flat * curvature.reshape(trials, -1, 1)
    matrix = np.swapaxes(flat, -1, -2) @ weighted
    shift = np.sum(curvature * places.loss, axis=(-2, -1))
    trace = np.trace(matrix, axis1=-2, axis2=-1)
    shift = np.maximum(shift, LEAST_SHIFT * trace)
    pull = places.weight[:, :, None] * at.response / at.noise[:, :, None]
    right = (pull @ places.channel).reshape(trials, -1, size)  # (T, P K, r)
    # Of unit size, whatever the noise; a trial without beams has nothing to solve.
    scale = np.where(shift + trace > 0.0, shift + trace, 1.0)
    shift = np.where(shift > 0.0, shift / scale, 1.0)
    matrix = matrix / scale[:, None, None] + shift[:, None, None] * np.eye(size)
    largest = np.max(np.abs(right), axis=(-2, -1), keepdims=True, initial=0.0)
    right = right / np.where(largest > 0.0, largest, 1.0)
    sides = np.swapaxes(np.concatenate([right.real, right.imag], axis=1), -1, -2)
    solved = np.swapaxes(np.linalg.solve(matrix, sides), -1, -2)
    columns = right.shape[1]
    return normalised(solved[:, :columns] + 1j * solved[:, columns:])


def ascend(places: Places, beams: ComplexArray, cycles: int = MOST_CYCLES) -> Climbed:
    """Return the beams that a climb leads to; no step lowers the expected sum rate.

    Parameters
    ----------
    places
        Of T trials.
    beams
        ``(T, P K, r)``: where to start. What is zero stays zero.
    cycles
        Largest number of cycles.
    """
    best = normalised(beams)
    at = received(places, best)
    value = at.value.copy()
    history = [value.copy()]
    running = np.arange(len(places))
    here, now, place = best.copy(), at, places
    for _ in range(cycles):
        here, now, before = *_cycle(place, here, now), now.value
        best[running], value[running] = here, now.value
        history.append(value.copy())
        going = np.flatnonzero(now.value - before > GAIN * np.abs(now.value))
        if going.size == 0:
            break
        if going.size < running.size:
            running, place, here = running[going], place.taken(going), here[going]
            now = Received(now.response[going], now.own[going], now.noise[going], now.value[going])
    return Climbed(best, value, history)


def _cycle(places: Places, start: ComplexArray, at: Received) -> tuple[ComplexArray, Received]:
    """Return beams after two steps and an extrapolation, never worse than before."""
    first = step(places, at)
    second = step(places, received(places, first))
    reached = received(places, second)
    change, bend = first - start, second - 2.0 * first + start
    length = np.sqrt(_squared(change) / np.maximum(_squared(bend), np.finfo(float).tiny))
    length = np.clip(length, 1.0, 100.0)[:, None, None]
    far = normalised(start + 2.0 * length * change + length**2 * bend)
    beyond = received(places, far)
    ahead = beyond.value > reached.value
    beams, now = np.where(ahead[:, None, None], far, second), beyond.where(ahead, reached)
    keeps = now.value >= at.value  # but for rounding it always does
    return np.where(keeps[:, None, None], beams, start), now.where(keeps, at)


def _squared(beams: ComplexArray) -> Array:
    total: Array = np.sum(beams.real**2 + beams.imag**2, axis=(-2, -1))
    return total
