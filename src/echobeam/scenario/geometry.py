"""Checks of a scenario's geometry: which keys have a meaning in it, and which motions can be.

They take the scenario as it is, of no type: its module imports this one.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from echobeam.faults import InputError
from echobeam.scenario.limits import MOST, MOST_COVER_POINTS, SLOWER, cover_points
from echobeam.scenario.tables import (
    LINEAR_KEYS,
    PLANAR_KEYS,
    CoverageTable,
    ObjectTable,
    UavTable,
)
from echobeam.units import SPEED_OF_LIGHT

ROAD_KEYS = {
    "uav": ("height", "speed", "heading", "floor"),
    "objects": ("angle",),
    "filter": ("angle_std", "distance_std", "evolution"),
    "truth": ("angle_std", "distance_std"),
    "trace": ("road",),
}
"""Keys of each table that only a road has."""

_GROUND_KEYS = {"uav": ("position", "velocity", "waypoints"), "objects": ("position", "path")}
_INSTEAD = {
    "uav.height": "uav.position",
    "uav.speed": "uav.velocity",
    "uav.heading": "uav.velocity",
    "objects.angle": "position",
    "uav.position": "uav.height",
    "uav.velocity": "uav.speed",
    "objects.position": "angle",
}


def meaningless_keys(scenario: Any) -> dict[str, tuple[str, ...]]:
    """Return the keys of each table that have no meaning in a scenario, and are not written."""
    planar = scenario.array.kind == "planar"
    array = (*LINEAR_KEYS, "n_tx") if planar else PLANAR_KEYS
    return {"array": array, **(_GROUND_KEYS if scenario.geometry == "road" else ROAD_KEYS)}


def check_geometry(scenario: Any) -> None:
    """Refuse what a scenario's geometry does not have.

    Raises
    ------
    ValueError
        Names the key, its value and what is expected.
    """
    _check_keys(scenario)
    check_cover(scenario.geometry, scenario.coverage)
    duration = scenario.frame.slot * scenario.n_slots
    if scenario.geometry == "road":
        if scenario.array.kind == "planar":
            raise ValueError('array.kind: "planar" needs geometry = "ground"')
        for number, item in enumerate(scenario.objects):
            _check_on_road(item, f"objects.{number}", scenario.uav.height)
            _check_speed(item, f"objects.{number}", duration)
        return
    _check_flight(scenario.uav, duration)
    for number, item in enumerate(scenario.objects):
        _check_on_ground(item, f"objects.{number}")
        _check_speed(item, f"objects.{number}", duration)
    sizes = (scenario.array.rows, scenario.array.columns, *scenario.array.receive_shape)
    if scenario.unlabelled and 1 in (one or 1 for one in sizes):
        raise ValueError(
            'radar.detections: "unlabelled" needs both direction cosines with geometry = "ground"; '
            "expected a planar array of at least two rows and columns"
        )
    if scenario.radar.model == "signal":
        _check_signal(scenario)


def check_background(scenario: Any) -> None:
    """Refuse a background channel without signals.

    Raises
    ------
    ValueError
        Names the key, its value and what is expected.
    """
    name = scenario.radar.background
    if name != "none" and scenario.radar.model != "signal":
        raise ValueError(
            f'radar.background: {name!r} needs echo signals; expected "none", or radar.model = '
            '"signal"'
        )


def _check_signal(scenario: Any) -> None:
    """Refuse what echo signals of a planar array do not have."""
    if scenario.array.polarisations == 2:
        raise ValueError(
            'array.polarisations: 2 is not accepted with radar.model = "signal"; expected 1'
        )
    for key in ("ground_clutter", "self_interference"):
        value = getattr(scenario.radar, key)
        if value > 0.0:
            raise ValueError(
                f'radar.{key}: {value:g} is not accepted with geometry = "ground"; expected 0'
            )


def _check_keys(scenario: Any) -> None:
    others = _GROUND_KEYS if scenario.geometry == "road" else ROAD_KEYS
    tables = [("uav", "uav", scenario.uav)]
    tables += [("objects", f"objects.{n}", item) for n, item in enumerate(scenario.objects)]
    tables += [("filter", "filter", scenario.filter), ("truth", "truth", scenario.truth)]
    if scenario.trace is not None:
        tables += [("trace", "trace", scenario.trace)]
        _check_origin(scenario)
    for table, label, item in tables:
        for key in others.get(table, ()):
            if key in item.model_fields_set and getattr(item, key) is not None:
                instead = _INSTEAD.get(f"{table}.{key}")
                hint = f"; expected {instead}" if instead else ""
                raise ValueError(
                    f'{label}.{key}: not a key with geometry = "{scenario.geometry}"{hint}'
                )


def _check_origin(scenario: Any) -> None:
    """Refuse a point on a road, and a length in the plane."""
    origin, road = scenario.trace.origin, scenario.geometry == "road"
    if origin is not None and isinstance(origin, tuple) == road:
        wanted = "one length, along the road" if road else "two lengths, x and y"
        given = list(origin) if road else f"{origin:g}"
        raise ValueError(
            f'trace.origin: {given} is not accepted with geometry = "{scenario.geometry}"; '
            f"expected {wanted}"
        )


def _check_on_road(item: ObjectTable, label: str, height: float) -> None:
    if item.angle is None:
        raise ValueError(f"{label}.angle: missing")
    distance = height / math.sin(item.angle)
    if distance > MOST["length"]:
        raise ValueError(
            f"{label}.angle: {item.angle:g} rad is not accepted, {distance:.3g} m away; expected "
            f"at most {MOST['length']:g} m"
        )
    for name in ("velocity", "acceleration"):
        value = getattr(item, name)
        if isinstance(value, tuple):
            raise ValueError(
                f"{label}.{name}: {list(value)} is not accepted; expected one number along the road"
            )


def _check_on_ground(item: ObjectTable, label: str) -> None:
    if (item.position is None) == (item.path is None):
        given = "both position and path" if item.path is not None else "neither position nor path"
        raise ValueError(f"{label}: {given}; expected one of the two")
    for name in ("velocity", "acceleration"):
        value = getattr(item, name)
        if value == 0.0:  # none, as written where nothing was given
            continue
        if item.path is not None:
            raise ValueError(f"{label}.{name}: not together with a path; leave it out")
        if not isinstance(value, tuple):
            raise ValueError(
                f"{label}.{name}: {value:g} is not accepted; expected two numbers, along x and y"
            )


def check_cover(geometry: str, coverage: CoverageTable) -> None:
    """Refuse a grid of (38f) that does not fit in memory where the cover is widest.

    Raises
    ------
    InputError
        Names the key, its value and what is expected.
    """
    planar = geometry == "ground"
    points = cover_points(coverage.max_halfwidth, coverage.resolution, planar=planar)
    if points > MOST_COVER_POINTS:
        raise InputError(
            f"coverage.resolution: {coverage.resolution:g} rad is not accepted: the widest cover, "
            f"coverage.max_halfwidth = {coverage.max_halfwidth:g} rad, would have {points:.3g} "
            f"grid points; expected at most {MOST_COVER_POINTS:g}"
        )


def _check_speed(item: ObjectTable, label: str, duration: float) -> None:
    """Refuse an object that is as fast as light when it appears or at its end."""
    there = min(duration, math.inf if item.leaves is None else item.leaves) - item.appears
    velocity, gain = (np.atleast_1d(each) for each in (item.velocity, item.acceleration))
    begin, end = np.linalg.norm(velocity), np.linalg.norm(velocity + gain * max(there, 0.0))
    if not begin < SPEED_OF_LIGHT:
        raise ValueError(f"{label}.velocity: {begin:g} m/s is not accepted; expected {SLOWER}")
    if not end < SPEED_OF_LIGHT:
        raise ValueError(
            f"{label}.acceleration: {end:g} m/s in the end is not accepted; expected {SLOWER}"
        )


def _check_flight(uav: UavTable, duration: float) -> None:
    """Refuse a flight without a beginning, or that goes to the ground or below."""
    if (uav.position is None) == (uav.waypoints is None):
        both = uav.position is not None
        given = "both position and waypoints" if both else "neither position nor waypoints"
        raise ValueError(f'uav: {given}; expected one of the two with geometry = "ground"')
    if uav.waypoints is not None:
        if uav.velocity is not None:
            raise ValueError("uav.velocity: not together with waypoints; leave it out")
        heights = {f"uav.waypoints.{n}": point[3] for n, point in enumerate(uav.waypoints)}
    else:
        assert uav.position is not None
        speed = math.hypot(*(uav.velocity or ()))
        if not speed < SPEED_OF_LIGHT:
            raise ValueError(f"uav.velocity: {speed:g} m/s is not accepted; expected {SLOWER}")
        climb = 0.0 if uav.velocity is None else uav.velocity[2]
        heights = {"uav.position": uav.position[2]}
        if heights["uav.position"] > 0.0:
            heights["uav.velocity"] = uav.position[2] + climb * duration
    for key, height in heights.items():
        if not height > 0.0 or not np.isfinite(height):
            when = " at the end of the run" if key == "uav.velocity" else ""
            raise ValueError(
                f"{key}: the UAV is {height:g} m high{when}; expected it above the ground"
            )
