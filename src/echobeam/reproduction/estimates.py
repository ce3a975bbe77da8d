"""Numbers with 95 % intervals from paired trials: Student's t, delta method, bootstrap."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echobeam.reproduction.records import Estimate
from echobeam.simulation.summary import mean_interval, ratio_of_means
from echobeam.values import Array

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
    low, high = np.quantile(np.concatenate(values), [0.025, 0.975])
    return Estimate(float(statistic(*samples)), float(low), float(high))


def rms(error: Array) -> Array:
    """Return the root mean square over the last axis."""
    return np.asarray(np.sqrt(np.mean(error**2, axis=-1)))


def rms_ratio(above: Array, below: Array) -> Estimate:
    """Return the ratio of two root mean squares over paired ``(trial,)`` errors."""
    return bootstrap(lambda a, b: rms(a) / rms(b), above, below)


def quantile_ratio(above: Array, below: Array, share: float) -> Estimate:
    """Return the ratio of two quantiles over paired ``(trial,)`` samples."""
    return bootstrap(
        lambda a, b: np.quantile(a, share, axis=-1) / np.quantile(b, share, axis=-1), above, below
    )


def rms_with_band(error: Array) -> tuple[Array, Array]:
    """Return root mean square over trials ``(trial, ...)`` and its 95 % band ``(..., 2)``.

    The band is that of the mean square (Student's t), taken to the root.
    """
    square, interval = mean_interval(error**2)
    return np.sqrt(square), np.sqrt(np.maximum(interval, 0.0))
