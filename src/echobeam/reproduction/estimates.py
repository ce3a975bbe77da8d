"""Estimates with 95 % intervals for the claims, from paired ``(trial,)`` samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echobeam.estimation import intervals
from echobeam.estimation.intervals import rms
from echobeam.reproduction.records import Estimate
from echobeam.values import Array, BoolArray


def mean(values: Array) -> Estimate:
    """Return the mean with Student's interval."""
    centre, (low, high) = intervals.mean_interval(values)
    return Estimate(float(centre), float(low), float(high))


def ratio(above: Array, below: Array) -> Estimate:
    """Return mean(above) / mean(below) by the delta method."""
    value, ends = intervals.ratio_of_means(above, below)
    return Estimate(value, *ends)


def gain_percent(above: Array, below: Array) -> Estimate:
    """Return the excess of one mean over another, %."""
    return ratio(above, below).scaled(100.0, -100.0)


def bootstrap(statistic: Callable[..., Array], *samples: Array) -> Estimate:
    """Return a statistic of samples with its bootstrap interval, see `intervals.bootstrap`."""
    value, ends = intervals.bootstrap(statistic, *samples)
    return Estimate(value, *ends)


def rms_ratio(above: Array, below: Array) -> Estimate:
    """Return the ratio of two root mean squares."""
    return bootstrap(lambda a, b: rms(a) / rms(b), above, below)


def proportion(hits: BoolArray) -> Estimate:
    """Return the share of True trials, with Clopper and Pearson's interval."""
    return Estimate(float(hits.mean()), *intervals.share_interval(int(hits.sum()), hits.size))


def crossing(x: Array, ratio_along: Array) -> Array:
    """Return the x from which a ratio ``(..., len(x))`` stays below 1, interpolated.

    Infinity if the ratio is above 1 at the end, minus infinity if it is always below 1.
    """
    above = ratio_along >= 1.0
    last = above.shape[-1] - 1 - np.argmax(above[..., ::-1], axis=-1)
    left = np.minimum(last, len(x) - 2)[..., None]
    before = np.take_along_axis(ratio_along, left, axis=-1)[..., 0]
    after = np.take_along_axis(ratio_along, left + 1, axis=-1)[..., 0]
    fall = np.where(before > after, before - after, 1.0)
    at = x[left[..., 0]] + (before - 1.0) / fall * (x[left[..., 0] + 1] - x[left[..., 0]])
    at = np.where(above[..., -1], np.inf, at)
    return np.asarray(np.where(above.any(axis=-1), at, -np.inf))
