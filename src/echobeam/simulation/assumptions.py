"""Assumptions of the model, with the numbers that decide whether they hold in a scenario."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from echobeam.physics.targets import TARGETS
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import RadarTable
from echobeam.schemes.configure import arrays_of
from echobeam.simulation import ground_assumptions as on_ground
from echobeam.simulation import road_assumptions as on_road
from echobeam.simulation.assumption import SQUINT, Assumption, Extremes
from echobeam.simulation.grid import waveform_of
from echobeam.simulation.ground_budget import GroundBudget
from echobeam.simulation.link_budget import Budget, ObjectBudget, PowerScale, far_field
from echobeam.simulation.world import World
from echobeam.units import SPEED_OF_LIGHT

MOST_SLOTS = 10_000
"""Largest number of slots of a run whose motion is checked, from the first slot."""

THRESHOLD = 10.0**1.5
"""Threshold of the SNR after the receive array, linear: estimators reach the bound above 15 dB.

Measured for the maximum likelihood estimate of the angle at 30 antennas: RMSE over the exact bound
is 1.01 to 1.04 above 15 dB, and several times the bound below 13 dB, where outliers dominate.
"""


def extremes(world: World) -> Extremes:
    """Return the extremes of the motion from the world's current slot on."""
    count = min(world.scene.scenario.n_slots, MOST_SLOTS)
    nearest = closing = turning = math.nan
    road = world.scene.geometry.axes == 1
    for slot in range(count):
        d, radial, lateral = on_road.motion(world) if road else on_ground.motion(world)
        nearest = float(np.fmin.reduce(d, axis=None, initial=nearest))
        closing = float(np.fmax.reduce(np.abs(radial), axis=None, initial=closing))
        turning = float(np.fmax.reduce(np.abs(lateral) / d, axis=None, initial=turning))
        if slot + 1 < count:
            world = world.advance()
    return Extremes(count, nearest, closing, turning)


def assumptions(
    scenario: Scenario,
    objects: Sequence[Budget],
    scale: PowerScale,
    motion: Extremes,
) -> tuple[Assumption, ...]:
    """Return the assumptions of the model for a scenario.

    Parameters
    ----------
    objects
        Budgets of the objects in a slot.
    scale
        Scale of powers.
    motion
        Extremes of the run's motion.
    """
    found = [*_taken(scenario, scale), _pulse(scenario), _gain(scenario)]
    if math.isfinite(motion.nearest):
        moving = (_far_field, _range_migration, _doppler, _turning_phase)
        found += [check(scenario, motion) for check in moving]
    if objects:
        found.append(_threshold(scenario, objects))
    found.append(_narrow_band(scenario))
    if scenario.geometry == "ground":
        found += on_ground.assumptions(scenario, cast("Sequence[GroundBudget]", objects), motion)
    else:
        found += on_road.assumptions(scenario, cast("Sequence[ObjectBudget]", objects), motion)
    return tuple(found)


def _height(scenario: Scenario) -> list[Assumption]:
    """Return what is wrong with the height that the UAV knows, if anything is."""
    truth, uav = scenario.truth, scenario.uav
    words = []
    if truth.terrain != 0.0:
        side = "above" if truth.terrain > 0.0 else "below"
        words.append(f"is {abs(truth.terrain):g} m {side} the height that the UAV knows")
    if truth.altitude_errors:
        words.append(
            f"has errors of {uav.altimeter_std:g} m (altimeter) and {uav.terrain_std:g} m (terrain "
            "under each object), standard deviations"
        )
    return [Assumption("height", f"the ground {' and '.join(words)}")] if words else []


def _taken(scenario: Scenario, scale: PowerScale) -> list[Assumption]:
    isolation = scale.transmit_power / scale.noise_power
    radar = scenario.radar
    sides = on_ground.sides if scenario.geometry == "ground" else on_road.sides
    signal, unlabelled = radar.model == "signal", scenario.unlabelled
    cancelled = f"cancelled to the noise level, by {_db(isolation)} dB"
    if signal and radar.self_interference > 0.0:
        cancelled = f"cancelled to {_db(radar.self_interference)} dB above the noise"
    if signal and radar.ground_clutter > 0.0:
        clutter = Assumption(
            "clutter",
            f"a metre of road below the UAV echoes with |epsilon|^2 = {radar.ground_clutter:g}; "
            + (
                "nobody says whose an echo is" if unlabelled else "each object's echo is identified"
            ),
        )
    elif signal and radar.background != "none":
        clutter = Assumption(
            "background",
            f"besides the objects three points echo, those of {radar.background} in TR 38.901",
        )
    elif unlabelled:
        clutter = Assumption(
            "flat ground", "the UAV knows its height, and that objects are on flat ground"
        )
    else:
        clutter = Assumption(
            "no clutter", "all echoes come from objects, and each object is identified"
        )
    return [
        *_height(scenario),
        Assumption(
            "monostatic",
            "transmit and receive array are at the same place",
        ),
        *sides(scenario),
        Assumption(
            "self-interference",
            f"echoes are received while the UAV transmits; self-interference is {cancelled}",
        ),
        Assumption("line of sight", "one path to each object: no blockage, no multipath"),
        clutter,
        _target(radar),
    ]


