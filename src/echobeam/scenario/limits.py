"""Limits of a scenario's numbers: beyond what anybody flies or builds, within what floats square.

Laws of the link and of the filter take squares and products of several quantities. With each of
them between its limits these stay numbers, so that no run ends in infinities.
"""

from __future__ import annotations

import math

from echobeam.units import SPEED_OF_LIGHT, UNITS, QuantityError, parse_quantity

LEAST = 1e-30
"""Least magnitude of any quantity but zero, SI: with its inverse the range of plain numbers."""

MOST = {
    "angle": 1e3,
    "length": 1e9,
    "time": 1e9,
    "frequency": 1e18,
    "acceleration": 1e9,
    "rate": 300.0,
    "number": 1e30,
}
"""Largest magnitude of each kind of quantity, SI. 1e3 rad are 159 turns; 1e9 m is beyond the moon;
1e9 s are 32 years; 1e18 Hz are X-rays; 300 bit/s/Hz take an SNR of 2e90, and more are no beam
problem; 1e30 of a plain number is 300 dB."""

SLOWER = f"less than the speed of light, {SPEED_OF_LIGHT:g} m/s"
"""Words for the largest speed."""

MOST_SPACING = 100.0
"""Largest antenna spacing in wavelengths, as of beam problems."""

MOST_PULSE = 1e4
"""Longest pulse, s: a Doppler shift is then exact to a thousandth of a millihertz."""

MOST_HEIGHT_STD = 1e4
"""Largest standard deviation of a height, m: above those of all flights in the air."""

MOST_FALSE = 1000.0
"""Mean number of detections of no object in a slot: ten times the most of ``radar.clutter``."""

MOST_COVER_POINTS = 2e6
"""Grid points of the widest cover: designs of such a one take 2 GB and some seconds."""


def limited_quantity(value: object, kind: str, most: float | None = None) -> float:
    """Return a quantity in SI units and radians, within the limits of its kind.

    Parameters
    ----------
    value, kind
        As in `parse_quantity`.
    most
        Largest magnitude in place of the kind's.

    Raises
    ------
    QuantityError
        If it is no quantity of this kind, or beyond the limits.
    """
    number = parse_quantity(value, kind)
    unit = next((f" {unit}" for unit in UNITS[kind]), "")
    if number and abs(number) < LEAST:
        raise QuantityError(
            f"{value!r} is not accepted; expected at least {LEAST:g}{unit} in magnitude, if not 0"
        )
    if kind == "speed":
        if not abs(number) < SPEED_OF_LIGHT:
            raise QuantityError(f"{value!r} is not accepted; expected {SLOWER}")
        return number
    largest = MOST[kind] if most is None else most
    if abs(number) > largest:
        raise QuantityError(
            f"{value!r} is not accepted; expected at most {largest:g}{unit} in magnitude"
        )
    return number


def cover_points(max_halfwidth: float, resolution: float, *, planar: bool) -> float:
    """Return about how many grid points the widest cover of (38f) takes.

    Parameters
    ----------
    max_halfwidth, resolution
        rad, ``coverage.max_halfwidth`` and the step of the grid.
    planar
        Whether it is a square lattice in direction cosines, over the circle whose radius is the
        sine of the half-width, and not a row of angles.
    """
    reach = math.sin(max_halfwidth) if planar else max_halfwidth
    row = 2.0 * reach / resolution + 1.0
    return row * row if planar else row
