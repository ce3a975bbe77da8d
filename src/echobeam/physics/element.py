"""Patterns of an array's elements, which all have the same: 3GPP TR 38.901, table 7.3-1."""

from __future__ import annotations

from typing import Literal

import numpy as np

from echobeam.values import Array

Element = Literal["isotropic", "3gpp"]
"""Pattern of an element: 1 in front of the array, or that of the standard."""

PEAK = 8.0
"""Gain of the standard's element towards the normal, dBi."""

WIDTH = 65.0
"""Half-power width of the standard's element in both planes, degrees."""

LEAST = 30.0
"""Attenuation of the standard's element to the side and in all, dB."""


def element_gain(u: Array, v: Array, w: Array) -> Array:
    """Return the power gain of the standard's element, ``(...)``, linear.

    A = -min(A_u + A_v, 30 dB) with A_x = min(12 (x / 65 degrees)^2, 30 dB) for the elevation
    arcsin(u) and the azimuth atan2(v, w) in the array's frame, and 8 dBi at the peak.

    Parameters
    ----------
    u, v, w
        ``(...)``: direction cosines to e_u, to e_v and to the normal.
    """
    elevation = np.degrees(np.arcsin(np.clip(u, -1.0, 1.0)))
    azimuth = np.degrees(np.arctan2(v, w))
    one, other = (
        np.minimum(12.0 * np.square(angle / WIDTH), LEAST) for angle in (elevation, azimuth)
    )
    gain: Array = 10.0 ** (0.1 * (PEAK - np.minimum(one + other, LEAST)))
    return gain
