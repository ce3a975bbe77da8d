"""Link budget of one slot: SNRs and accuracies of all objects, and the scale of powers in watts.

The unit of power of a scenario is arbitrary: the model fixes only ratios. With one transmit antenna
an object at distance d has the SNR P_T alpha0^2 / (sigma_C^2 d^2), Eq. (3), and the echo at one
receive antenna of the UAV has the SNR P_T |epsilon|^2 / (sigma^2 d^4) before the matched filter,
Eqs. (12) and (14). With free-space path loss and thermal noise, the first ratio gives the power in
watts, and the second the radar cross-section in square metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from echobeam.physics import transmission
from echobeam.physics.angles import exact_cosine
from echobeam.physics.array import LinearArray
from echobeam.physics.coordinates import direction_of, distance_of
from echobeam.physics.detection import DetectionLaw
from echobeam.physics.link import channel_loss, rate, sinr
from echobeam.physics.planar import linear
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import arrays_of, detection_of
from echobeam.simulation.world import World
from echobeam.units import BOLTZMANN, SPEED_OF_LIGHT
from echobeam.values import Array, Transmission

TEMPERATURE = 290.0
"""Standard noise temperature, K."""

NOISE_FIGURE = 10.0**0.7
"""Noise figure of a receiver, linear: 7 dB, typical at millimetre waves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Echo:
    """Echo of one object under one transmission, and what any geometry measures of it.

    Attributes
    ----------
    raw_snr
        Echo SNR of one receive antenna before the matched filter, linear.
    snr
        Echo SNR after coherent integration, its gain times `raw_snr`: Eq. (14), Eq. (16).
    array_snr
        Echo SNR after the matched filter with the N_r receive antennas combined.
    counted_snr
        SNR in the bound, Eq. (20) to Eq. (22): N_t N_r times `snr` for
        ``radar.crb = "paper"``, where N_t is counted twice; `array_snr` for ``"exact"``.
    delay_std, doppler_std
        Standard deviations of a measurement, s, Hz; infinite where nothing is measured.
    distance_std, speed_std
        Standard deviations of delay and Doppler as distance, m, and radial speed, m/s.
    detection
        Probability that the echo is detected at ``radar.false_alarm``; labelled ones always are.
    """

    raw_snr: float
    snr: float
    array_snr: float
    counted_snr: float
    delay_std: float
    doppler_std: float
    distance_std: float
    speed_std: float
    detection: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EchoBudget(Echo):
    """Echo of one object on a road, and the accuracy of its measurement.

    Attributes
    ----------
    angle_std
        Standard deviation of the angle, rad; infinite where it is not measured.
    velocity_std
        Standard deviation of the speed along the road from the Doppler, m/s; infinite across the
        line of sight.
    """

    angle_std: float
    velocity_std: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Downlink and echoes of one object in one slot, whatever the geometry.

    Attributes
    ----------
    name
        Name of the object.
    delay, doppler
        Delay and Doppler of its echo, s and Hz; the Doppler is positive when approaching.
    snr
        Received SNR with all power on one antenna, linear.
    omni_sinr, omni_rate
        SINR, linear, and rate, bit/s/Hz, of an omnidirectional slot that serves all objects, Eq.
        (7) and Eq. (8).
    beam_snr, beam_rate
        SNR, linear, and rate, bit/s/Hz, with all power in the beam matched to the object, Eq. (10).
    cross_section
        Radar cross-section at the object's aspect over its mean, linear: 1 if it is constant.
    omni_echo, beam_echo
        Echoes of the two transmissions, of this cross-section.
    """

    name: str
    delay: float
    doppler: float
    snr: float
    omni_sinr: float
    omni_rate: float
    beam_snr: float
    beam_rate: float
    cross_section: float
    omni_echo: Echo
    beam_echo: Echo


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectBudget(Budget):
    """Downlink and echo of one object on a road in one slot.

    Attributes
    ----------
    angle, distance, velocity
        State: rad, m, and ground speed along the road, m/s.
    beam_width
        Half-power width of the matched beam, rad.
    """

    angle: float
    distance: float
    velocity: float
    beam_width: float
    omni_echo: EchoBudget
    beam_echo: EchoBudget


@dataclass(frozen=True, slots=True)
class PowerScale:
    """Scale of powers: watts and square metres that give a scenario's SNRs.

    It holds for isotropic elements in free space, P (lambda / (4 pi d))^2, and for noise k T B F in
    the bandwidth B = ``radar.bandwidth``, both at the objects and at the UAV.

    Attributes
    ----------
    power
        P_T, in the scenario's unit.
    snr_at_1m
        SNR at 1 m of one antenna with all power, P_T alpha0^2 / sigma_C^2, linear.
    bandwidth, temperature, noise_figure
        B, Hz; T, K; F, linear.
    noise_power
        k T B F, W.
    transmit_power
        P_T, W.
    unit_power
        Watts of a power of 1 in the scenario, W.
    watt
        1 W in the scenario's unit.
    cross_section
        Radar cross-section, m^2, of a target whose echo has this SNR before the matched filter.
    full_integration
        Largest gain of coherent integration over a slot: B times its duration, linear.
    full_cross_section
        Radar cross-section, m^2, of a target whose echo has the SNR of Eq. (14) after integration
        over the whole slot.
    """

    power: float
    snr_at_1m: float
    bandwidth: float
    temperature: float
    noise_figure: float
    noise_power: float
    transmit_power: float
    unit_power: float
    watt: float
    cross_section: float
    full_integration: float
    full_cross_section: float


def power_scale(scenario: Scenario) -> PowerScale:
    """Return the scale of a scenario's powers."""
    radio, radar = scenario.radio, scenario.radar
    power, noise, alpha0 = np.array([radio.power, radio.noise, radio.alpha0])
    noise_power = BOLTZMANN * TEMPERATURE * radar.bandwidth * NOISE_FIGURE
    snr_at_1m = power * alpha0**2 / noise
    transmit_power = snr_at_1m * noise_power * np.square(4.0 * np.pi / radio.wavelength)
    # P lambda^2 rcs / ((4 pi)^3 d^4 k T B F) is P_T |epsilon|^2 / (sigma^2 d^4)
    reflected = np.abs(complex(*radar.rcs)) ** 2 / radar.noise
    cross_section = 4.0 * np.pi * reflected * noise / alpha0**2
    full_integration = radar.bandwidth * scenario.frame.slot
    return PowerScale(
        power=radio.power,
        snr_at_1m=float(snr_at_1m),
        bandwidth=radar.bandwidth,
        temperature=TEMPERATURE,
        noise_figure=NOISE_FIGURE,
        noise_power=noise_power,
        transmit_power=float(transmit_power),
        unit_power=float(transmit_power / power),
        watt=float(power / transmit_power),
        cross_section=float(cross_section),
        full_integration=full_integration,
        full_cross_section=float(cross_section * radar.integrated / full_integration),
    )


