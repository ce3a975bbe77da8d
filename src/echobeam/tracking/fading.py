"""Innovation test: a track whose measurements keep contradicting its model becomes less certain.

The ground is not flat where a road climbs, and a car brakes. Then innovations are larger than their
covariance says, slot after slot. The normalised innovations squared of a track, added up with a
forgetting factor, are compared with the chi-square law that they have if the model holds; where
they exceed it the covariance is widened by the ratio (a fading memory with a test in front: Xia,
Rao, Ying and Shen, "Adaptive fading Kalman filter with an application", Automatica 30, 1994). The
state is left alone, and so are measurements: a wider covariance follows the next ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.brief import Brief
from echobeam.values import Array, BoolArray

MEMORY = 0.8
"""Forgetting factor for each measured slot: the last five slots or so count."""

FALSE_ALARM = 1e-3
"""Probability that the test widens a track in a slot though the model holds."""


@dataclass(frozen=True, slots=True, repr=False)
class Surprise(Brief):
    """Recent innovations of every track.

    Attributes
    ----------
    total, degrees
        ``(..., K)``: normalised innovations squared and the measured components, both weighted
        by age; the mean of the first is the second.
    squared
        ``(..., K)``: components weighted by the squares: the variance of the total is twice this.
    """

    total: Array
    degrees: Array
    squared: Array


def no_surprise(shape: tuple[int, ...]) -> Surprise:
    """Return the memory of tracks that have no past, ``(..., K)``."""
    return Surprise(np.zeros(shape), np.zeros(shape), np.zeros(shape))


def remembered(past: Surprise, nis: Array, degrees: Array) -> Surprise:
    """Return the memory after a slot; a track of which nothing was measured keeps its own.

    Parameters
    ----------
    past
        Memory of the slots before.
    nis, degrees
        ``(..., K)``: normalised innovation squared, and how many components were measured. An
        innovation that is not finite does not count.
    """
    new = (degrees > 0) & np.isfinite(nis)
    keep = np.where(new, MEMORY, 1.0)
    count = np.where(new, degrees, 0.0)
    return Surprise(
        keep * past.total + np.where(new, nis, 0.0),
        keep * past.degrees + count,
        keep * keep * past.squared + count,
    )


def widening(memory: Surprise, tested: BoolArray) -> tuple[Array, Surprise]:
    """Return the factor ``(..., K)`` of each covariance, at least 1, and the memory after it.

    The weighted sum has nearly the law of s chi^2_n with its own mean and variance (Satterthwaite,
    Biometrics Bulletin 2, 1946). A track that was widened starts anew: its innovations are as
    large as it says now.

    Parameters
    ----------
    memory
        Of the slots until now.
    tested
        ``(..., K)``: tracks that were measured in this slot.
    """
    from scipy.special import chdtri

    with np.errstate(all="ignore"):
        scale = memory.squared / memory.degrees
        limit = scale * chdtri(memory.degrees / scale, FALSE_ALARM)
        fails = tested & (memory.total > limit)
        factor = np.where(fails, memory.total / memory.degrees, 1.0)
    left = [np.where(fails, 0.0, each) for each in (memory.total, memory.degrees, memory.squared)]
    return factor, Surprise(*left)
