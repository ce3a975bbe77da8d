"""Captions and axes shared by the figures: the setting as text, and the slots of a frame."""

from __future__ import annotations

import math

from echobeam.plots.looks import SHADE, Look
from echobeam.plots.record import Axis, Guide
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import ObjectTable

ANTENNAS = "$N_t$ = $N_r$ = {}"


def flight(scenario: Scenario, *, height: bool = True, antennas: bool = True) -> str:
    """Return the UAV's setting for a title, without the quantities that the figure varies."""
    uav = scenario.uav
    parts = [f"$h$ = {uav.height:g} m"] * height + [f"$v^u$ = {uav.speed:g} m/s"]
    parts += [ANTENNAS.format(scenario.array.n_tx)] * antennas
    return ", ".join(parts)


def initial(one: ObjectTable) -> str:
    """Return an object's initial angle, velocity and acceleration."""
    angle, velocity, acceleration = one.along_road
    text = f"({math.degrees(angle):.0f}°, {velocity:g} m/s, {acceleration:g} m/s²)"
    return text.replace("-", "−")


def setting(scenario: Scenario, *, height: bool = True, antennas: bool = True) -> str:
    """Return the UAV's setting and that of all objects."""
    objects = "; ".join(initial(one) for one in scenario.objects)
    return f"{flight(scenario, height=height, antennas=antennas)}; {objects}"


def slot_axis(slots: int) -> Axis:
    """Return the axis of a frame's slots."""
    ticks = tuple(range(1, slots + 1)) if slots <= 12 else ()
    return Axis("Slot", "10 ms each", limits=(0.5, slots + 0.5), ticks=ticks)


def omni_slots(name: str = "omni slot", first: tuple[int, ...] = (1,)) -> tuple[Guide, ...]:
    """Return the shaded first slots of frames."""
    return tuple(Guide("x", slot - 0.5, slot + 0.5, Look(SHADE), name) for slot in first)
