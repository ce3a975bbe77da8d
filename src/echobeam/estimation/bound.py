"""The posterior Cramer-Rao bound of a tracking problem, by the Tichavsky recursion.

It binds estimators that take the variances of the measurements as given constants, R. Where R
depends on the state, as with needle beams, the variances themselves carry information (the term
tr[(R^-1 dR)^2] / 2 of a Gaussian measurement) that is not counted here: a filter that uses the law
of R can have smaller errors than this bound.

Tichavsky, Muravchik and Nehorai, "Posterior Cramer-Rao bounds for discrete-time nonlinear
filtering", IEEE Trans. Signal Process. 46 (1998): for Gaussian noises the information of a state
obeys J' = D22 - D21 (J + D11)^-1 D12 with D11 = E[G^T Q^-1 G], D12 = -E[G^T] Q^-1 and
D22 = Q^-1 + E[H^T R^-1 H], the Jacobians taken on the true trajectory. For linear models 1 / J is
the Kalman filter's covariance.
"""

from __future__ import annotations

import numpy as np

from echobeam.values import Array


def posterior_bound(
    G: Array, Q: Array, H: Array, variance: Array, information: Array | None = None
) -> Array:
    """Return the lower bound on the covariance of any estimate that takes R as given, per slot.

    Expectations are means over the trials' own truths. A truth without process noise is the same
    in all trials; then the bound is that of a filter which believes in Q along this truth.

    Parameters
    ----------
    G
        ``(T, n - 1, K, S, S)``: Jacobian of the evolution from each slot to the next, on the
        truth; T trials, n slots. Its mean over the trials must be invertible, as motion is. NaN
        where the object is absent before or after: nothing is known of it then.
    Q
        ``(S, S)``, or ``(n - 1, K, S, S)`` for each step and object: covariance of the process
        noise; may be singular, or zero.
    H
        ``(T, n, K, M, S)``: Jacobian of the measurement on the truth; NaN where it is absent.
    variance
        ``(T, n, K, M)``, positive: diagonal of R, which counts as a constant even where it
        depends on the state; infinite where nothing is measured.
    information
        ``(K, S, S)``: what is known before the first measurement; nothing by default.

    Returns
    -------
    Array
        ``(n, K, S, S)``. Infinite variances, and NaN covariances, as long as the measurements
        do not determine the state.
    """
    trials = H.shape[0]
    F = np.mean(G, axis=0)
    return information_bound(
        measured_information(H, variance) / trials,
        F,
        motion_square(np.where(np.isfinite(F), G - F, 0.0), Q) / trials,
        Q,
        information,
    )


def information_bound(
    measured: Array, F: Array, scatter: Array, Q: Array, information: Array | None = None
) -> Array:
    """Return the bound of `posterior_bound` from expectations that were taken before.

    Parameters
    ----------
    measured
        ``(n, K, S, S)``: E[H^T R^-1 H].
    F, scatter
        ``(n - 1, K, S, S)``: E[G] and E[(G - F)^T Q^-1 (G - F)]; see `motion_square`.
    Q, information
        As in `posterior_bound`.
    """
    J = measured[0] if information is None else information + measured[0]
    bounds = [_inverse(J)]
    for slot in range(1, len(measured)):
        noise = Q[slot - 1] if Q.ndim > 2 else Q
        J = _predicted_information(J, F[slot - 1], scatter[slot - 1], noise) + measured[slot]
        bounds.append(_inverse(J))
    return np.stack(bounds)


def measured_information(H: Array, variance: Array) -> Array:
    """Return the sum of H^T R^-1 H over the trials, ``(n, K, S, S)``; H may be one for all."""
    used = np.isfinite(variance) & np.isfinite(H).all(axis=-1)
    rows = np.where(used[..., None], H, 0.0) / np.sqrt(np.where(used, variance, 1.0))[..., None]
    information: Array = np.einsum("t...mi,t...mj->...ij", rows, rows)
    return information


def motion_square(G: Array, Q: Array) -> Array:
    """Return the sum of G^T Q^-1 G over the trials, ``(n - 1, K, S, S)``.

    Directions without process noise are left out: Q^-1 is the pseudoinverse.
    """
    weight = np.linalg.pinv(Q, hermitian=True)
    square: Array = np.sum(np.swapaxes(G, -1, -2) @ weight @ G, axis=0)
    return square


def _predicted_information(J: Array, F: Array, scatter: Array, Q: Array) -> Array:
    """Return Q^-1 - D21 (J + D11)^-1 D12, in a form that inverts neither Q nor J.

    With E[G] = F and J~ = J + E[(G - F)^T Q^-1 (G - F)] this is (Q + F J~^-1 F^T)^-1, that is
    M (1 + Q M)^-1 with M = F^-T J~ F^-1. Where Q is singular, what the scatter of G would tell
    through directions without process noise is left out; trials that share one truth have none.
    """
    one = np.eye(Q.shape[-1])
    absent = ~np.isfinite(F).all(axis=(-2, -1), keepdims=True)
    back = np.linalg.inv(np.where(absent, one, F))
    known = np.where(absent, 0.0, J + scatter)
    M = np.swapaxes(back, -1, -2) @ known @ back
    predicted = M @ np.linalg.inv(one + Q @ M)
    symmetric: Array = 0.5 * (predicted + np.swapaxes(predicted, -1, -2))
    return symmetric


def _inverse(J: Array) -> Array:
    """Return J^-1 over the batch, infinite where J is singular to working precision."""
    one = np.eye(J.shape[-1])
    scale = np.sqrt(np.maximum(np.diagonal(J, axis1=-2, axis2=-1), 0.0))  # rounding below zero
    scale = np.where(scale > 0.0, scale, 1.0)
    # The components' units differ by many orders; only the scaled matrix tells what is singular.
    unit = scale[..., :, None] * scale[..., None, :]
    smallest = np.linalg.eigvalsh(J / unit)[..., 0]
    singular = (smallest < one.size * np.finfo(np.float64).eps)[..., None, None]
    inverse = np.linalg.inv(np.where(singular, one, J / unit)) / unit
    return np.where(singular, np.where(one > 0.0, np.inf, np.nan), inverse)
