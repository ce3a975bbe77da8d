"""Upper bounds on the sum rate (38a) that hold for every feasible design, proved by evaluation.

Each bound is a dual function, and every value of a dual function is a bound: multipliers may come
from anywhere, an inexact solver included, and cost tightness only, never truth. Nothing here
imports a solver. What rounding can do is added on top.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.power import water_filling
from echobeam.values import Array

ROUNDING = 1e-12
"""Relative allowance for rounding, far above what evaluating these formulas can lose."""


DIGITS = 2e-15
"""What one operation of a triangular factorisation can lose, with room to spare."""


def gain_bound(centre: Array, cover: Array, ripple: float, above: Array, below: Array) -> float:
    """Return a bound on |a^H(theta_k) w|^2 / |w|^2 over all beams that keep the coverage (38f).

    For multipliers y >= 0 of the two halves of (38f) every feasible W obeys, with c the real
    steering vectors, c_0^T W c_0 <= lambda_max(M) tr W, where
    M = c_0 c_0^T - sum_j (above_j - below_j) (c_0 c_0^T - c_j c_j^T) + B sum_j (above + below)_j I.

    Parameters
    ----------
    centre
        ``(N,)``: real steering vector of the object, `subspace.real_steering`.
    cover
        ``(J, N)``: those of points of its cover.
    ripple
        B_k.
    above, below
        ``(J,)``: multipliers of c_0 W c_0 - c_j W c_j <= B tr W, and of the opposite sign.
        Negative ones count as zero; if one is not finite, nothing is proved but N.
    """
    if not (np.isfinite(above).all() and np.isfinite(below).all()):
        return float(centre.size)
    above, below = np.maximum(above, 0.0), np.maximum(below, 0.0)
    difference = above - below
    vectors = np.concatenate([centre[np.newaxis], cover])
    weights = np.concatenate([[1.0 - np.sum(difference)], difference])
    matrix = (vectors.T * weights) @ vectors
    shift = ripple * float(np.sum(above + below))
    rounding = ROUNDING * (float(np.abs(weights).sum()) * centre.size + shift)
    largest = float(np.linalg.eigvalsh(matrix)[-1]) + shift + rounding
    # Without coverage the whole array is the limit, and a flat pattern is always feasible.
    return float(np.clip(largest, 1.0, centre.size))


def interference_free_bound(gains: Array, loss: Array, threshold: Array) -> float:
    """Return the largest sum rate if beams did not disturb each other, bit/s/Hz.

    Parameters
    ----------
    gains
        ``(K,)``: bounds on the gains, `gain_bound`.
    loss
        ``(K,)``: noise d^2 / (P_T alpha0^2).
    threshold
        ``(K,)``: 2^Gamma_k - 1; floors that even so cannot be met are left out of the account.
    """
    if gains.size == 0:
        return 0.0
    least = threshold * loss / gains
    if np.sum(least) > 1.0:
        least = np.zeros_like(least)
    powers, level = water_filling(gains, loss, least)
    best = np.sum(np.log1p(gains * powers / loss) - powers / level) + 1.0 / level
    return float(best / np.log(2.0)) * (1.0 + ROUNDING)


def dirty_paper_bound(channels: Array, loss: Array, steps: int = 60) -> float:
    """Return the sum capacity of the broadcast channel without coverage and floors, bit/s/Hz.

    By uplink-downlink duality it is max over powers q of unit sum of
    log det(I + sum_k q_k c_k c_k^T / loss_k), concave in q, and its tangent at any q bounds it.

    Parameters
    ----------
    channels
        ``(K, N)``: real steering vectors of the objects.
    loss
        ``(K,)``: noise d^2 / (P_T alpha0^2).
    steps
        Multiplicative steps towards the best q.
    """
    scaled = channels / np.sqrt(loss)[:, np.newaxis]
    _, vectors = np.linalg.qr(scaled.T)
    size = len(vectors)
    powers = np.full(loss.size, 1.0 / loss.size)
    # A triangular factor and not the matrix itself: its condition is the root of the matrix's.
    strongest = float(np.max(np.sum(scaled**2, axis=1)))
    digits = ROUNDING + DIGITS * (size + loss.size) * float(np.sqrt(1.0 + strongest))
    best = np.inf
    for _ in range(steps):
        _, upper = np.linalg.qr(np.concatenate([np.eye(size), (vectors * np.sqrt(powers)).T]))
        slope = np.sum(np.linalg.solve(upper.T, vectors) ** 2, axis=0)
        logdet = 2.0 * float(np.sum(np.log(np.abs(np.diagonal(upper)))))
        mean = float(powers @ slope)
        rounding = digits * (float(np.max(slope)) + mean + size)
        best = min(best, logdet + float(np.max(slope)) - mean + rounding)
        powers = powers * slope / mean
    return float(best / np.log(2.0)) * (1.0 + ROUNDING)
