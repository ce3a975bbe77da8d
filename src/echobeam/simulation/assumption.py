"""An assumption of the model, and the extremes of a motion that decide on some of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

SQUINT = 0.1
"""Largest product of bandwidth and transit time over the array of a narrow-band model, 1."""


@dataclass(frozen=True, slots=True)
class Assumption:
    """Assumption of the model, and whether it holds in a scenario.

    Attributes
    ----------
    name
        Name in a few words.
    statement
        Sentence with the numbers.
    holds
        Whether it holds; None if the scenario does not determine it.
    value, limit
        Number and its bound, both in `unit`; NaN if there are none.
    unit
        SI unit.
    """

    name: str
    statement: str
    holds: bool | None = None
    value: float = math.nan
    limit: float = math.nan
    unit: str = "1"


def no_grating_lobes(spacing: float, farthest: float) -> Assumption:
    """Return the assumption that beams have a single main lobe.

    Parameters
    ----------
    spacing
        Of the antennas, wavelengths.
    farthest
        Largest sine or cosine, along an array, of the directions that beams are sent to.
    """
    limit = 1.0 / (1.0 + farthest)
    return Assumption(
        "no grating lobes",
        f"antennas are {spacing:.3g} wavelengths apart; beams towards the objects have a single "
        f"main lobe up to {limit:.3g}",
        spacing <= limit,
        spacing,
        limit,
    )


@dataclass(frozen=True, slots=True)
class Extremes:
    """Extremes of a run's motion, without process noise; NaN if no object is in the scene.

    Attributes
    ----------
    slots
        Number of slots checked.
    nearest
        Smallest distance of an object, m.
    closing
        Largest radial speed, m/s.
    turning
        Largest rate at which the direction of an object turns, rad/s.
    """

    slots: int
    nearest: float
    closing: float
    turning: float
