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

import numpy as np

from echobeam.physics import transmission
from echobeam.physics.angles import exact_cosine
from echobeam.physics.array import LinearArray
from echobeam.physics.detection import DetectionLaw
from echobeam.physics.link import channel_loss, rate, sinr
from echobeam.physics.measurement import measure
from echobeam.physics.planar import linear
from echobeam.physics.variance_law import VarianceLaw
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import arrays_of, detection_of
from echobeam.simulation.world import World
from echobeam.units import BOLTZMANN, SPEED_OF_LIGHT
from echobeam.values import Array, Transmission

TEMPERATURE = 290.0
"""Standard noise temperature, K."""

NOISE_FIGURE = 10.0**0.7
"""Noise figure of a receiver, linear: 7 dB, typical at millimetre waves."""


@dataclass(frozen=True, slots=True)
class EchoBudget:
    """Echo of one object under one transmission, and the accuracy of its measurement.

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
    angle_std, delay_std, doppler_std
        Standard deviations of a measurement, rad, s, Hz; infinite where nothing is measured.
    distance_std, speed_std
        Standard deviations of delay and Doppler as distance, m, and radial speed, m/s.
    velocity_std
        Standard deviation of the speed along the road from the Doppler, m/s; infinite across the
        line of sight.
    detection
        Probability that the echo is detected at ``radar.false_alarm``; labelled ones always are.
    """

    raw_snr: float
    snr: float
    array_snr: float
    counted_snr: float
    angle_std: float
    delay_std: float
    doppler_std: float
    distance_std: float
    speed_std: float
    velocity_std: float
    detection: float


@dataclass(frozen=True, slots=True)
class ObjectBudget:
    """Downlink and echo of one object in one slot.

    Attributes
    ----------
    name
        Name of the object.
    angle, distance, velocity
        State: rad, m, and ground speed along the road, m/s.
    delay, doppler
        Delay and Doppler of its echo, s and Hz; the Doppler is positive when approaching.
    snr
        Received SNR with all power on one antenna, linear.
    omni_sinr, omni_rate
        SINR, linear, and rate, bit/s/Hz, of an omnidirectional slot that serves all objects, Eq.
        (7) and Eq. (8).
    beam_snr, beam_rate
        SNR, linear, and rate, bit/s/Hz, with all power in the beam matched to the object, Eq. (10).
    beam_width
        Half-power width of that beam, rad.
    cross_section
        Radar cross-section at the object's aspect over its mean, linear: 1 if it is constant.
    omni_echo, beam_echo
        Echoes of the two transmissions, of this cross-section.
    """

    name: str
    angle: float
    distance: float
    velocity: float
    delay: float
    doppler: float
    snr: float
    omni_sinr: float
    omni_rate: float
    beam_snr: float
    beam_rate: float
    beam_width: float
    cross_section: float
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


def object_budgets(world: World) -> tuple[ObjectBudget, ...]:
    """Return the budgets of the objects present in a slot of one trial."""
    scenario, law = world.scene.scenario, world.scene.law
    radio, array = scenario.radio, linear(law.transmitter)
    here, seen = np.flatnonzero(world.present), detection_of(scenario)
    state, place = world.state[0, here], world.place[0, here]
    sections = np.ones(len(here)) if law.target is None else law.target.relative(place)
    omni = transmission.omni(np.ones(len(here), dtype=np.bool_), radio.power, array.n)
    loss = channel_loss(state[:, 1], radio.noise, radio.alpha0)
    shared = sinr(omni, np.eye(len(here), dtype=np.bool_), state[:, 0], loss, array)
    measured = measure(
        state[:, 0], state[:, 1], state[:, 2], world.uav.speed, world.uav.heading, radio.carrier
    )
    snrs = radio.power / loss
    widths = array.half_power_width(state[:, 0])
    budgets = []
    for row, column in enumerate(here):
        alone = place[row : row + 1]
        angle, distance, velocity = (float(component) for component in state[row])
        snr = float(snrs[row])
        budgets.append(
            ObjectBudget(
                name=world.scene.mover.names[world.identity[column]],
                angle=angle,
                distance=distance,
                velocity=velocity,
                delay=float(measured[row, 1]),
                doppler=float(measured[row, 2]),
                snr=snr,
                omni_sinr=float(shared[row]),
                omni_rate=float(rate(shared[row])),
                beam_snr=array.n * snr,
                beam_rate=float(rate(array.n * snr)),
                beam_width=float(widths[row]),
                cross_section=float(sections[row]),
                omni_echo=_echo(omni, alone, law, seen, radio.carrier),
                beam_echo=_echo(
                    _matched(angle, radio.power, array), alone, law, seen, radio.carrier
                ),
            )
        )
    return tuple(budgets)


def far_field(scenario: Scenario) -> float:
    """Return the larger of the far-field distances of the two arrays, m."""
    return max(array.far_field(scenario.radio.wavelength) for array in arrays_of(scenario))


def _matched(angle: float, power: float, array: LinearArray) -> Transmission:
    """Return the transmission of all power in the beam matched to an angle."""
    return transmission.directional(math.sqrt(power / array.n) * array.steering([angle]))


def _echo(
    sent: Transmission, state: Array, law: VarianceLaw, seen: DetectionLaw, carrier: float
) -> EchoBudget:
    """Return the echo of an object in a state ``(1, 3)``."""
    snr = law.snr(sent, state)
    angle, delay, doppler = np.sqrt(law.variance(sent, state, snr)[0])
    array_snr = float(snr[0]) * law.receiver.n
    to_speed = SPEED_OF_LIGHT / (2.0 * carrier)
    along = abs(float(exact_cosine(state[0, 0])))
    speed_std = float(doppler) * to_speed
    return EchoBudget(
        raw_snr=float(snr[0]) / law.gain,
        snr=float(snr[0]),
        array_snr=array_snr,
        counted_snr=array_snr * law.transmitter.n if law.crb == "paper" else array_snr,
        angle_std=float(angle),
        delay_std=float(delay),
        doppler_std=float(doppler),
        distance_std=float(delay) * SPEED_OF_LIGHT / 2.0,
        speed_std=speed_std,
        velocity_std=speed_std / along if along > 0.0 else math.inf,
        detection=float(seen.probability(snr)[0]),
    )
