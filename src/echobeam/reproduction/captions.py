"""Captions that the paper's figures share: the setting in words."""

from __future__ import annotations

import math

from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import ObjectTable

ANTENNAS = "$N_t$ = $N_r$ = {}"


def flight(scenario: Scenario, *, height: bool = True, antennas: bool = True) -> str:
    """Return the UAV's setting as a title says it; leave out what the figure varies."""
    uav = scenario.uav
    parts = [f"$h$ = {uav.height:g} m"] * height + [f"$v^u$ = {uav.speed:g} m/s"]
    parts += [ANTENNAS.format(scenario.array.n_tx)] * antennas
    return ", ".join(parts)


def initial(one: ObjectTable) -> str:
    """Return an object's initial angle, velocity and acceleration."""
    text = f"({math.degrees(one.angle):.0f}°, {one.velocity:g} m/s, {one.acceleration:g} m/s²)"
    return text.replace("-", "−")


def setting(scenario: Scenario, *, height: bool = True, antennas: bool = True) -> str:
    """Return the UAV's setting and that of all objects."""
    objects = "; ".join(initial(one) for one in scenario.objects)
    return f"{flight(scenario, height=height, antennas=antennas)}; {objects}"