def downlinks(world: World) -> list[dict[str, Any]]:
    """Return the fields of `Budget` but the echoes, of the objects present in a slot of a trial."""
    scenario, law, axes = world.scene.scenario, world.scene.law, world.scene.geometry.axes
    radio, array = scenario.radio, law.transmitter
    here = np.flatnonzero(world.present)
    place, measured = world.place[0, here], world.ideal()[0, here]
    sections = np.ones(len(here)) if law.target is None else law.target.relative(place)
    omni = omni_budget(world)
    loss = channel_loss(distance_of(place, axes), radio.noise, radio.alpha0)
    shared = sinr(omni, np.eye(len(here), dtype=np.bool_), direction_of(place, axes), loss, array)
    snrs = radio.power / loss
    return [
        {
            "name": world.scene.mover.names[world.identity[column]],
            "delay": float(measured[row, -2]),
            "doppler": float(measured[row, -1]),
            "snr": float(snrs[row]),
            "omni_sinr": float(shared[row]),
            "omni_rate": float(rate(shared[row])),
            "beam_snr": array.elements * float(snrs[row]),
            "beam_rate": float(rate(array.elements * float(snrs[row]))),
            "cross_section": float(sections[row]),
        }
        for row, column in enumerate(here)
    ]


def omni_budget(world: World) -> Transmission:
    """Return the omnidirectional transmission to all objects present."""
    scenario, law = world.scene.scenario, world.scene.law
    served = np.ones(int(world.present.sum()), dtype=np.bool_)
    return transmission.omni(served, scenario.radio.power, law.transmitter.n)


