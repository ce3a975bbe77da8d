"""Likely causes of a contradiction between speeds, times and positions."""

from __future__ import annotations

import math

_CLOSE = 0.04
"""Largest relative difference between a ratio and the one of a unit."""

_CAUSES = (
    (3.6, "are the speeds in km/h?"),
    (2.23694, "are the speeds in miles per hour?"),
    (1.94384, "are the speeds in knots?"),
    (3.28084, "are the speeds in feet per second?"),
    (100.0, "are the speeds in cm/s?"),
    (1e3, "are the times in ms, or the positions in km?"),
    (1e6, "are the times in microseconds?"),
    (1e9, "are the times in nanoseconds?"),
    (0.3048, "are the positions in feet?"),
    (1e-2, "are the positions in cm?"),
    (1e-3, "are the positions in mm?"),
    (1 / 60, "are the times in minutes?"),
    (1 / 3600, "are the times in hours?"),
    (3.6e3, "are the times in ms, and the speeds in km/h?"),
    (3.6 * 0.3048, "are the positions in feet, and the speeds in km/h?"),
    (2.23694 * 0.3048, "are the positions in feet, and the speeds in miles per hour?"),
)
"""Ratios of the given speeds to those of the positions, with their likely causes."""

_FRAMES = (10.0, 12.0, 12.5, 15.0, 20.0, 24.0, 25.0, 29.97, 30.0, 50.0, 60.0)
"""Usual frame rates, 1/s."""

_DEGREE = 111_320.0
"""Length of a degree of latitude, m."""

_DIGITS_OF_DEGREES = 4


def cause_of(ratio: float, *, degrees: bool, whole_times: bool) -> str | None:
    """Return the likely cause of a ratio of given speeds to those of positions; None if unknown.

    Parameters
    ----------
    ratio
        Given speed divided by the speed of the positions.
    degrees
        Whether all positions could be longitudes and latitudes.
    whole_times
        Whether all times are whole numbers.
    """
    if degrees and ratio > _DEGREE / 10:
        return "are x, y degrees instead of metres (SUMO's --fcd-output.geo)?"
    if whole_times:
        frames = min(_FRAMES, key=lambda each: abs(ratio - each))
        if abs(ratio / frames - 1) < _CLOSE:
            return f"are the times numbers of frames, {frames:g} a second?"
    near = min(_CAUSES, key=lambda each: abs(math.log(max(ratio, 1e-300) / each[0])))
    return near[1] if abs(ratio / near[0] - 1) < _CLOSE else None


def could_be_degrees(low: tuple[float, float], high: tuple[float, float], digits: int) -> bool:
    """Return whether positions between two corners could be longitudes and latitudes."""
    return (
        -180 <= low[0] <= high[0] <= 180
        and -90 <= low[1] <= high[1] <= 90
        and digits >= _DIGITS_OF_DEGREES
    )
