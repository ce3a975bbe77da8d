"""Update of beliefs on the plane, each split as finely as the beams' width asks for.

A beam of an array is a trigonometric polynomial in the direction cosines. Its fastest term turns
by ``aperture`` radians per unit of a cosine, 2 pi spacing (n - 1) for n elements along an axis, and
so by omega radians over one standard deviation of a belief along one of its principal axes. Beliefs
with a small omega are one Gaussian, and the law of the variance is that of one place.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echobeam.estimation.sigma_points import principal_root
from echobeam.tracking.gaussian_sum import Law, SumPosterior, nodes, posterior, split
from echobeam.tracking.ground import GroundMeasurement
from echobeam.values import Array, GaussianState, IntArray, UavState

SIZES = (1, 3, 5, 9, 17)
"""Numbers of Gaussians along an axis; trials are brought together by it, so that none depends on
its neighbours."""

ALONE = 0.3
"""omega up to which a belief is one Gaussian: at three deviations a beam has lost 0.9 dB."""

SMOOTH = 0.8
"""omega of the Gaussians that a wider belief is split into."""


def update(
    prior: GaussianState,
    value: Array,
    law: Callable[[IntArray], Law],
    model: GroundMeasurement,
    uav: UavState,
    aperture: float,
) -> SumPosterior:
    """Return the posterior of objects on the plane.

    Parameters
    ----------
    prior
        ``(T, K)`` objects: x, y, v_x, v_y, b.
    value
        ``(T, K, 4)``: the measurement, NaN where a component was not measured.
    law
        The law of its variance for some of the trials, by index.
    model, uav
        The measurement model, and the UAV in the slot.
    aperture
        Radians by which a beam turns per unit of a direction cosine, at most.
    """
    size = points_needed(prior, model, uav, aperture)
    shape = value.shape[:2]
    parts = [np.empty((*shape, *rest)) for rest in ((5,), (5, 5), (4,), ())]
    for pair in np.unique(size, axis=0).tolist():
        trials = np.flatnonzero((size == pair).all(axis=-1))
        some = GaussianState(prior.mean[trials], prior.cov[trials], prior.known[trials])
        made = posterior(split(some, tuple(pair)), value[trials], law(trials), model, uav)
        for whole, part in zip(parts, (made.mean, made.cov, made.variance, made.nis), strict=True):
            whole[trials] = part
    return SumPosterior(*parts)


def points_needed(
    prior: GaussianState, model: GroundMeasurement, uav: UavState, aperture: float
) -> IntArray:
    """Return the numbers of Gaussians along both axes, ``(T, 2)``, for the widest of a trial.

    Parameters
    ----------
    prior, model, uav, aperture
        As for `update`.
    """
    with np.errstate(invalid="ignore"):
        slope = model.jacobian(prior.mean, uav)[..., :2, :2]  # of the cosines, by the position
        axes = principal_root(prior.cov[..., :2, :2])
        turns = aperture * np.abs(axes @ np.swapaxes(slope, -1, -2)).max(axis=-1)
    omega = np.max(np.where(prior.known[..., None], turns, 0.0), axis=1, initial=0.0)
    limits = [ALONE, *(SMOOTH / nodes(count)[2] for count in SIZES[1:-1])]
    sizes: IntArray = np.asarray(SIZES, dtype=np.int64)[np.searchsorted(limits, omega)]
    return sizes
