"""What nature does: transmit, echo, measure. It knows the truth and decides nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.physics import transmission as transmissions
from echobeam.physics.bounds import effective_variance, measurement_variance
from echobeam.physics.echo import echo_snr
from echobeam.physics.link import rate, sinr
from echobeam.physics.measurement import measure
from echobeam.scenario.model import Scenario
from echobeam.simulation.motion import Motion
from echobeam.values import (
    Array,
    BoolArray,
    ComplexArray,
    Measurement,
    Phase,
    Transmission,
    UavMotion,
    freeze,
)


@dataclass(frozen=True, slots=True)
class Link:
    """What the objects receive: ``(T, K)`` each."""

    sinr: Array
    rate: Array


@dataclass(frozen=True, slots=True)
class World:
    """Nature for a block of trials.

    Attributes
    ----------
    scenario
        Which array, radio and radar.
    motion
        The truth.
    luck
        ``(T, n, K, M)`` standard normals of the measurement noise.
    """

    scenario: Scenario
    motion: Motion
    luck: Array

    def truth(self, slot: int) -> Array:
        """Return the true states ``(T, K, S)`` in a slot, counted from 0."""
        shape = (self.luck.shape[0], *self.motion.truth.shape[2:])
        return np.broadcast_to(self.motion.truth[:, slot], shape)

    def present(self, slot: int) -> BoolArray:
        """Return ``(T, K)``: who is in the scene."""
        row = self.motion.present[slot]
        return np.broadcast_to(row, (self.luck.shape[0], row.shape[0]))

    def transmission(self, phase: Phase, beams: ComplexArray, slot: int) -> Transmission:
        """Return what is sent: streams on uncorrelated antennas, or beams, Eqs. (2), (6).

        A pilot is the omnidirectional transmission without data.
        """
        if phase == "directional":
            return transmissions.directional(beams)
        omni = transmissions.omni(
            self.present(slot), self.scenario.radio.power, self.scenario.array.n_tx
        )
        if phase == "omni":
            return omni
        return Transmission(
            beams=omni.beams,
            antenna_power=np.zeros_like(omni.antenna_power),
            probing=omni.probing + omni.antenna_power.sum(axis=-2),
        )

    def transmit(self, sent: Transmission, truth: Array) -> Link:
        """Return SINR and rate at the true channel, Eqs. (7), (8), (10)."""
        radio, array = self.scenario.radio, self.scenario.array
        ratio = sinr(
            sent,
            truth[..., 0],
            truth[..., 1],
            noise=radio.noise,
            alpha0=radio.alpha0,
            spacing=array.spacing,
            axis=array.axis,
        )
        return Link(ratio, rate(ratio))

    def echo(self, sent: Transmission, truth: Array) -> Array:
        """Return the echo SNR ``(T, K)`` at the true state, Eqs. (14), (16)."""
        radar, array = self.scenario.radar, self.scenario.array
        return echo_snr(
            sent,
            truth[..., 0],
            truth[..., 1],
            rcs=complex(*radar.rcs),
            gain=radar.gain,
            noise=radar.noise,
            spacing=array.spacing,
            axis=array.axis,
        )

    def measure(
        self,
        sent: Transmission,
        snr: Array,
        truth: Array,
        listened: BoolArray,
        uav: UavMotion,
        slot: int,
    ) -> Measurement:
        """Return the measurements of the echoes listened to, Eqs. (17)-(24)."""
        radar, array = self.scenario.radar, self.scenario.array
        bound = measurement_variance(
            sent,
            truth[..., 0],
            snr,
            crb=radar.crb,
            n_rx=array.n_rx,
            bandwidth=radar.bandwidth,
            pulse_length=radar.pulse_length,
            spacing=array.spacing,
            axis=array.axis,
        )
        heard = (listened & self.present(slot))[..., None]
        variance = np.where(heard, effective_variance(bound, snr), np.inf)
        variance = np.where(np.isnan(variance), np.inf, variance)
        measured = np.isfinite(variance)
        noise = np.sqrt(np.where(measured, variance, 0.0)) * self.luck[:, slot]
        ideal = measure(
            truth[..., 0],
            truth[..., 1],
            truth[..., 2],
            uav.speed,
            uav.heading,
            self.scenario.radio.carrier,
        )
        value = np.where(measured, ideal + noise, np.nan)
        freeze(value, variance)
        return Measurement(value, variance)
