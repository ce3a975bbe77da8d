"""Assumptions of the model, with the numbers that decide whether they hold in a scenario."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.measurement import closing_speed
from echobeam.physics.targets import TARGETS
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import RadarTable
from echobeam.simulation import ground_assumptions as on_ground
from echobeam.simulation.assumption import SQUINT, Assumption, Extremes
from echobeam.simulation.grid import waveform_of
from echobeam.simulation.ground_budget import GroundBudget
from echobeam.simulation.link_budget import ObjectBudget, PowerScale, far_field
from echobeam.simulation.world import World
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array

MOST_SLOTS = 10_000
"""Largest number of slots of a run whose motion is checked, from the first slot."""

THRESHOLD = 10.0**1.5
"""Threshold of the SNR after the receive array, linear: estimators reach the bound above 15 dB.

Measured for the maximum likelihood estimate of the angle at 30 antennas: RMSE over the exact bound
is 1.01 to 1.04 above 15 dB, and several times the bound below 13 dB, where outliers dominate.
"""

ROAD_SPEED = 30.0
"""Speed of road traffic, m/s: a standard deviation above it leaves the velocity unknown."""


def extremes(world: World) -> Extremes:
    """Return the extremes of the motion from the world's current slot on."""
    count = min(world.scene.scenario.n_slots, MOST_SLOTS)
    nearest = closing = turning = math.nan
    on_road = world.scene.geometry.axes == 1
    for slot in range(count):
        d, radial, lateral = _motion(world) if on_road else on_ground.motion(world)
        nearest = float(np.fmin.reduce(d, axis=None, initial=nearest))
        closing = float(np.fmax.reduce(np.abs(radial), axis=None, initial=closing))
        turning = float(np.fmax.reduce(np.abs(lateral) / d, axis=None, initial=turning))
        if slot + 1 < count:
            world = world.advance()
    return Extremes(count, nearest, closing, turning)


def _motion(world: World) -> tuple[Array, Array, Array]:
    """Return distances, closing speeds and speeds across the line of sight, m and m/s."""
    theta, d, v = np.moveaxis(world.state, -1, 0)
    uav = world.uav
    radial = closing_speed(theta, v, uav.speed, uav.heading)
    lateral = np.cos(theta) * uav.velocity[2] - np.sin(theta) * (v - uav.velocity[0])
    return d, radial, lateral


