"""Posterior over positions on a grid, for measurements whose variance depends on the position.

Far from where a beam points an echo is weak, and what is measured there is inaccurate. So the
accuracy of a measurement is itself a statement about the position, and the law of it is known: at
every point of the grid the likelihood is taken with the variance of that point, the determinant
included. Velocity and altitude error are Gaussian given the position (a Rao-Blackwellised point
mass filter: Bucy and Senne, "Digital synthesis of non-linear filters", Automatica 7, 1971; Doucet,
Godsill and Andrieu, "On sequential Monte Carlo sampling methods for Bayesian filtering", Statistics
and Computing 10, 2000, section II.C).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from echobeam.brief import Brief
from echobeam.estimation import gaussian
from echobeam.tracking.gaussian_sum import normalised
from echobeam.tracking.models import MeasurementModel
from echobeam.values import Array, BoolArray, GaussianState, UavState

HEIGHT_SHARES = (2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0)
"""Probabilities of the heights of `at_heights`."""


@dataclass(frozen=True, slots=True, repr=False)
class PositionGrid(Brief):
    """Points of a grid with what was believed of them before the measurement.

    Attributes
    ----------
    state
        ``(..., G, S)``: position, and the mean of the other components given it.
    step
        ``(...)`` m: distance of neighbours along the first axis, the only one that is divided.
    width
        ``(...)`` m: width of the cells that the points stand for; zero where they are the nodes
        of the trapezoidal rule, which is exact to rounding for a density that they resolve.
    log_prior
        ``(..., G)``: logarithm of the prior weights, up to a constant.
    cov
        ``(..., S - A, S - A)``: covariance of the other components given the position.
    """

    state: Array
    step: Array
    width: Array
    log_prior: Array
    cov: Array


def grid_of(state: GaussianState, points: int, reach: float | Array) -> PositionGrid:
    """Return a grid of one axis over a Gaussian belief of position, velocity and altitude error.

    Parameters
    ----------
    state
        Of states ``(..., K, 3)``; NaN for unknown objects.
    points
        G, at least 2.
    reach
        Standard deviations of the position to either side, one number or ``(..., K)``.
    """
    if points < 2 or not np.all(np.asarray(reach) > 0.0):
        raise ValueError(
            f"points, reach: {points}, {reach} are not accepted; expected 2 or more, and > 0"
        )
    mean, cov = state.mean, state.cov
    std = np.sqrt(cov[..., 0, 0])
    ends = np.broadcast_to(np.asarray(reach, dtype=np.float64), std.shape)[..., None]
    place = ends * np.linspace(-1.0, 1.0, points)
    exact = std == 0.0
    with np.errstate(invalid="ignore"):
        gain = cov[..., 1:, 0] / np.where(exact, 1.0, std)[..., None]  # for each deviation
    whole = np.concatenate([std[..., None], gain], axis=-1)
    grid = mean[..., None, :] + place[..., None] * whole[..., None, :]
    left = cov[..., 1:, 1:] - gain[..., :, None] * gain[..., None, :]
    step = std * (place[..., 1] - place[..., 0])
    return PositionGrid(grid, step, np.zeros_like(step), -0.5 * place**2, left)


def flat_grid(low: Array, high: Array, points: int, stds: tuple[float, ...]) -> PositionGrid:
    """Return a grid of one axis on which every position is as likely, the rest being independent.

    Parameters
    ----------
    low, high
        ``(...)`` m: ends of the outer cells.
    points
        G, at least 2.
    stds
        Prior standard deviations of the other components, of mean zero.
    """
    step = (high - low) / points
    x = low[..., None] + step[..., None] * (np.arange(points) + 0.5)
    state = np.stack([x, *(np.zeros_like(x) for _ in stds)], axis=-1)
    cov = np.broadcast_to(np.diag(np.square(stds)), (*low.shape, len(stds), len(stds)))
    return PositionGrid(state, step, step, np.zeros_like(x), cov)


def at_heights(grid: PositionGrid) -> list[PositionGrid]:
    """Return a grid at three heights: the direction, and so the law, of a place depends on it.

    The nodes are those of Gauss and Hermite for the altitude error given the position, with the
    shares `HEIGHT_SHARES`. Near the null of a beam half a metre changes the variance by orders of
    magnitude.
    """
    std = np.sqrt(grid.cov[..., -1, -1])[..., None]
    made = []
    for node in (0.0, np.sqrt(3.0), -np.sqrt(3.0)):
        state = grid.state.copy()
        state[..., -1] += node * std
        made.append(replace(grid, state=state))
    return made


def mixed(grid: PositionGrid, shares: Sequence[float]) -> PositionGrid:
    """Return a grid with every point once for each of several laws of known probability.

    Parameters
    ----------
    grid
        Points ``(..., G)``; the ones returned are ``(..., L G)``, all those of a law together.
    shares
        L, positive.
    """
    log_prior = np.concatenate([grid.log_prior + np.log(share) for share in shares], axis=-1)
    state = np.concatenate([grid.state] * len(shares), axis=-2)
    return replace(grid, state=state, log_prior=log_prior)


def weights(
    grid: PositionGrid, value: Array, variance: Array, model: MeasurementModel, uav: UavState
) -> Array:
    """Return the posterior probabilities of the points, ``(..., G)``; they sum to 1.

    The likelihood of a cell is that of a position anywhere in it.
    The prior's are returned where no point explains the measurement, and NaN for unknown objects.

    Parameters
    ----------
    grid
        The points.
    value
        ``(..., M)``: the measurement, NaN where a component was not measured.
    variance
        ``(..., G, M)``: law of its variance at every point; infinite where there is no echo, from
        which no value can have come.
    model, uav
        The measurement model, and the UAV in the slot.
    """
    terms = _terms(grid, value, variance, model, uav)
    return _weights(grid, terms)


def posterior(
    grid: PositionGrid, value: Array, variance: Array, model: MeasurementModel, uav: UavState
) -> tuple[Array, Array, Array]:
    """Return the posterior on the grid: weights, and its moments with all components.

    Parameters
    ----------
    grid, value, variance, model, uav
        As for `weights`.

    Returns
    -------
    weight, mean, cov
        ``(..., G)`` as of `weights`, ``(..., S)`` and ``(..., S, S)``.
    """
    terms = _terms(grid, value, variance, model, uav)
    weight = _weights(grid, terms)
    e, H, noise, _ = terms
    rest = np.broadcast_to(grid.cov[..., None, :, :], (*e.shape[:-1], *grid.cov.shape[-2:]))
    axes = grid.state.shape[-1] - rest.shape[-1]
    with np.errstate(all="ignore"):
        moved, left = gaussian.update(grid.state[..., axes:], rest, e, H, noise)
    state = np.concatenate([grid.state[..., :axes], moved], axis=-1)
    share = np.where(weight > 0.0, weight, 0.0)[..., None]
    mean = (share * np.where(share > 0.0, state, 0.0)).sum(axis=-2)
    off = np.where(share > 0.0, state - mean[..., None, :], 0.0)
    cov = np.swapaxes(share * off, -1, -2) @ off
    inner = np.where(share[..., None] > 0.0, left, 0.0)
    cov[..., axes:, axes:] += (share[..., None] * inner).sum(axis=-3)
    cov[..., 0, 0] += grid.width**2 / 12.0
    nothing = np.isnan(weight).any(axis=-1)
    mean[nothing], cov[nothing] = np.nan, np.nan
    return weight, mean, 0.5 * (cov + np.swapaxes(cov, -1, -2))


def resolved(grid: PositionGrid, cov: Array) -> BoolArray:
    """Return whether a grid is fine enough for a posterior, ``(...)``.

    The error of the trapezoidal rule for a Gaussian is 2 exp(-2 pi^2 sigma^2 / step^2) (Trefethen
    and Weideman, SIAM Review 56, 2014, section 5): 1e-4 at the limit, sigma = step / sqrt(2).

    Parameters
    ----------
    grid
        The grid.
    cov
        ``(..., S, S)`` of `posterior`.
    """
    return np.asarray(2.0 * cov[..., 0, 0] >= grid.step**2)


def effective_variance(weight: Array, variance: Array) -> Array:
    """Return the variance of mean information, 1 / E[1 / R], ``(..., M)``.

    Parameters
    ----------
    weight
        ``(..., G)`` of `weights`.
    variance
        ``(..., G, M)``: R at every point; infinite where there is no echo.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        information = (weight[..., None] / variance).sum(axis=-2)
        return np.where(information > 0.0, 1.0 / information, np.inf)


