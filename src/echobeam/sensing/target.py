"""Point target in the signal of a slot: what a receiver knows, what it compresses and rebuilds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.physics.planar import AntennaArray
from echobeam.physics.waveform import Waveform
from echobeam.sensing.directions import steering
from echobeam.values import Array, ComplexArray, IntArray


class Point(NamedTuple):
    """Point target: direction u, delay s, Doppler Hz and complex amplitude, ``(T,)`` each.

    Of a planar array u is ``(T, 2)``.

    ``statistic`` is the likelihood ratio, under noise alone exponential with mean 1 at one point.
    """

    u: Array
    delay: Array
    doppler: Array
    amplitude: ComplexArray
    statistic: Array

    def of(self, trials: IntArray) -> Point:
        """Return the points of some trials."""
        return Point(
            self.u[trials], self.delay[trials], self.doppler[trials], self.amplitude[trials],
            self.statistic[trials],
        )  # fmt: skip

    def replaced(self, trials: IntArray, better: Point) -> Point:
        """Return the points with those of some trials replaced."""
        whole = Point(
            self.u.copy(), self.delay.copy(), self.doppler.copy(), self.amplitude.copy(),
            self.statistic.copy(),
        )  # fmt: skip
        whole.u[trials], whole.delay[trials] = better.u, better.delay
        whole.doppler[trials], whole.amplitude[trials] = better.doppler, better.amplitude
        whole.statistic[trials] = better.statistic
        return whole


class Receiver(NamedTuple):
    """What a receiver knows of a slot: arrays, grid, what was sent, and its noise.

    ``streams`` is ``(T, L, N M)``, ``precoder`` ``(T, N_t, L)``, ``gram`` ``(T, L, L)`` the inner
    products of the streams, ``noise`` the variance in one resource element of one antenna.
    """

    transmitter: AntennaArray
    receiver: AntennaArray
    waveform: Waveform
    streams: ComplexArray
    precoder: ComplexArray
    gram: ComplexArray
    noise: float


def at(signal: ComplexArray, u: Array, delay: Array, doppler: Array, known: Receiver) -> Point:
    """Return the point target of given parameters with its most likely amplitude."""
    lit = np.sum(np.abs(replica(u, known)) ** 2, axis=-1)
    c = np.sum(compress(signal, u, known) * conjugate(delay, doppler, known.waveform), axis=-1)
    energy = np.where(lit > 0.0, lit, np.inf) * known.receiver.n
    return Point(u, delay, doppler, c / energy, np.abs(c) ** 2 / (energy * known.noise))


def replica(u: Array, known: Receiver) -> ComplexArray:
    """Return r, what illuminates a target in a direction ``(T,)``: ``(T, N M)``."""
    mixture = np.conj(steering(known.transmitter, u))[:, None, :] @ known.precoder
    lit: ComplexArray = (mixture @ known.streams)[:, 0]
    return lit


def compress(signal: ComplexArray, u: Array, known: Receiver) -> ComplexArray:
    """Return b(u)^H y r^*, ``(T, N M)``."""
    beamformed = (np.conj(steering(known.receiver, u))[:, None, :] @ signal)[:, 0]
    product: ComplexArray = beamformed * np.conj(replica(u, known))
    return product


def rebuilt(point: Point, known: Receiver) -> ComplexArray:
    """Return the signal of a point target, ``(T, N_r, N M)``."""
    phases = np.conj(conjugate(point.delay, point.doppler, known.waveform))
    lit = point.amplitude[:, None] * replica(point.u, known) * phases
    signal: ComplexArray = steering(known.receiver, point.u)[:, :, None] * lit[:, None, :]
    return signal


def conjugate(delay: Array, doppler: Array, waveform: Waveform) -> ComplexArray:
    """Return phi^*, ``(T, N M)``."""
    phases = waveform.phases(delay, doppler)
    flat: ComplexArray = np.conj(phases).reshape(*phases.shape[:-2], -1)
    return flat
