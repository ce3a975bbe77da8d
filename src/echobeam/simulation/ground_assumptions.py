"""Assumptions of the model where directions are two cosines."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echobeam.physics.planar import PlanarArray
from echobeam.physics.plane import approach, offset_of
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import arrays_of
from echobeam.simulation.assumption import Assumption, Extremes, no_grating_lobes
from echobeam.simulation.ground_budget import GroundBudget
from echobeam.simulation.world import World
from echobeam.values import Array


def motion(world: World) -> tuple[Array, Array, Array]:
    """Return distances, closing speeds and speeds across the line of sight, m and m/s."""
    offset = offset_of(world.state, world.uav)
    relative = approach(world.state, world.uav)
    distance = np.sqrt(np.sum(offset**2, axis=-1))
    closing = np.sum(offset * relative, axis=-1) / distance
    across = np.sum(relative**2, axis=-1) - closing**2
    return distance, closing, np.sqrt(np.maximum(across, 0.0))


def sides(scenario: Scenario) -> list[Assumption]:
    """Return what an array of one row or column cannot measure."""
    if scenario.array.kind == "planar" and min(_array(scenario).shape) > 1:
        return []
    words = "an array of a single row or column measures one cosine, and cannot tell sides"
    return [Assumption("side of the array", words)]


def assumptions(
    scenario: Scenario, objects: Sequence[GroundBudget], moving: Extremes
) -> list[Assumption]:
    """Return the assumptions about directions; those alike in both geometries are not here."""
    farthest = max((abs(part) for one in objects for part in one.cosines), default=1.0)
    found = [no_grating_lobes(scenario.array.spacing, farthest)]
    if math.isfinite(moving.nearest):
        found.append(_migration(scenario, moving))
    if objects:
        checks = (_in_front, _lattice, _widest, _separated, _accurate)
        found += [check(scenario, objects) for check in checks]
    return found


def _array(scenario: Scenario) -> PlanarArray:
    array = arrays_of(scenario)[0]
    assert isinstance(array, PlanarArray)
    return array


def _migration(scenario: Scenario, moving: Extremes) -> Assumption:
    turn, half = moving.turning * scenario.frame.slot, 0.5 * min(_array(scenario).half_power_widths)
    return Assumption(
        "no angle migration",
        f"within a slot directions turn by up to {math.degrees(turn):.2g} degrees; half of a "
        f"beam's half-power width is {math.degrees(half):.2g}",
        turn <= half,
        turn,
        half,
        "rad",
    )


def _in_front(scenario: Scenario, objects: Sequence[GroundBudget]) -> Assumption:
    behind = [one.name for one in objects if not one.snr > 0.0]
    return Assumption(
        "objects in front of the array",
        f"the array does not see {', '.join(behind)}" if behind else "the array sees all objects",
        not behind,
    )


def _cover(scenario: Scenario, objects: Sequence[GroundBudget], of: str) -> list[float]:
    """Return the longer half-axes l sigma of Eq. (38f) after one of the two transmissions."""
    stds = (getattr(one, of).cosine_std for one in objects if one.snr > 0.0)
    return [scenario.coverage.width * max(pair) for pair in stds]


def _lattice(scenario: Scenario, objects: Sequence[GroundBudget]) -> Assumption:
    cover = max(_cover(scenario, objects, "omni_echo"), default=0.0)
    step = scenario.coverage.resolution
    wide = max(_array(scenario).shape) * scenario.array.spacing
    return Assumption(
        "lattice finer than beams",
        f"a cover of {cover:.2g} is held at its edge and on a lattice of step {step:.2g}; patterns "
        f"have no detail finer than {0.5 / wide:.2g}",
        step <= 0.5 / wide,
        step,
        0.5 / wide,
    )


def _widest(scenario: Scenario, objects: Sequence[GroundBudget]) -> Assumption:
    cover = max(_cover(scenario, objects, "omni_echo"), default=0.0)
    widest = math.sin(min(scenario.coverage.max_halfwidth, 0.5 * math.pi))
    text = f"{cover:.3g}" if math.isfinite(cover) else "infinite"
    return Assumption(
        "cover below the widest",
        f"after the omnidirectional slot {scenario.coverage.width:g} standard deviations of a "
        f"cosine are {text}; at most {widest:.3g} are covered",
        cover <= widest,
        cover,
        widest,
    )


def _separated(scenario: Scenario, objects: Sequence[GroundBudget]) -> Assumption:
    widths = np.array(_array(scenario).half_power_widths)
    places = np.array([one.cosines for one in objects]) / widths
    apart = np.sqrt(np.sum((places[:, None] - places) ** 2, axis=-1))
    nearest = float(np.min(apart[np.triu_indices(len(objects), 1)], initial=math.inf))
    words = (
        f"the nearest two objects are {nearest:.2g} half-power widths of a beam apart"
        if math.isfinite(nearest)
        else "there is one object"
    )
    return Assumption("objects in beams of their own", words, nearest >= 1.0, nearest, 1.0)


def _accurate(scenario: Scenario, objects: Sequence[GroundBudget]) -> Assumption:
    worst = max((max(one.omni_echo.position_std) for one in objects if one.snr > 0.0), default=0.0)
    nearest = min(one.distance for one in objects)
    told = f"to {worst:.3g} m" if math.isfinite(worst) else "not at all"
    return Assumption(
        "place known from the first slot",
        f"the first cosines and delay tell a place on the ground {told}; the nearest object is "
        f"{nearest:.3g} m away",
        worst <= nearest,
        worst,
        nearest,
        "m",
    )
