"""Assumptions of the model where directions are angles above a road."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.measurement import closing_speed
from echobeam.scenario.model import Scenario
from echobeam.simulation.assumption import Assumption, Extremes, no_grating_lobes
from echobeam.simulation.link_budget import ObjectBudget
from echobeam.simulation.world import World
from echobeam.values import Array

ROAD_SPEED = 30.0
"""Speed of road traffic, m/s: a standard deviation above it leaves the velocity unknown."""


def motion(world: World) -> tuple[Array, Array, Array]:
    """Return distances, closing speeds and speeds across the line of sight, m and m/s."""
    theta, d, v = np.moveaxis(world.state, -1, 0)
    uav = world.uav
    radial = closing_speed(theta, v, uav.speed, uav.heading)
    lateral = np.cos(theta) * uav.velocity[2] - np.sin(theta) * (v - uav.velocity[0])
    return d, radial, lateral


def sides(scenario: Scenario) -> list[Assumption]:
    """Return what a vertical array is told, because it cannot measure it."""
    if scenario.array.axis != "vertical":
        return []
    words = "a vertical array cannot tell theta from 180 degrees minus theta; "
    words += "a track stands for both sides" if scenario.unlabelled else "the side is known"
    return [Assumption("side of the UAV", words)]


def assumptions(
    scenario: Scenario, objects: Sequence[ObjectBudget], moving: Extremes
) -> list[Assumption]:
    """Return the assumptions about angles; those alike in both geometries are not here."""
    project = math.sin if scenario.array.axis == "vertical" else math.cos
    farthest = max((abs(project(one.angle)) for one in objects), default=1.0)
    found = [no_grating_lobes(scenario.array.spacing, farthest)]
    if math.isfinite(moving.nearest):
        found.append(_angle_migration(scenario, moving))
    if objects:
        checks = (_velocity, _grid, _widest, _separated, _blind)
        found += [check(scenario, objects) for check in checks]
    return found


def _angle_migration(scenario: Scenario, moving: Extremes) -> Assumption:
    turn = moving.turning * scenario.frame.slot
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
