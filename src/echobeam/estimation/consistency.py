"""Consistency of a filter's covariances: normalised squared errors and their bands.

A matched filter's normalised estimation error squared (NEES) is chi-square distributed with as
many degrees of freedom as the state has components, its normalised innovation squared (NIS) with
as many as were measured. A filter with larger means is overconfident, one with smaller means
states more uncertainty than it has.
"""

from __future__ import annotations

import numpy as np

from echobeam.estimation.gaussian import innovation_cov, square_norm, wrap
from echobeam.values import Array


def nees(error: Array, cov: Array, angles: tuple[int, ...]) -> Array:
    """Return the normalised estimation error squared, e^T P^-1 e, ``(...)``.

    Parameters
    ----------
    error
        ``(..., S)``: estimate minus truth; NaN gives NaN.
    cov
        ``(..., S, S)``: covariance of the estimate. NaN comes back where it is singular to working
        precision, as where the estimate lies on a curve in the state space.
    angles
        Components of the error that are angles; they are wrapped to (-pi, pi].
    """
    return square_norm(_wrapped(error, angles), cov)


def nis(innovation: Array, cov: Array, H: Array, variance: Array, angles: tuple[int, ...]) -> Array:
    """Return the normalised innovation squared, nu^T (H P H^T + Q_m)^-1 nu, ``(...)``.

    Parameters
    ----------
    innovation
        ``(..., M)``: measured minus predicted. A component that is not finite, or whose variance
        is not, does not count, neither here nor in the degrees of freedom.
    cov
        ``(..., S, S)``: prior covariance.
    H
        ``(..., M, S)``: Jacobian of the measurement at the prior mean.
    variance
        ``(..., M)``, positive: of the measurement noise.
    angles
        Components of the innovation that are angles; they are wrapped to (-pi, pi].
    """
    used = np.isfinite(variance) & np.isfinite(innovation)
    noise = np.where(used, variance, np.inf)
    difference = _wrapped(np.where(used, innovation, 0.0), angles)
    return square_norm(difference, innovation_cov(cov, H, noise))


def chi_square_band(
    degrees: float, samples: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Return the band in which a mean of independent chi-square variables lies.

    Parameters
    ----------
    degrees
        Degrees of freedom of each: state components (NEES) or measured components (NIS).
    samples
        Number of independent variables in the mean, for instance trials; those of successive
        slots of one track are not independent (NEES).
    confidence
        Probability of the band; half of the rest is below it and half above.
    """
    from scipy.stats import chi2

    tail = 0.5 * (1.0 - confidence)
    low, high = chi2.ppf([tail, 1.0 - tail], degrees * samples) / samples
    return float(low), float(high)


def share_band(probability: float, samples: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the band in which the share of successes of independent trials lies.

    Parameters
    ----------
    probability
        Of a success.
    samples
        Number of trials.
    confidence
        Least probability of the band: shares are whole multiples of 1 / samples.
    """
    from scipy.stats import binom

    tail = 0.5 * (1.0 - confidence)
    low, high = binom.ppf([tail, 1.0 - tail], samples, probability) / samples
    return float(low), float(high)


def _wrapped(error: Array, angles: tuple[int, ...]) -> Array:
    """Return a copy of the errors with the angles among them wrapped."""
    error = np.array(error, dtype=np.float64)
    for component in angles:
        error[..., component] = wrap(error[..., component])
    return error
