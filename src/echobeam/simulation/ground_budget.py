"""Link budget of one slot with objects on the ground: SNRs, and accuracies of both cosines.

Powers and echoes are those of `link_budget`; a measurement has two direction cosines in place of
the angle, and tells a place on the ground together with the delay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echobeam.physics import transmission
from echobeam.physics.detection import DetectionLaw
from echobeam.physics.link import channel_loss, rate, sinr
from echobeam.physics.planar import PlanarArray
from echobeam.physics.plane import GroundGeometry
from echobeam.physics.variance_law import VarianceLaw
from echobeam.schemes.configure import detection_of
from echobeam.simulation.world import World
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, Transmission, UavState


@dataclass(frozen=True, slots=True)
class GroundEcho:
    """Echo of one object under one transmission, and the accuracy of its measurement.

    Attributes
    ----------
    raw_snr, snr, array_snr, counted_snr, detection
        As of `echobeam.simulation.link_budget.EchoBudget`.
    cosine_std
        Standard deviations of u and v, infinite where nothing is measured.
    delay_std, doppler_std
        s, Hz.
    distance_std, speed_std
        The same as distance, m, and radial speed, m/s.
    position_std
        Standard deviations of x and y from cosines and delay, at the known height, m.
    """

    raw_snr: float
    snr: float
    array_snr: float
    counted_snr: float
    cosine_std: tuple[float, float]
    delay_std: float
    doppler_std: float
    distance_std: float
    speed_std: float
    position_std: tuple[float, float]
    detection: float


@dataclass(frozen=True, slots=True)
class GroundBudget:
    """Downlink and echo of one object on the ground in one slot.

    Attributes
    ----------
    name
        Name of the object.
    position, velocity
        x and y, m and m/s.
    cosines, distance
        u and v; m. An object behind the array has neither gain nor echo.
    delay, doppler
        Of its echo, s and Hz; the Doppler is positive when approaching.
    snr, omni_sinr, omni_rate, beam_snr, beam_rate, cross_section
        As of `echobeam.simulation.link_budget.ObjectBudget`, with the gain of the elements.
    beam_widths
        Half-power widths of the matched beam along u and v.
    omni_echo, beam_echo
        Echoes of the two transmissions.
    """

    name: str
    position: tuple[float, float]
    velocity: tuple[float, float]
    cosines: tuple[float, float]
    distance: float
    delay: float
    doppler: float
    snr: float
    omni_sinr: float
    omni_rate: float
    beam_snr: float
    beam_rate: float
    beam_widths: tuple[float, float]
    cross_section: float
    omni_echo: GroundEcho
    beam_echo: GroundEcho


def ground_budgets(world: World) -> tuple[GroundBudget, ...]:
    """Return the budgets of the objects present in a slot of one trial."""
    scenario, law, geometry = world.scene.scenario, world.scene.law, world.scene.geometry
    array, radio = law.transmitter, scenario.radio
    assert isinstance(geometry, GroundGeometry)
    assert isinstance(array, PlanarArray)
    here, seen = np.flatnonzero(world.present), detection_of(scenario)
    state, place, measured = world.state[0, here], world.place[0, here], world.ideal()[0, here]
    sections = np.ones(len(here)) if law.target is None else law.target.relative(place)
    omni = transmission.omni(np.ones(len(here), dtype=np.bool_), radio.power, array.n)
    loss = channel_loss(place[:, 2], radio.noise, radio.alpha0)
    shared = sinr(omni, np.eye(len(here), dtype=np.bool_), place[:, :2], loss, array)
    budgets = []
    for row, column in enumerate(here):
        alone, own = place[row : row + 1], state[row]
        snr = radio.power / float(loss[row])
        told = _Told(law, seen, geometry, own, world.uav, radio.carrier)
        budgets.append(
            GroundBudget(
                name=world.scene.mover.names[world.identity[column]],
                position=_pair(own[:2]),
                velocity=_pair(own[2:4]),
                cosines=_pair(place[row, :2]),
                distance=0.5 * SPEED_OF_LIGHT * float(measured[row, 2]),
                delay=float(measured[row, 2]),
                doppler=float(measured[row, 3]),
                snr=snr,
                omni_sinr=float(shared[row]),
                omni_rate=float(rate(shared[row])),
                beam_snr=array.elements * snr,
                beam_rate=float(rate(array.elements * snr)),
                beam_widths=array.half_power_widths,
                cross_section=float(sections[row]),
                omni_echo=told.echo(omni, alone),
                beam_echo=told.echo(_matched(place[row, :2], radio.power, array), alone),
            )
        )
    return tuple(budgets)


def _pair(values: Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _matched(cosines: Array, power: float, array: PlanarArray) -> Transmission:
    """Return the transmission of all power in the beam matched to a direction."""
    beam = np.zeros((1, array.n), dtype=complex)
    beam[0, : array.elements] = math.sqrt(power / array.elements) * array.steering(cosines)
    return transmission.directional(beam)


@dataclass(frozen=True, slots=True)
class _Told:
    """What the radar can tell of one object in a state ``(4,)``."""

    law: VarianceLaw
    seen: DetectionLaw
    geometry: GroundGeometry
    state: Array
    uav: UavState
    carrier: float

    def echo(self, sent: Transmission, place: Array) -> GroundEcho:
        """Return the echo of a transmission, the object being at a place ``(1, 3)`` or more."""
        law = self.law
        snr = law.snr(sent, place)
        variance = law.variance(sent, place, snr)[0]
        u, v, delay, doppler = (float(each) for each in np.sqrt(variance))
        array_snr = float(snr[0]) * law.receiver.elements
        counted = law.transmitter.elements if law.crb == "paper" else 1
        return GroundEcho(
            raw_snr=float(snr[0]) / law.gain,
            snr=float(snr[0]),
            array_snr=array_snr,
            counted_snr=array_snr * counted,
            cosine_std=(u, v),
            delay_std=delay,
            doppler_std=doppler,
            distance_std=0.5 * SPEED_OF_LIGHT * delay,
            speed_std=0.5 * SPEED_OF_LIGHT / self.carrier * doppler,
            position_std=self._position(variance[:3]),
            detection=float(self.seen.probability(snr)[0]),
        )

    def _position(self, variance: Array) -> tuple[float, float]:
        """Return the standard deviations of x and y: the inverse of the sum of information."""
        slope = np.empty((3, 2))
        slope[:2] = self.geometry.cosine_jacobian(self.state[None], self.uav)[0]
        offset = self.state[:2] - self.uav.position[:2]
        distance = math.hypot(*offset, self.uav.position[2])
        slope[2] = 2.0 / SPEED_OF_LIGHT * offset / distance
        slope /= np.sqrt(variance)[:, None]  # no information where the variance is infinite
        information = slope.T @ slope
        # of eigenvalues apart by many orders: delay and cosines differ so
        _, values, axes = np.linalg.svd(slope)
        if not np.isfinite(information).all() or not values[-1] > 0.0:
            return math.inf, math.inf
        return _pair(np.sqrt(np.square(axes / values[:, None]).sum(axis=0)))
