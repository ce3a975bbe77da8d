"""Numbers as users read them: decibels, degrees, units with prefixes."""

from __future__ import annotations

import math


def decibels(ratio: float) -> str:
    """Return a ratio of powers in dB."""
    return f"{10.0 * math.log10(ratio):.1f}" if ratio > 0.0 else "-inf"


def dbm(power: float) -> str:
    """Return watts in dBm."""
    return f"{decibels(1e3 * power)} dBm"


def watts(power: float) -> str:
    """Return watts, and dBm beside."""
    return f"{scaled(power, 'W')} ({dbm(power)})"


def duration(seconds: float) -> str:
    """Return a time with its unit."""
    return scaled(seconds, "s")


def degrees(angle: float) -> str:
    """Return an angle in degrees."""
    return f"{math.degrees(angle):.3g}"


def scaled(value: float, unit: str) -> str:
    """Return a number to four digits with its unit and an SI prefix."""
    for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "u")):
        if value >= factor * (1.0 - 1e-12):
            return f"{value / factor:.4g} {prefix}{unit}"
    return f"{value / 1e-9:.4g} n{unit}"
