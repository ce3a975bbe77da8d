"""Sigma-point update with iterated posterior linearisation.

The measurement is replaced by the line that fits it best, in the mean square, over the posterior:
h(e) ~ A e + c with an error of covariance Omega (statistical linear regression). Since the
posterior is what is sought, the line is fitted over the prior first and over the last posterior
then; every iteration updates the prior anew (Garcia-Fernandez, Svensson, Morelande and Sarkka,
"Posterior linearization filter: principles and implementation using sigma points", IEEE Trans.
Signal Processing 63, 2015, algorithm 1). Omega makes the update honest where the measurement
bends over the uncertainty, where a linearisation at one point is overconfident.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.brief import Brief
from echobeam.estimation import gaussian
from echobeam.estimation.sigma_points import cubature_points, moments, root
from echobeam.tracking.life import living
from echobeam.tracking.models import MeasurementModel
from echobeam.values import Array, BoolArray, GaussianState, StateSpace, UavState

ITERATIONS = 3
"""Fits: over the prior, and twice over a posterior; a fourth moves nothing that can be measured."""


@dataclass(frozen=True, slots=True, repr=False)
class Linearised(Brief):
    """Best line h(e) ~ h + A (e - m) over a Gaussian N(m, P).

    Attributes
    ----------
    at
        ``(..., S)``: m.
    expected
        ``(..., M)``: h, the mean of the measurement.
    slope
        ``(..., M, S)``: A.
    omega
        ``(..., M, M)``: covariance of what the line leaves.
    cov
        ``(..., M, M)``: covariance of the measurement without noise, A P A^T + Omega.
    """

    at: Array
    expected: Array
    slope: Array
    omega: Array
    cov: Array


@dataclass(frozen=True, slots=True, repr=False)
class Updated(Brief):
    """Posterior of a slot.

    Attributes
    ----------
    state
        The posterior.
    nis
        ``(..., K)``: normalised innovation squared at the prior; 0 where nothing was measured.
    degrees
        ``(..., K)``: components that were measured.
    scores
        ``(..., K, M)``: innovations over their standard deviations; 0 where nothing was measured.
    log_likelihood
        ``(..., K)``: logarithm of the density of the innovation at the prior; 0 where nothing was
        measured.
    """

    state: GaussianState
    nis: Array
    degrees: Array
    scores: Array
    log_likelihood: Array


def linearised(mean: Array, cov: Array, model: MeasurementModel, uav: UavState) -> Linearised:
    """Return the best line of a measurement over a Gaussian, by sigma points.

    Parameters
    ----------
    mean, cov
        ``(..., S)``, ``(..., S, S)``; the covariance may be singular.
    model
        The measurement model.
    uav
        The UAV in the slot.
    """
    L = root(cov)
    size = mean.shape[-1]
    centre = model.expected(mean, uav)
    points = model.expected(cubature_points(mean, L), uav)
    shift, spread = moments(model.residual(points, centre[..., None, :]))
    # In whitened axes the slope is a difference of opposite points; A L = D.
    D = model.residual(points[..., :size, :], points[..., size:, :]) / (2.0 * np.sqrt(size))
    D = np.swapaxes(D, -1, -2)
    omega = spread - (D[..., :, None, :] * D[..., None, :, :]).sum(axis=-1)
    return Linearised(mean, centre + shift, _solved(D, L), omega, spread)


def update(
    prior: GaussianState,
    value: Array,
    variance: Array,
    model: MeasurementModel,
    uav: UavState,
    space: StateSpace,
    iterations: int = ITERATIONS,
) -> Updated:
    """Return the posterior of a slot.

    Parameters
    ----------
    prior
        Prediction of the slot; an unknown object stays unknown.
    value, variance
        ``(..., K, M)``: the measurement, NaN, and its variance, infinite where a component was
        not measured. An object of which nothing was measured keeps its prior in every bit.
    model
        The measurement model.
    uav
        The UAV in the slot.
    space
        State space of the prior, which says what is possible.
    iterations
        Fits of the line, at least 1 (the cubature Kalman filter).
    """
    if iterations < 1:
        raise ValueError(f"iterations: {iterations} is not accepted; expected 1 or more")
    measured: BoolArray = np.isfinite(value) & np.isfinite(variance)
    degrees = np.where(prior.known, measured.sum(axis=-1), 0)
    mean, cov = prior.mean, prior.cov
    nis = likelihood = np.zeros(degrees.shape)
    scores = np.zeros(value.shape)
    with np.errstate(all="ignore"):  # unknown objects, and lines that have left the ground
        for iteration in range(iterations):
            line = linearised(mean, cov, model, uav)
            innovation = np.where(measured, model.residual(value, line.expected), 0.0)
            if iteration == 0:
                total = _with_noise(line.cov, variance, measured)
                nis = np.where(degrees > 0, gaussian.square_norm(innovation, total), 0.0)
                deviations = np.sqrt(np.diagonal(total, axis1=-2, axis2=-1))
                scores = np.where((degrees > 0)[..., None], innovation / deviations, 0.0)
                density = gaussian.log_density(innovation, total)
                likelihood = np.where(degrees > 0, density, 0.0)
            # what the line expects of the prior's mean
            back = (line.slope * (prior.mean - line.at)[..., None, :]).sum(axis=-1)
            noise = _with_noise(line.omega, variance, measured)
            apart = _apart(innovation - np.where(measured, back, 0.0), line.slope, noise)
            mean, cov = gaussian.update(prior.mean, prior.cov, *apart)
    used = degrees > 0
    mean = np.where(used[..., None], mean, prior.mean)
    cov = np.where(used[..., None, None], cov, prior.cov)
    return Updated(living(mean, cov, prior.known, space), nis, degrees, scores, likelihood)


def _with_noise(cov: Array, variance: Array, measured: BoolArray) -> Array:
    """Return C + R; a component that was not measured is apart, with infinite variance."""
    both = measured[..., :, None] & measured[..., None, :]
    total = np.where(both, cov, 0.0)
    for m in range(variance.shape[-1]):
        total[..., m, m] += np.where(measured[..., m], variance[..., m], np.inf)
    return total


def _apart(innovation: Array, slope: Array, noise: Array) -> tuple[Array, Array, Array]:
    """Return a measurement with correlated noise as one with independent components.

    With N = L D L^T it is L^-1 (y - A e), of variances D: each component less what those before
    it tell of its noise. Units stay, so seconds and hertz do not meet.
    """
    size = noise.shape[-1]
    N = [[noise[..., i, j] for j in range(size)] for i in range(size)]
    y = [innovation[..., i] for i in range(size)]
    A = [slope[..., i, :] for i in range(size)]
    for j in range(size):
        for i in range(j + 1, size):
            factor = N[i][j] / N[j][j]
            y[i] = y[i] - factor * y[j]
            A[i] = A[i] - factor[..., None] * A[j]
            for k in range(j + 1, size):
                N[i][k] = N[i][k] - factor * N[j][k]
    variance = np.stack([N[i][i] for i in range(size)], axis=-1)
    return np.stack(y, axis=-1), np.stack(A, axis=-2), variance


def _solved(D: Array, L: Array) -> Array:
    """Return A of A L = D; zero for components without uncertainty, of which nothing is learnt."""
    size = L.shape[-1]
    columns: list[Array] = [np.zeros(())] * size
    for j in reversed(range(size)):
        pivot = L[..., j, j]
        rest = D[..., :, j]
        for k in range(j + 1, size):
            rest = rest - columns[k] * L[..., k, j][..., None]
        free = pivot != 0.0
        columns[j] = np.where(free[..., None], rest / np.where(free, pivot, 1.0)[..., None], 0.0)
    return np.stack(columns, axis=-1)