def roughness(weight: Array, variance: Array) -> Array:
    """Return the mean change of log R between neighbours on a grid, ``(...)``.

    Parameters
    ----------
    weight
        ``(..., G)`` of `weights`.
    variance
        ``(..., G, M)``: R at every point; the largest change of its components counts. It is 1 on
        either side of a point without an echo, where R is infinite.
    """
    with np.errstate(all="ignore"):
        change = np.abs(np.diff(np.log(variance), axis=-2)).max(axis=-1)
    shared = 0.5 * (weight[..., 1:] + weight[..., :-1])
    return np.asarray((shared * np.where(np.isfinite(change), change, 1.0)).sum(axis=-1))


Terms = tuple[Array, Array, Array, BoolArray]
"""Innovation, Jacobian of the components besides the position, variance, possible places."""


def _weights(grid: PositionGrid, terms: Terms) -> Array:
    e, H, noise, possible = terms
    cov = gaussian.innovation_cov(grid.cov[..., None, :, :], H, noise)
    with np.errstate(all="ignore"):
        log = grid.log_prior + np.where(possible, gaussian.log_density(e, cov), -np.inf)
    return normalised(log, grid.log_prior)


def _terms(
    grid: PositionGrid, value: Array, variance: Array, model: MeasurementModel, uav: UavState
) -> Terms:
    """Return what weights and moments are made of."""
    value = value[..., None, :]
    measured = np.isfinite(value)
    with np.errstate(all="ignore"):
        e = model.residual(value, model.expected(grid.state, uav))
        H = model.jacobian(grid.state, uav)
        noise = variance + np.square(H[..., 0] * grid.width[..., None, None]) / 12.0
    axes = H.shape[-1] - grid.cov.shape[-1]
    possible: BoolArray = np.asarray((np.isfinite(variance) | ~measured).all(axis=-1))
    return (
        np.where(measured, e, 0.0),
        H[..., axes:],
        np.where(measured, noise, np.inf),
        possible,
    )
