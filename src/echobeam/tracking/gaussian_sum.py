"""Posterior as a sum of Gaussians, for measurements whose variance depends on the position.

Far from where a beam points an echo is weak, and what is measured there is inaccurate. So the
accuracy of a measurement is itself a statement about the position, and the law of it is known. What
is believed before is split into Gaussians that are narrow in the position, as narrow as the law is
smooth; each is updated with the variance of its own place, its determinant included, and the
likelihoods weigh them (Sorenson and Alspach, "Recursive Bayesian estimation using Gaussian sums",
Automatica 7, 1971; Alspach and Sorenson, IEEE Trans. Automatic Control 17, 1972). Since a Gaussian
has a width, no grid need be as fine as the measurement is accurate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from echobeam.brief import Brief
from echobeam.estimation import gaussian
from echobeam.estimation.sigma_points import principal_root
from echobeam.tracking.models import MeasurementModel
from echobeam.values import Array, BoolArray, GaussianState, UavState

Law = Callable[[Array], Array]
"""Variance ``(..., G, M)`` of a measurement at states ``(..., G, S)``; infinite without an echo."""

STEP = 1.6
"""Distance of neighbours in their own standard deviations: such a sum of equal Gaussians is level
to 2 exp(-2 pi^2 / STEP^2) = 9e-4 (Poisson's summation formula)."""

REACH = 3.0
"""Standard deviations, of the law of the nodes, to which these reach: all but 0.3 %; three nodes
reach to sqrt(3), as those of Gauss and Hermite do."""

FITS = 2
"""Linearisations of each Gaussian: at its mean, and where the measurement puts it."""

MOST_FITS = 8
"""Linearisations at most, of a Gaussian that each has moved: in a belief much wider than a beam
the law at the second place is not that at the third. Twenty are no better."""

MOVED = 2.0
"""Standard deviations of the updated Gaussian from which it has moved."""

SHARE = 1e-3
"""Weight from which a Gaussian is linearised more often."""


@dataclass(frozen=True, slots=True, repr=False)
class GaussianSum(Brief):
    """Gaussians of one covariance, and their weights.

    Attributes
    ----------
    mean
        ``(..., G, S)``.
    cov
        ``(..., S, S)``.
    log_weight
        ``(..., G)``: up to a constant.
    """

    mean: Array
    cov: Array
    log_weight: Array


@dataclass(frozen=True, slots=True, repr=False)
class SumPosterior(Brief):
    """Posterior of a sum.

    Attributes
    ----------
    mean, cov
        ``(..., S)``, ``(..., S, S)``: moments of the whole.
    variance
        ``(..., M)``: that of mean information, 1 / E[1 / R].
    nis
        ``(...)``: normalised innovation squared at the prior, with that variance; NaN for unknown
        objects.
    """

    mean: Array
    cov: Array
    variance: Array
    nis: Array


def split(state: GaussianState, points: tuple[int, ...]) -> GaussianSum:
    """Return Gaussian beliefs as sums of Gaussians that are narrower in the position.

    The position is divided along the principal axes of its covariance, and the other components
    follow it by regression. The sum has the moments of the belief.

    Parameters
    ----------
    state
        Of states ``(..., K, S)``; NaN for unknown objects. The position is the first components,
        one for each number of points.
    points
        Odd numbers of Gaussians along the axes, that of the longest axis first; G is their
        product.
    """
    mean, cov = state.mean, state.cov
    axes = len(points)
    several = [nodes(count) for count in points]
    gain = _regression(cov, principal_root(cov[..., :axes, :axes]))
    grid = _product([place for place, _, _ in several])
    log_weight = _product([weight for _, weight, _ in several]).sum(axis=-1)
    spread = 1.0 - np.square([narrow for _, _, narrow in several])
    left = cov - np.swapaxes(gain * spread[:, None], -1, -2) @ gain
    parts = mean[..., None, :] + grid @ gain
    return GaussianSum(
        parts,
        0.5 * (left + np.swapaxes(left, -1, -2)),
        np.broadcast_to(log_weight, parts.shape[:-1]),
    )


def level(centre: Array, reach: Array, points: int, stds: tuple[float, ...]) -> GaussianSum:
    """Return a sum that is level over a rectangle, the other components being independent.

    Parameters
    ----------
    centre
        ``(..., A)`` m.
    reach
        ``(..., A, A)`` m: from the centre to the outermost Gaussians of each axis, axes by row.
    points
        Gaussians along each axis.
    stds
        Prior standard deviations of the other components, of mean zero.
    """
    axes = centre.shape[-1]
    grid = _product([np.linspace(-1.0, 1.0, points)] * axes)
    position = centre[..., None, :] + grid @ reach
    rest = np.zeros((*position.shape[:-1], len(stds)))
    narrow = reach * (2.0 / (points - 1) / STEP)
    cov = np.zeros((*centre.shape[:-1], axes + len(stds), axes + len(stds)))
    cov[..., :axes, :axes] = np.swapaxes(narrow, -1, -2) @ narrow
    cov[..., axes:, axes:] = np.diag(np.square(stds))
    state = np.concatenate([position, rest], axis=-1)
    return GaussianSum(state, cov, np.zeros(state.shape[:-1]))


def posterior(
    parts: GaussianSum,
    value: Array,
    law: Law,
    model: MeasurementModel,
    uav: UavState,
    fits: int = FITS,
) -> SumPosterior:
    """Return the posterior of a measurement.

    The weights stay where no Gaussian explains the measurement, and are NaN for unknown objects.

    Parameters
    ----------
    parts
        The belief before.
    value
        ``(..., M)``: the measurement, NaN where a component was not measured.
    law
        The law of its variance; where it is infinite there is no echo, from which no value can
        have come.
    model, uav
        The measurement model, and the UAV in the slot.
    fits
        Linearisations of each Gaussian at least.
    """
    measured = np.isfinite(value)[..., None, :]
    with np.errstate(all="ignore"):  # unknown objects, and places without an echo
        last = fit = _fitted(parts, parts.mean, value, law, model, uav)
        ahead = gaussian.innovation_cov(
            parts.cov[..., None, :, :], fit.H, np.zeros_like(fit.variance)
        )
        before = normalised(parts.log_weight, parts.log_weight)
        innovation, total = mixture(before, fit.e, ahead)
        for _ in range(1, fits):
            last, fit = fit, _fitted(parts, fit.mean, value, law, model, uav)
        weight = _weighed(parts, fit, measured)
        for _ in range(fits, MOST_FITS):
            moving = _moving(last, fit, weight)
            if not moving.any():
                break
            again = _fitted(parts, fit.mean, value, law, model, uav)
            last, fit = fit, again.where(moving, fit)
            weight = _weighed(parts, fit, measured)
        information = (weight[..., None] / fit.variance).sum(axis=-2)
        mixed = np.where(information > 0.0, 1.0 / information, np.inf)
        for component in range(mixed.shape[-1]):
            noise = np.where(measured[..., 0, component], mixed[..., component], np.inf)
            total[..., component, component] += noise
        nis = gaussian.square_norm(innovation, total)
    return SumPosterior(*mixture(weight, fit.mean, fit.left), mixed, nis)


@dataclass(frozen=True, slots=True, repr=False)
class _Fit(Brief):
    """Gaussians of a sum, each updated with the measurement linearised at one place.

    Attributes
    ----------
    mean, left
        ``(..., G, S)``, ``(..., G, S, S)``: updated.
    variance, H, e
        ``(..., G, M)``, ``(..., G, M, S)``, ``(..., G, M)``: law and Jacobian at the place, and the
        innovation as the Gaussian's mean before sees it.
    """

    mean: Array
    left: Array
    variance: Array
    H: Array
    e: Array

    def where(self, chosen: BoolArray, other: _Fit) -> _Fit:
        """Return this fit for some Gaussians ``(..., G)``, the other one for the rest."""
        one, two = chosen[..., None], chosen[..., None, None]
        return _Fit(
            np.where(one, self.mean, other.mean),
            np.where(two, self.left, other.left),
            np.where(one, self.variance, other.variance),
            np.where(two, self.H, other.H),
            np.where(one, self.e, other.e),
        )


def _fitted(
    parts: GaussianSum, at: Array, value: Array, law: Law, model: MeasurementModel, uav: UavState
) -> _Fit:
    """Return the Gaussians of a sum updated with the measurement linearised at ``(..., G, S)``."""
    measured = np.isfinite(value)[..., None, :]
    variance = law(at)
    H = model.jacobian(at, uav)
    e = model.residual(value[..., None, :], model.expected(at, uav))
    if at is not parts.mean:
        e += (H * (at - parts.mean)[..., None, :]).sum(axis=-1)  # seen from the prior
    e = np.where(measured, e, 0.0)
    cov = np.broadcast_to(parts.cov[..., None, :, :], (*at.shape, at.shape[-1]))
    mean, left = gaussian.update(parts.mean, cov, e, H, np.where(measured, variance, np.inf))
    return _Fit(mean, left, variance, H, e)


def _weighed(parts: GaussianSum, fit: _Fit, measured: BoolArray) -> Array:
    """Return the weights of Gaussians after a measurement, ``(..., G)``."""
    noise = np.where(measured, fit.variance, np.inf)
    spread = gaussian.innovation_cov(parts.cov[..., None, :, :], fit.H, noise)
    possible: BoolArray = np.asarray((np.isfinite(fit.variance) | ~measured).all(axis=-1))
    log = parts.log_weight + np.where(possible, gaussian.log_density(fit.e, spread), -np.inf)
    return normalised(log, parts.log_weight)


def _moving(last: _Fit, fit: _Fit, weight: Array) -> BoolArray:
    """Return which Gaussians ``(..., G)`` have been put elsewhere by the last linearisation."""
    square = np.diagonal(fit.left, axis1=-2, axis2=-1)
    moved = (np.square(fit.mean - last.mean) > MOVED**2 * square).any(axis=-1)
    return np.asarray(moved & (weight > SHARE))


@cache
def nodes(points: int) -> tuple[Array, Array, float]:
    """Return nodes, logarithms of their weights and the deviation s around them, for N(0, 1).

    Nodes at multiples of ``STEP s`` have weights of N(0, 1 - s^2), the outermost being at `REACH`
    of that law's deviations, and Gaussians of deviation s around them make N(0, 1). The nodes are
    stretched, by less than 4 %, to the variance 1 - s^2.

    Parameters
    ----------
    points
        Odd number of nodes; a single one is the whole, s = 1.
    """
    if points < 1 or points % 2 == 0:
        raise ValueError(f"points: {points} is not accepted; expected an odd number from 1")
    if points == 1:
        return np.zeros(1), np.zeros(1), 1.0
    half = 0.5 * (points - 1) * STEP
    reach = REACH if points > 3 else np.sqrt(3.0)
    narrow = float(reach / np.hypot(reach, half))
    place = np.linspace(-half, half, points) * narrow
    log_weight = -0.5 * np.square(place) / (1.0 - narrow**2)
    weight = np.exp(log_weight) / np.exp(log_weight).sum()
    place *= np.sqrt((1.0 - narrow**2) / (weight * np.square(place)).sum())
    return place, log_weight, narrow


def _regression(cov: Array, directions: Array) -> Array:
    """Return by how much the state follows a deviation along each principal axis, ``(..., A, S)``.

    Parameters
    ----------
    cov
        ``(..., S, S)``.
    directions
        ``(..., A, A)`` of `principal_root`.
    """
    axes = directions.shape[-1]
    square = np.square(directions).sum(axis=-1, keepdims=True)
    exact = ~(square > 0.0)
    with np.errstate(invalid="ignore"):
        gain = directions / np.where(exact, 1.0, square) @ cov[..., :axes, :]
    return np.where(exact & ~np.isnan(square), 0.0, gain)


def _product(several: list[Array]) -> Array:
    """Return all combinations of some numbers for each axis, ``(G, A)``."""
    return np.stack(np.meshgrid(*several, indexing="ij"), axis=-1).reshape(-1, len(several))


def mixture(weight: Array, mean: Array, cov: Array) -> tuple[Array, Array]:
    """Return mean ``(..., S)`` and covariance ``(..., S, S)`` of a sum of Gaussians.

    Parameters
    ----------
    weight
        ``(..., G)``; NaN gives NaN.
    mean, cov
        ``(..., G, S)`` and ``(..., G, S, S)``; anything where a weight is zero.
    """
    share = np.where(weight > 0.0, weight, 0.0)[..., None]
    some = share > 0.0
    centre = (share * np.where(some, mean, 0.0)).sum(axis=-2)
    off = np.where(some, mean - centre[..., None, :], 0.0)
    total = np.swapaxes(share * off, -1, -2) @ off
    inner = np.where(some[..., None], cov, 0.0)
    total += (share[..., None] * inner).sum(axis=-3)
    nothing = np.isnan(weight).any(axis=-1)
    centre[nothing], total[nothing] = np.nan, np.nan
    return centre, 0.5 * (total + np.swapaxes(total, -1, -2))


def normalised(log: Array, otherwise: Array) -> Array:
    """Return exp(log) over its sum, ``(..., G)``; that of ``otherwise`` where all are zero."""
    unknown = np.isnan(log).any(axis=-1, keepdims=True)
    log = np.where(np.isneginf(log).all(axis=-1, keepdims=True), otherwise, log)
    most = np.max(np.where(np.isnan(log), -np.inf, log), axis=-1, keepdims=True)
    weight = np.exp(log - most)
    return np.where(unknown, np.nan, weight / weight.sum(axis=-1, keepdims=True))
