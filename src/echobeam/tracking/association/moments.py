"""One Gaussian in place of a weighted mixture: the mean and covariance of the mixture."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.gaussian import wrap
from echobeam.faults import InputError
from echobeam.values import Array


def moment_matched(
    weight: Array, mean: Array, cov: Array, angles: tuple[int, ...] = ()
) -> tuple[Array, Array]:
    """Return mean ``(..., S)`` and covariance ``(..., S, S)`` of a mixture of Gaussians.

    The covariance is the mean of the covariances plus the spread of the means (Bar-Shalom, Li and
    Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 1.4.16).
    Of all Gaussians this one is closest to the mixture in Kullback-Leibler divergence.

    Parameters
    ----------
    weight
        ``(..., K)``, not negative; divided by their sum.
    mean, cov
        ``(..., K, S)`` and ``(..., K, S, S)``: of the parts. Those of weight zero are not read and
        may be NaN.
    angles
        Components that are angles, as in `StateSpace.angles`. Their differences are taken the
        short way round from the heaviest part, and their mean is in (-pi, pi].

    Returns
    -------
    mean, cov
        NaN where all weights are zero.
    """
    size = mean.shape[-1]
    if cov.shape[-2:] != (size, size) or mean.shape[-2] != weight.shape[-1]:
        raise InputError(
            f"weights, means and covariances of shapes {weight.shape}, {mean.shape} and "
            f"{cov.shape} do not fit: (..., K), (..., K, S) and (..., K, S, S) are needed"
        )
    if not (weight >= 0.0).all():
        raise InputError("weights must not be negative")
    used = weight > 0.0
    total = weight.sum(axis=-1, keepdims=True)
    share = weight / np.where(total > 0.0, total, np.nan)
    heaviest = weight.argmax(axis=-1)[..., None, None]
    reference = np.take_along_axis(mean, heaviest, axis=-2)
    offset = np.where(used[..., None], mean - reference, 0.0)
    for component in angles:
        offset[..., component] = wrap(offset[..., component])
    shift = (share[..., None] * offset).sum(axis=-2)
    middle = reference[..., 0, :] + shift
    for component in angles:
        middle[..., component] = wrap(middle[..., component])
    spread = offset - shift[..., None, :]
    within = np.where(used[..., None, None], cov, 0.0)
    parts = within + spread[..., :, None] * spread[..., None, :]
    matched: Array = (share[..., None, None] * parts).sum(axis=-3)
    return middle, matched