def assumptions(
    scenario: Scenario,
    objects: Sequence[ObjectBudget] | Sequence[GroundBudget],
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
    if scenario.geometry == "ground":
        return tuple(_on_ground(scenario, cast("Sequence[GroundBudget]", objects), scale, motion))
    return tuple(_on_road(scenario, cast("Sequence[ObjectBudget]", objects), scale, motion))


def _on_ground(
    scenario: Scenario, objects: Sequence[GroundBudget], scale: PowerScale, motion: Extremes
) -> list[Assumption]:
    found = [*_taken(scenario, scale), _pulse(scenario), _gain(scenario)]
    if math.isfinite(motion.nearest):
        moving = (_far_field, _range_migration, _doppler, _turning_phase)
        found += [check(scenario, motion) for check in moving]
    if objects:
        found.append(_threshold(scenario, objects))
    return found + on_ground.assumptions(scenario, objects, motion)


def _on_road(
    scenario: Scenario, objects: Sequence[ObjectBudget], scale: PowerScale, motion: Extremes
) -> list[Assumption]:
    moving = (_far_field, _range_migration, _angle_migration, _doppler, _turning_phase)
    seen = (_threshold, _velocity, _grid, _widest, _separated, _blind)
    found = [
        *_taken(scenario, scale),
        _narrow_band(scenario),
        _pulse(scenario),
        _gain(scenario),
        _grating(scenario, objects),
    ]
    if math.isfinite(motion.nearest):
        found += [check(scenario, motion) for check in moving]
    if objects:
        found += [check(scenario, objects) for check in seen]
    return found


def _side(scenario: Scenario) -> list[Assumption]:
    """Return what a vertical array is told, because it cannot measure it."""
    if scenario.geometry == "ground":
        return on_ground.sides(scenario)
    if scenario.array.axis != "vertical":
        return []
    words = "a vertical array cannot tell theta from 180 degrees minus theta; "
    unlabelled = scenario.unlabelled
    words += "a track stands for both sides" if unlabelled else "the side is known"
    return [Assumption("side of the UAV", words)]


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
        *_side(scenario),
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
    array, radio, radar = scenario.array, scenario.radio, scenario.radar
    transit = (max(array.n_tx, array.receivers) - 1) * array.spacing / radio.carrier
    ratio = transit * radar.bandwidth
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


def _grating(scenario: Scenario, objects: Sequence[ObjectBudget]) -> Assumption:
    project = math.sin if scenario.array.axis == "vertical" else math.cos
    farthest = max((abs(project(one.angle)) for one in objects), default=1.0)
    limit = 1.0 / (1.0 + farthest)
    return Assumption(
        "no grating lobes",
        f"antennas are {scenario.array.spacing:.3g} wavelengths apart; beams towards the objects "
        f"have a single main lobe up to {limit:.3g}",
        scenario.array.spacing <= limit,
        scenario.array.spacing,
        limit,
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


def _angle_migration(scenario: Scenario, motion: Extremes) -> Assumption:
    turn = motion.turning * scenario.frame.slot
    half = _half_beam(scenario)  # broadside, where a beam is narrowest
    return Assumption(
        "no angle migration",
        f"within a slot angles change by up to {math.degrees(turn):.2g} degrees; half of a beam's "
        f"half-power width is {math.degrees(half):.2g}",
        turn <= half,
        turn,
        half,
        "rad",
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


def _threshold(
    scenario: Scenario, objects: Sequence[ObjectBudget] | Sequence[GroundBudget]
) -> Assumption:
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


def _velocity(scenario: Scenario, objects: Sequence[ObjectBudget]) -> Assumption:
    worst = max(one.omni_echo.velocity_std for one in objects)
    prior = scenario.filter.velocity_prior
    known = min(worst, prior) if prior > 0 else worst
    from_doppler = f"to {worst:.3g} m/s" if math.isfinite(worst) else "not at all"
    before = (
        f"the prior's standard deviation is {prior:.3g} m/s" if prior > 0 else "there is no prior"
    )
    return Assumption(
        "velocity known from the first slot",
        f"the first Doppler determines the velocity {from_doppler}, and {before}; road traffic "
        f"moves at about {ROAD_SPEED:g} m/s",
        known <= ROAD_SPEED,
        known,
        ROAD_SPEED,
        "m/s",
    )


def _cover(scenario: Scenario, objects: Sequence[ObjectBudget], of: str) -> list[float]:
    """Return l sigma_theta of Eq. (38f) after each of the two transmissions."""
    return [scenario.coverage.width * getattr(one, of).angle_std for one in objects]


def _grid(scenario: Scenario, objects: Sequence[ObjectBudget]) -> Assumption:
    cover, step = min(_cover(scenario, objects, "beam_echo")), scenario.coverage.resolution
    return Assumption(
        "cover above the grid's resolution",
        f"after a beam {scenario.coverage.width:g} standard deviations are "
        f"{math.degrees(cover):.2g} degrees; the cover is rounded outward to steps of "
        f"{math.degrees(step):.2g}",
        cover >= step,
        cover,
        step,
        "rad",
    )


def _widest(scenario: Scenario, objects: Sequence[ObjectBudget]) -> Assumption:
    cover, widest = max(_cover(scenario, objects, "omni_echo")), scenario.coverage.max_halfwidth
    text = f"{math.degrees(cover):.3g}" if math.isfinite(cover) else "infinitely many"
    return Assumption(
        "cover below the widest",
        f"after the omnidirectional slot {scenario.coverage.width:g} standard deviations are "
        f"{text} degrees; at most {math.degrees(widest):.3g} are covered",
        cover <= widest,
        cover,
        widest,
        "rad",
    )


def _separated(scenario: Scenario, objects: Sequence[ObjectBudget]) -> Assumption:
    array = LinearArray(scenario.array.n_tx, scenario.array.spacing, scenario.array.axis)
    seen = np.sort(array.frequency([one.angle for one in objects]))
    nearest = float(np.diff(seen).min(initial=math.inf))
    cell = 2.0 * _half_beam(scenario)
    apart = (
        f"the nearest two objects differ by {nearest:.2g} in the "
        + ("sine" if array.axis == "vertical" else "cosine")
        if math.isfinite(nearest)
        else "there is one object"
    )
    return Assumption(
        "objects in beams of their own",
        f"{apart}; a beam is {cell:.2g} wide",
        nearest >= cell,
        nearest,
        cell,
    )


def _blind(scenario: Scenario, objects: Sequence[ObjectBudget]) -> Assumption:
    worst = max(one.omni_echo.angle_std for one in objects)
    return Assumption(
        "array sensitive to the angle",
        f"the first angle has a standard deviation of {math.degrees(worst):.3g} degrees at most"
        if math.isfinite(worst)
        else "an object lies along the array's axis, or the array has one antenna: no angle",
        math.isfinite(worst),
        worst,
        unit="rad",
    )


def _half_beam(scenario: Scenario) -> float:
    """Return half the half-power width of a matched beam, in the sine or cosine of the angle."""
    return 0.443 / (scenario.array.n_tx * scenario.array.spacing)


def _db(ratio: float) -> str:
    return f"{10.0 * math.log10(ratio):.1f}" if ratio > 0.0 else "-inf"


def _hertz(frequency: float) -> str:
    for factor, unit in ((1e9, "GHz"), (1e6, "MHz"), (1e3, "kHz")):
        if frequency >= factor:
            return f"{frequency / factor:.3g} {unit}"
    return f"{frequency:.3g} Hz"
