"""Sine and cosine that are exactly zero at the angles where they mean to be.

The double nearest to pi/2 means 90 degrees, yet its cosine is 6e-17: a bound that should be
infinite would be 1e33, a UAV that sinks straight down would drift. Values below the spacing of
the doubles near 1 carry nothing of the angle, so they are taken as zero.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.values import Array


def exact_cosine(theta: npt.ArrayLike) -> Array:
    """Return cos(theta), exactly zero at 90 degrees; ``(...)`` rad to ``(...)``, NaN to NaN."""
    return _without_residue(np.cos(np.asarray(theta, dtype=np.float64)))


def exact_sine(theta: npt.ArrayLike) -> Array:
    """Return sin(theta), exactly zero at 180 degrees; ``(...)`` rad to ``(...)``, NaN to NaN."""
    return _without_residue(np.sin(np.asarray(theta, dtype=np.float64)))


def _without_residue(value: Array) -> Array:
    return np.where(np.abs(value) < np.finfo(np.float64).eps, 0.0, value)
