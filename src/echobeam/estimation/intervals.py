"""Numbers from independent trials with 95 % intervals: Student's t, delta method, ranks, bootstrap.

Each function returns a value and the two ends of its interval; NaN where trials are too few.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from echobeam.values import Array

CONFIDENCE = 0.95
RESAMPLES = 2000
LEAST_RESAMPLED = 10
"""Trials below which a bootstrap says nothing of the spread, and gives no interval."""

_SEED = 20240607  # of the bootstrap: the same draws every time
_CHUNK = 250

Ends = tuple[float, float]


def quotient(total: npt.ArrayLike, count: npt.ArrayLike) -> Array:
    """Return total over count, NaN where there is nothing to count."""
    total, count = np.asarray(total, dtype=float), np.asarray(count, dtype=float)
    ratio: Array = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
    return ratio


def mean_interval(values: Array) -> tuple[Array, Array]:
    """Return mean over the first axis and its interval ``(..., 2)`` (Student's t)."""
    n = values.shape[0]
    mean = values.mean(axis=0)
    deviation = values.std(axis=0, ddof=1) if n > 1 else np.full(mean.shape, np.nan)
    half = _half_width(deviation, n)
    return mean, np.stack([mean - half, mean + half], axis=-1)


def ratio_of_means(above: Array, below: Array) -> tuple[float, Ends]:
    """Return mean(above) / mean(below) over paired samples and its interval (delta method)."""
    if not below.sum() > 0:
        return np.nan, (np.nan, np.nan)
    ratio = float(above.mean() / below.mean())
    deviation = np.std(above - ratio * below, ddof=1) if above.size > 1 else np.nan
    half = float(_half_width(deviation, above.size) / below.mean())
    return ratio, (ratio - half, ratio + half)


def share_interval(hits: int, trials: int) -> Ends:
    """Return the interval of a share by Clopper and Pearson, exact for independent trials."""
    from scipy.special import betaincinv

    tail = 0.5 - CONFIDENCE / 2
    low = float(betaincinv(hits, trials - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, trials - hits, 1.0 - tail)) if hits < trials else 1.0
    return low, high


def quantile_interval(samples: Array, share: float) -> tuple[float, Ends]:
    """Return a quantile of ``(trial, n)`` samples and its interval by the ranks around it.

    The samples of one trial count as one.
    """
    from scipy.special import ndtri

    trials = len(samples)
    value = float(np.quantile(samples, share))
    if trials < 2:
        return value, (np.nan, np.nan)
    reach = float(ndtri(0.5 + CONFIDENCE / 2)) * np.sqrt(share * (1.0 - share) / trials)
    low, high = np.quantile(samples, np.clip([share - reach, share + reach], 0.0, 1.0))
    return value, (float(low), float(high))


def bootstrap(statistic: Callable[..., Array], *samples: Array) -> tuple[float, Ends]:
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
    if trials < LEAST_RESAMPLED:
        return float(statistic(*samples)), (np.nan, np.nan)
    random = np.random.default_rng(_SEED)
    values = []
    for _ in range(0, RESAMPLES, _CHUNK):
        drawn = random.integers(0, trials, (_CHUNK, trials))
        values.append(statistic(*(one[drawn] for one in samples)))
    # no interpolation: a statistic may be infinite
    ordered = np.sort(np.concatenate(values))
    low, high = (float(ordered[round(q * (ordered.size - 1))]) for q in (0.025, 0.975))
    return float(statistic(*samples)), (low, high)


def rms(error: Array) -> Array:
    """Return the root mean square over the last axis, of those that are not NaN."""
    found = np.isfinite(error)
    return np.sqrt(quotient(np.square(np.where(found, error, 0.0)).sum(-1), found.sum(-1)))


def rms_interval(error: Array) -> tuple[Array, Array]:
    """Return root mean square over trials ``(trial, ...)`` and its interval ``(..., 2)``.

    The interval is the percentile bootstrap's, with the same draws every time. A trial whose error
    is NaN, for want of an estimate, does not count.
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


def _half_width(deviation: npt.ArrayLike, n: int) -> Array:
    from scipy.special import stdtrit

    quantile = float(stdtrit(max(n - 1, 1), 0.5 + CONFIDENCE / 2))
    half: Array = np.asarray(deviation) * (quantile / np.sqrt(n))
    return half
