"""Radar of a run: what is measured of the objects in one slot.

Two sensors behind one call: Gaussian measurements at the Cramer-Rao bound, or a receiver that
processes the echo signal. The schemes do not know which.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.schemes.base import Decision
from echobeam.schemes.configure import fluctuation_of
from echobeam.simulation.randomness import Use, object_normals
from echobeam.simulation.signal_sensor import measure_signal
from echobeam.simulation.world import World
from echobeam.values import Array, BoolArray, ComplexArray


@dataclass(frozen=True, slots=True)
class Echoes:
    """Measurements of one slot as nature drew them.

    Attributes
    ----------
    snr
        ``(T, K)``: of each object's echo.
    value
        ``(T, K, M)`` rad, s, Hz; NaN where nothing was measured.
    variance
        ``(T, K, M)``: with which nature drew them; infinite where nothing was measured.
    strength
        ``(T or 1, K)``: power of the echo over its mean, 1 unless it fluctuates; the receiver sees
        it.
    reported
        ``(T, K, M)``: that the receiver states itself, where it processes a signal; else None, and
        the UAV evaluates the bound.
    """

    snr: Array
    value: Array
    variance: Array
    strength: Array
    reported: Array | None = None


def sense(world: World, decision: Decision) -> Echoes:
    """Return what the radar measures of the objects whose echoes are processed.

    Gaussian with the variance of the bound at the true state, Eqs. (17)-(24), or what the receiver
    makes of the echo signal, Eq. (11).
    """
    sent, law, scenario = decision.sent, world.scene.law, world.scene.scenario
    amplitude = fluctuation(world)
    strength = np.abs(amplitude) ** 2
    place = world.place
    snr = law.snr(sent, place) * strength
    asked = world.addressed(decision.addressee) & decision.sensed[:, None, :]
    processed = np.asarray(asked.any(axis=-1))
    variance = law.variance(sent, place, snr)
    variance = np.where(processed[..., None], variance, np.inf)
    if scenario.radar.model == "signal":
        value, reported = measure_signal(world, sent, amplitude, processed)
        missed = ~np.isfinite(value)
        return Echoes(snr, value, np.where(missed, np.inf, variance), strength, reported)
    measured: BoolArray = np.isfinite(variance)
    if not measured.any():
        return Echoes(snr, np.full(variance.shape, np.nan), variance, strength)
    luck = object_normals(
        world.seed, world.trials, world.slot, Use.MEASUREMENT, world.identity, variance.shape[-1]
    )
    noise = np.sqrt(np.where(measured, variance, 0.0)) * luck
    return Echoes(snr, np.where(measured, world.ideal() + noise, np.nan), variance, strength)


def fluctuation(world: World) -> ComplexArray:
    """Return each echo's amplitude relative to its mean power, ``(T or 1, K)``."""
    law = fluctuation_of(world.scene.scenario)
    if law.steady:
        return np.ones((1, world.identity.size), dtype=np.complex128)
    pair = object_normals(world.seed, world.trials, world.slot, Use.FLUCTUATION, world.identity, 2)
    return law.amplitude(pair)