def _target(radar: RadarTable) -> Assumption:
    """Return what is assumed of the cross-section; the UAV knows the kind of its targets."""
    if radar.target in TARGETS:
        aspect = " with a pattern over the aspect" if TARGETS[radar.target].directional else ""
        return Assumption(
            "standard target",
            f"targets are points{aspect}; their echoes fluctuate from slot to slot; the UAV knows "
            f"that all are of the kind {radar.target}",
        )
    if "swerling1" in (radar.target, radar.fluctuation):
        words = "targets are points; their echoes fluctuate from slot to slot"
        return Assumption("Swerling I", words)
    return Assumption("constant cross-section", "targets are points and do not fluctuate")


def _far_field(scenario: Scenario, motion: Extremes) -> Assumption:
    start = far_field(scenario)
    return Assumption(
        "far field",
        f"wavefronts are plane beyond 2 D^2 / lambda = {start:.3g} m; the nearest object is "
        f"{motion.nearest:.3g} m away",
        motion.nearest >= start,
        motion.nearest,
        start,
        "m",
    )


def _narrow_band(scenario: Scenario) -> Assumption:
    apertures = []
    for array in arrays_of(scenario):
        apertures.append(array.spacing * math.hypot(*(count - 1 for count in array.shape)))
    transit = max(apertures) / scenario.radio.carrier
    ratio = transit * scenario.radar.bandwidth
    return Assumption(
        "narrow band",
        f"a wave crosses the array in {transit * 1e9:.3g} ns, {ratio:.2g} of 1 / bandwidth; beams "
        f"do not squint up to {SQUINT:g}",
        ratio <= SQUINT,
        ratio,
        SQUINT,
    )


def _pulse(scenario: Scenario) -> Assumption:
    pulse, slot = scenario.radar.pulse_length, scenario.frame.slot
    return Assumption(
        "pulse within the slot",
        f"a pulse of {pulse * 1e6:.4g} us must fit into a slot of {slot * 1e3:.4g} ms",
        pulse <= slot,
        pulse,
        slot,
        "s",
    )


def _gain(scenario: Scenario) -> Assumption:
    radar = scenario.radar
    product = radar.bandwidth * radar.pulse_length
    gain = radar.integrated
    return Assumption(
        "gain of the matched filter",
        f"G_m = {gain:.4g} of the {product:.4g} that bandwidth and pulse length give"
        + (", of all resource elements" if radar.integration == "grid" else ""),
        gain <= product * (1.0 + 1e-9),
        gain,
        product,
    )


def _range_migration(scenario: Scenario, motion: Extremes) -> Assumption:
    path = motion.closing * scenario.frame.slot
    cell = SPEED_OF_LIGHT / (2.0 * scenario.radar.bandwidth)
    return Assumption(
        "no range migration",
        f"within a slot distances change by up to {path:.3g} m; a range cell is {cell:.3g} m",
        path <= cell,
        path,
        cell,
        "m",
    )


def _doppler(scenario: Scenario, motion: Extremes) -> Assumption:
    doppler = _largest_doppler(scenario, motion)
    limit, by_slots = scenario.radar.bandwidth / 2.0, 1.0 / (2.0 * scenario.frame.slot)
    if scenario.radar.model == "signal":
        limit = waveform_of(scenario.radar).unambiguous_doppler
    return Assumption(
        "unambiguous Doppler",
        f"Dopplers are up to {_hertz(doppler)}; within a pulse they are unambiguous up to "
        f"{_hertz(limit)} (from slot to slot, which is not used, up to {_hertz(by_slots)})",
        doppler <= limit,
        doppler,
        limit,
        "Hz",
    )


def _turning_phase(scenario: Scenario, motion: Extremes) -> Assumption:
    turns = _largest_doppler(scenario, motion) * scenario.radar.pulse_length
    return Assumption(
        "steady phase within a pulse",
        f"within a pulse an echo's phase turns by up to {turns:.2g} cycles; beyond half a cycle "
        "the matched filter must be a bank over Doppler",
        turns <= 0.5,
        turns,
        0.5,
    )


def _largest_doppler(scenario: Scenario, motion: Extremes) -> float:
    return 2.0 * motion.closing * scenario.radio.carrier / SPEED_OF_LIGHT


def _threshold(scenario: Scenario, objects: Sequence[Budget]) -> Assumption:
    omni = min(one.omni_echo.array_snr for one in objects)
    beam = min(one.beam_echo.array_snr for one in objects)
    return Assumption(
        "measurements reach their bound",
        f"the echo SNR after the receive array is {_db(omni)} dB in the omnidirectional slot and "
        f"{_db(beam)} dB in a beam; real estimators reach the bound from {_db(THRESHOLD)} dB",
        omni >= THRESHOLD,
        omni,
        THRESHOLD,
    )


def _db(ratio: float) -> str:
    return f"{10.0 * math.log10(ratio):.1f}" if ratio > 0.0 else "-inf"


def _hertz(frequency: float) -> str:
    for factor, unit in ((1e9, "GHz"), (1e6, "MHz"), (1e3, "kHz")):
        if frequency >= factor:
            return f"{frequency / factor:.3g} {unit}"
    return f"{frequency:.3g} Hz"
