"""Nature in one slot of a block of trials: it knows the truth and decides nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echobeam.physics.geometry import polar_state
from echobeam.physics.link import channel_loss, rate, sinr
from echobeam.physics.measurement import measure
from echobeam.schemes.base import Decision
from echobeam.simulation.movers import Ground
from echobeam.simulation.randomness import Use, object_normals
from echobeam.simulation.scene import Scene
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    ComplexArray,
    IntArray,
    UavState,
    freeze,
)


@dataclass(frozen=True, slots=True)
class Link:
    """Downlink of one slot: ``(T, K)`` each."""

    sinr: Array
    rate: Array


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
    reported
        ``(T, K, M)``: that the receiver states itself, where it processes a signal; else None, and
        the UAV evaluates the bound.
    """

    snr: Array
    value: Array
    variance: Array
    reported: Array | None = None


@dataclass(frozen=True, slots=True)
class World:
    """Nature in one slot, for a block of trials.

    Attributes
    ----------
    scene
        Everything that the trials have in common.
    seed, trials
        Key of the draws.
    slot
        Counted from 0.
    uav
        The UAV.
    ground
        The objects in ground coordinates.
    state
        ``(T or 1, K, S)``: the objects as seen from the UAV; NaN where nobody is.
    """

    scene: Scene
    seed: int
    trials: range
    slot: int
    uav: UavState
    ground: Ground
    state: Array

    @property
    def identity(self) -> IntArray:
        """``(K,)``: who is in each column."""
        return self.ground.identity

    @property
    def present(self) -> BoolArray:
        """``(K,)``: whether somebody is."""
        present: BoolArray = self.ground.identity != NOBODY
        return present

    def link(self, decision: Decision) -> Link:
        """Return SINR and rate at the true channel, Eqs. (7), (8), (10)."""
        radio = self.scene.scenario.radio
        loss = channel_loss(self.state[..., 1], radio.noise, radio.alpha0)
        own = self._addressed(decision)
        ratio = sinr(decision.sent, own, self.state[..., 0], loss, self.scene.law.transmitter)
        return Link(ratio, rate(ratio))

    def sense(self, decision: Decision) -> Echoes:
        """Return what the radar measures of the objects whose echoes are processed.

        Gaussian with the variance of the bound at the true state, Eqs. (17)-(24), or what the
        receiver makes of the echo signal, Eq. (11).
        """
        sent, law, radar = decision.sent, self.scene.law, self.scene.scenario.radar
        amplitude = self.fluctuation()
        snr = law.snr(sent, self.state) * np.abs(amplitude) ** 2
        asked = self._addressed(decision) & decision.sensed[:, None, :]
        processed = np.asarray(asked.any(axis=-1))
        variance = law.variance(sent, self.state, snr)
        variance = np.where(processed[..., None], variance, np.inf)
        measured: BoolArray = np.isfinite(variance)
        if radar.model == "signal":
            from echobeam.simulation.signal_sensor import measure_signal

            value, reported = measure_signal(self, sent, amplitude, processed)
            missed = ~np.isfinite(value)
            return Echoes(snr, value, np.where(missed, np.inf, variance), reported)
        if not measured.any():
            return Echoes(snr, np.full(variance.shape, np.nan), variance)
        luck = object_normals(
            self.seed, self.trials, self.slot, Use.MEASUREMENT, self.identity, variance.shape[-1]
        )
        noise = np.sqrt(np.where(measured, variance, 0.0)) * luck
        ideal = measure(
            self.state[..., 0],
            self.state[..., 1],
            self.state[..., 2],
            self.uav.speed,
            self.uav.heading,
            self.scene.scenario.radio.carrier,
        )
        return Echoes(snr, np.where(measured, ideal + noise, np.nan), variance)

    def fluctuation(self) -> ComplexArray:
        """Return each echo's amplitude relative to its mean power, ``(T or 1, K)``."""
        if self.scene.scenario.radar.fluctuation == "none":
            return np.ones((1, self.identity.size), dtype=np.complex128)
        pair = object_normals(self.seed, self.trials, self.slot, Use.FLUCTUATION, self.identity, 2)
        drawn: ComplexArray = (pair[..., 0] + 1j * pair[..., 1]) / np.sqrt(2.0)
        return drawn

    def advance(self) -> World:
        """Return nature one slot later."""
        ground = self.scene.mover.advance(self.ground, self.slot, self.uav, self.seed, self.trials)
        return _seen(replace(self, slot=self.slot + 1, ground=ground))

    def _addressed(self, decision: Decision) -> BoolArray:
        """Return ``(T, K, C)``: whether a stream is for an object."""
        addressed: BoolArray = (
            decision.addressee[:, None, :] == self.identity[:, None]
        ) & self.present[:, None]
        return addressed


def begin(scene: Scene, seed: int, trials: range) -> World:
    """Return nature in the first slot of some trials."""
    ground = scene.mover.begin()
    nothing = np.empty(0)
    return _seen(World(scene, seed, trials, 0, scene.flight.at(0), ground, nothing))


def _seen(world: World) -> World:
    """Return nature with the UAV in its slot and the objects as seen from there."""
    uav = world.scene.flight.at(world.slot)
    state = polar_state(world.ground.position, world.ground.velocity, uav)
    ground = world.ground
    freeze(state, ground.position, ground.velocity, ground.identity, uav.position, uav.velocity)
    return replace(world, uav=uav, state=state)