def echo_of(
    world: World, sent: Transmission, place: Array, seen: DetectionLaw
) -> tuple[dict[str, Any], Array]:
    """Return the fields of `Echo` of an object, and the variance of its measurement, ``(M,)``.

    Parameters
    ----------
    world
        Nature in the slot.
    sent
        What is sent.
    place
        ``(1, A + 1)`` or more: of the object.
    seen
        The law of detections.
    """
    law, carrier = world.scene.law, world.scene.scenario.radio.carrier
    snr = law.snr(sent, place)
    variance: Array = law.variance(sent, place, snr)[0]
    delay, doppler = (float(each) for each in np.sqrt(variance[-2:]))
    array_snr = float(snr[0]) * law.receiver.elements
    counted = law.transmitter.elements if law.crb == "paper" else 1
    fields = {
        "raw_snr": float(snr[0]) / law.gain,
        "snr": float(snr[0]),
        "array_snr": array_snr,
        "counted_snr": array_snr * counted,
        "delay_std": delay,
        "doppler_std": doppler,
        "distance_std": 0.5 * SPEED_OF_LIGHT * delay,
        "speed_std": 0.5 * SPEED_OF_LIGHT / carrier * doppler,
        "detection": float(seen.probability(snr)[0]),
    }
    return fields, variance


def object_budgets(world: World) -> tuple[ObjectBudget, ...]:
    """Return the budgets of the objects on a road present in a slot of one trial."""
    scenario, array = world.scene.scenario, linear(world.scene.law.transmitter)
    here, seen = np.flatnonzero(world.present), detection_of(scenario)
    state, place = world.state[0, here], world.place[0, here]
    omni, widths = omni_budget(world), array.half_power_width(state[:, 0])
    budgets = []
    for row, link in enumerate(downlinks(world)):
        alone = place[row : row + 1]
        angle, distance, velocity = (float(component) for component in state[row])
        beam = _matched(angle, scenario.radio.power, array)
        budgets.append(
            ObjectBudget(
                angle=angle,
                distance=distance,
                velocity=velocity,
                beam_width=float(widths[row]),
                omni_echo=_echo(world, omni, alone, seen),
                beam_echo=_echo(world, beam, alone, seen),
                **link,
            )
        )
    return tuple(budgets)


def far_field(scenario: Scenario) -> float:
    """Return the larger of the far-field distances of the two arrays, m."""
    return max(array.far_field(scenario.radio.wavelength) for array in arrays_of(scenario))


def _matched(angle: float, power: float, array: LinearArray) -> Transmission:
    """Return the transmission of all power in the beam matched to an angle."""
    return transmission.directional(math.sqrt(power / array.n) * array.steering([angle]))


def _echo(world: World, sent: Transmission, place: Array, seen: DetectionLaw) -> EchoBudget:
    """Return the echo of an object at a place ``(1, 2)`` or more."""
    fields, variance = echo_of(world, sent, place, seen)
    along = abs(float(exact_cosine(place[0, 0])))
    return EchoBudget(
        angle_std=float(np.sqrt(variance[0])),
        velocity_std=fields["speed_std"] / along if along > 0.0 else math.inf,
        **fields,
    )
