"""Innovation test: a track whose measurements keep contradicting its model is found out.

The ground is not flat where a road climbs, and a car brakes. Then innovations are larger than their
covariance says, or have one sign, slot after slot. Squares and signed sums of the normalised
innovations of a track, added up with a forgetting factor, are compared with the laws that they
have if the model holds (Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking
and Navigation*, 2001, section 5.4). What follows from a contradiction is not decided here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.brief import Brief
from echobeam.values import Array, BoolArray

MEMORY = 0.9
"""Forgetting factor for each measured slot: the last ten slots or so count."""

FALSE_ALARM = 5e-3
"""Probability that a track is found to contradict its model in a slot though the model holds.

It costs 1e-3 of the rate of a well modelled track; with 1e-2 the 5 % quantile falls by 0.009."""


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
    drift, spread
        ``(..., K, M)``: innovations over their standard deviations, weighted by age, and the
        variance of these sums.
    """

    total: Array
    degrees: Array
    squared: Array
    drift: Array
    spread: Array


def no_surprise(shape: tuple[int, ...], components: int) -> Surprise:
    """Return the memory of tracks that have no past, ``(..., K)``, of M measured components."""
    none, each = np.zeros(shape), np.zeros((*shape, components))
    return Surprise(none, none, none, each, each)


def remembered(past: Surprise, nis: Array, degrees: Array, scores: Array) -> Surprise:
    """Return the memory after a slot; a track of which nothing was measured keeps its own.

    Parameters
    ----------
    past
        Memory of the slots before.
    nis, degrees
        ``(..., K)``: normalised innovation squared, and how many components were measured. An
        innovation that is not finite does not count.
    scores
        ``(..., K, M)``: innovations over their standard deviations, 0 where not measured.
    """
    new = (degrees > 0) & np.isfinite(nis)
    keep = np.where(new, MEMORY, 1.0)
    count = np.where(new, degrees, 0.0)
    return Surprise(
        keep * past.total + np.where(new, nis, 0.0),
        keep * past.degrees + count,
        keep * keep * past.squared + count,
        keep[..., None] * past.drift + np.where(new[..., None], scores, 0.0),
        (keep * keep)[..., None] * past.spread + (new[..., None] & (scores != 0.0)),
    )


def failing(memory: Surprise, tested: BoolArray) -> BoolArray:
    """Return which tracks contradict their model, ``(..., K)``.

    The weighted sum of squares has nearly the law of s chi^2_n with its own mean and variance
    (Satterthwaite, Biometrics Bulletin 2, 1946). The weighted sum of a component's innovations is
    normal: an error that stays, such as that of a height, drifts, long before the squares show it.

    Parameters
    ----------
    memory
        Of the slots until now.
    tested
        ``(..., K)``: tracks that were measured in this slot.
    """
    from scipy.special import chdtri

    share = FALSE_ALARM / (1 + memory.drift.shape[-1])
    with np.errstate(all="ignore"):
        scale = memory.squared / memory.degrees
        large = memory.total > scale * chdtri(memory.degrees / scale, share)
        drifts = memory.drift**2 > memory.spread * chdtri(1.0, share)
    return np.asarray(tested & (large | drifts.any(axis=-1)))
