"""Numbers with 95 % intervals from paired trials: Student's t, delta method, bootstrap."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echobeam.reproduction.records import Estimate
from echobeam.simulation.statistics import quotient
from echobeam.simulation.summary import mean_interval, ratio_of_means
from echobeam.values import Array, BoolArray

RESAMPLES = 2000
_SEED = 20240607
_CHUNK = 250


def mean(values: Array) -> Estimate:
    """Return the mean of ``(trial,)`` samples with Student's interval."""
    centre, (low, high) = mean_interval(values)
    return Estimate(float(centre), float(low), float(high))


def ratio(above: Array, below: Array) -> Estimate:
    """Return mean(above) / mean(below) over paired ``(trial,)`` samples, by the delta method."""
    value, (low, high) = ratio_of_means(above, below)
    return Estimate(value, low, high)


def gain_percent(above: Array, below: Array) -> Estimate:
    """Return by how many per cent one mean lies above another, over paired trials."""
    return ratio(above, below).scaled(100.0, -100.0)


def bootstrap(statistic: Callable[..., Array], *samples: Array) -> Estimate:
    """Return a statistic of paired samples with its percentile bootstrap interval.

    The same trials are drawn for all samples, and the same draws are made every time.

    Parameters
    ----------
    statistic
        Takes the samples as ``(..., trial)`` and returns ``(...)``.
    samples
        ``(trial,)`` each, of equal length.
    """
    trials = samples[0].shape[0]
    random = np.random.default_rng(_SEED)
    values = []
    for _ in range(0, RESAMPLES, _CHUNK):
        drawn = random.integers(0, trials, (_CHUNK, trials))
        values.append(statistic(*(one[drawn] for one in samples)))
    # no interpolation: a statistic may be infinite
    ordered = np.sort(np.concatenate(values))
    low, high = (float(ordered[round(q * (ordered.size - 1))]) for q in (0.025, 0.975))
    return Estimate(float(statistic(*samples)), low, high)


def rms(error: Array) -> Array:
    """Return the root mean square over the last axis, of those that are not NaN."""
    found = np.isfinite(error)
    return np.sqrt(quotient(np.square(np.where(found, error, 0.0)).sum(-1), found.sum(-1)))


def rms_ratio(above: Array, below: Array) -> Estimate:
    """Return the ratio of two root mean squares over paired ``(trial,)`` errors."""
    return bootstrap(lambda a, b: rms(a) / rms(b), above, below)


def rms_with_band(error: Array) -> tuple[Array, Array]:
    """Return root mean square over trials ``(trial, ...)`` and its 95 % band ``(..., 2)``.

    The band is the percentile bootstrap's, with the same draws every time. A trial whose error is
    NaN, for want of an estimate, does not count.
    """
    found = np.isfinite(error)
    square = np.square(np.where(found, error, 0.0))
    trials = len(square)
    weights = np.random.default_rng(_SEED).multinomial(
        trials, np.full(trials, 1.0 / trials), RESAMPLES
    )
    total, count = (np.tensordot(weights, one, axes=1) for one in (square, found))
    band = np.nanquantile(np.sqrt(quotient(total, count)), [0.025, 0.975], axis=0)
    return np.sqrt(quotient(square.sum(axis=0), found.sum(axis=0))), np.moveaxis(band, 0, -1)


def proportion(hits: BoolArray) -> Estimate:
    """Return the share of ``(trial,)`` trials that were hit, with Clopper and Pearson's interval.

    Exact for independent trials: it says something even where no trial was hit.
    """
    from scipy.special import betaincinv

    n, k = hits.size, int(hits.sum())
    low = float(betaincinv(k, n - k + 1, 0.025)) if k else 0.0
    high = float(betaincinv(k + 1, n - k, 0.975)) if k < n else 1.0
    return Estimate(k / n, low, high)


def crossing(x: Array, ratio_along: Array) -> Array:
    """Return where a ratio ``(..., len(x))`` falls below 1 and stays there, interpolated.

    Infinite if it is above 1 at the end, minus infinite if it is below 1 from the beginning.
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
