"""Bound on all designs whose interference lies in a box: a dual function, evaluated.

With p_ki = c_k^T W_i c_k, object k receives the interference I_k = sum_{i != k} p_ki. The sum rate
is sum_k log(loss_k + R_k) - log(loss_k + I_k) with R_k = I_k + p_kk. The first logarithm is concave
and lies below its tangents; the second, over low_k <= I_k <= high_k, makes a convex function that
lies below its chord. What is then left is linear in {W_k}, and the constraints join with
multipliers >= 0: every choice of tangent points and multipliers gives a bound. As in `bounds`,
nothing here imports a solver, and what rounding can do is added on top.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.certify.bounds import ROUNDING
from echobeam.values import Array


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """Limits of the interference at each object, ``(K,)`` each, in units of P_T."""

    low: Array
    high: Array

    def chord(self, loss: Array) -> Array:
        """Return minus the slope of the chord of -log(loss + I) over the box, ``(K,)``."""
        width = self.high - self.low
        some = np.where(width > 0.0, width, 1.0)
        slope = np.log1p(some / (loss + self.low)) / some
        return np.where(width > 0.0, slope, 1.0 / (loss + self.low))

    def lift(self, loss: Array, interference: Array) -> Array:
        """Return by how much the chord exceeds -log(loss + I) at I, ``(K,)``, nats."""
        inside = np.clip(interference, self.low, self.high)
        rise = np.log1p((inside - self.low) / (loss + self.low))
        return np.asarray(rise - self.chord(loss) * (inside - self.low))


@dataclass(frozen=True, slots=True, eq=False)
class Multipliers:
    """Where the bound is evaluated; negative multipliers count as zero.

    Attributes
    ----------
    received
        ``(K,)``: R_k at which the tangents touch.
    floors
        ``(K,)``: of the floors (38e), threshold_k (loss_k + I_k) <= p_kk.
    at_most, at_least
        ``(K,)``: of I_k <= high_k and of I_k >= low_k.
    above, below
        Per beam ``(J_k,)``: of the two halves of (38f) at points of its cover, as in
        `bounds.gain_bound`.
    """

    received: Array
    floors: Array
    at_most: Array
    at_least: Array
    above: list[Array]
    below: list[Array]

    @property
    def finite(self) -> bool:
        """Return whether all are numbers."""
        parts = [self.received, self.floors, self.at_most, self.at_least, *self.above, *self.below]
        return all(bool(np.isfinite(part).all()) for part in parts)


def box_bound(
    channels: Array,
    covers: list[Array],
    ripple: Array,
    loss: Array,
    threshold: Array,
    box: Box,
    at: Multipliers,
    rates: bool = True,
) -> float:
    """Return a bound on the sum rate (38a) of every design with interference in the box.

    Parameters
    ----------
    channels
        ``(K, N)``: real steering vectors of the objects, `subspace.real_steering`.
    covers
        Per beam ``(J_k, N)``: those of points of its cover.
    ripple
        ``(K,)``: B_k.
    loss, threshold
        ``(K,)``, as in `model.Model`.
    box, at
        Where the interference lies, and the point at which the dual function is taken.
    rates
        If not, the rates are left out: a negative result proves that there is no such design.

    Returns
    -------
    float
        bit/s/Hz; infinite if a multiplier is not finite.
    """
    if not at.finite:
        return np.inf
    n_objects, n_tx = channels.shape
    received = np.maximum(at.received, 0.0)
    floors, at_most, at_least = (np.maximum(y, 0.0) for y in (at.floors, at.at_most, at.at_least))
    tangent, chord = float(rates) / (loss + received), float(rates) * box.chord(loss)
    own = tangent + floors
    foreign = tangent - chord - floors * threshold - at_most + at_least
    constants = np.concatenate(
        [
            float(rates) * np.log1p((received - box.low) / (loss + box.low)),
            -tangent * received,
            chord * box.low,
            -floors * threshold * loss,
            at_most * box.high,
            -at_least * box.low,
        ]
    )
    size = tangent + chord + floors * (1.0 + threshold) + at_most + at_least
    largest = 0.0
    for k in range(n_objects):
        weights = np.where(np.arange(n_objects) == k, own, foreign)
        above, below = np.maximum(at.above[k], 0.0), np.maximum(at.below[k], 0.0)
        difference, shift = above - below, float(ripple[k] * np.sum(above + below))
        weights[k] -= np.sum(difference)
        vectors = np.concatenate([channels, covers[k]])
        matrix = (vectors.T * np.concatenate([weights, difference])) @ vectors
        total = float(np.sum(size) + 2.0 * np.sum(above + below)) * n_tx + shift
        value = float(np.linalg.eigvalsh(matrix)[-1]) + shift + ROUNDING * total
        largest = max(largest, value)
    rounding = ROUNDING * (float(np.sum(np.abs(constants))) + largest)
    return (float(np.sum(constants)) + largest + rounding) / float(np.log(2.0))
