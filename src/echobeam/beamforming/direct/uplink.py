"""The powers of beams of given shapes, found in the dual uplink.

For given shapes the SINRs that K beams reach with power P_T are those that K users would reach if
the beams listened instead, user i sending with lambda_i and sum_i loss_i lambda_i = P_T
(uplink-downlink duality: the two power equations are each other's transpose). In the uplink the
shapes separate: beam k wants the least P_k + sum_i lambda_i leak_ki, whatever the others do. So
shapes and lambda are improved in turn, each step raising the same sum rate; little is coupled,
and a few turns suffice.

lambda lives on a simplex once the floors (38e) are taken off:
lambda = (I - Gamma leak)^-1 (Gamma P + surplus), surplus >= 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.values import Array, BoolArray, IntArray

LAST_GAP = 1e-11
"""Complementarity, relative to the sum rate, at which the powers are taken as optimal."""

FIRST_GAP = 1e-2
FALL = 0.1
TO_BOUNDARY = 0.99
BISECTIONS = 50

SILENT = 1e-8
"""Part of the power below which an object counts as not served."""


@dataclass(slots=True)
class Uplink:
    """The dual uplink of T trials with K objects each; every array begins with the batch.

    Attributes
    ----------
    loss
        ``(T, K)``: noise referred to the array, relative to N P_T.
    threshold
        ``(T, K)``: 2^Gamma_k - 1.
    scale
        ``(T,)``: a sum rate (nats) to measure others by.
    share, price
        ``(T, K)``: surplus as parts of the whole, and their multipliers.
    level
        ``(T, K)``: lambda.
    factor
        ``(T,)``: common factor of the floors' rates that can be met; 1 if all can.
    residual
        ``(T,)``: KKT residual of the share, relative.
    leeway
        ``(T, K)``: by what part the cost of an object's beam could fall before the object would be
        worth serving; 0 for those that are served.
    """

    loss: Array
    threshold: Array
    scale: Array
    share: Array
    price: Array
    level: Array
    factor: Array
    residual: Array
    leeway: Array

    def taken(self, index: IntArray) -> Uplink:
        """Return some of the trials, copied."""
        return Uplink(*(getattr(self, name)[index] for name in self.__slots__))

    def put(self, index: IntArray, part: Uplink) -> None:
        """Write back trials that were taken."""
        for name in self.__slots__:
            getattr(self, name)[index] = getattr(part, name)


def start_uplink(loss: Array, threshold: Array, share: Array | None = None) -> Uplink:
    """Return the start: every object gets its share of the surplus, the same one by default.

    Parameters
    ----------
    loss, threshold
        ``(T, K)``, see `Uplink`.
    share
        ``(T, K)``, positive, of unit sum.
    """
    n_trials, n_objects = loss.shape
    if share is None:
        share = np.full(loss.shape, 1.0 / n_objects)
    return Uplink(
        loss=loss,
        threshold=threshold,
        scale=np.log1p(1.0 / np.min(loss, axis=1)),
        share=share.copy(),
        price=np.full(loss.shape, FIRST_GAP),
        level=share / loss,
        factor=np.ones(n_trials),
        residual=np.full(n_trials, np.inf if n_objects > 1 else 0.0),
        leeway=np.zeros(loss.shape),
    )


def step(uplink: Uplink, power: Array, leak: Array, hold: bool = False) -> None:
    """Improve lambda for shapes as they are, in place.

    Parameters
    ----------
    uplink
        T trials.
    power
        ``(T, K)``: P_k of shapes with unit response at their own object.
    leak
        ``(T, K, K)``: [k, i] what object i hears of beam k, zero on the diagonal.
    hold
        Leave the shares of the surplus as they are.
    """
    base, spread, met = _floors(uplink.threshold, power, leak, uplink.loss)
    uplink.factor = np.where(met, 1.0, uplink.factor)
    if not met.all():
        _share_shortage(uplink, np.flatnonzero(~met), power, leak)
        base[~met], spread[~met] = 0.0, np.eye(base.shape[1])
    budget = 1.0 - np.sum(uplink.loss * base, axis=1)
    jacobian = spread * (budget[:, np.newaxis] / _cost(spread, uplink.loss))[:, np.newaxis]
    if uplink.share.shape[1] > 1 and not hold:
        _newton(uplink, base, jacobian, power, leak)
    level = base + _times(jacobian, uplink.share)
    uplink.level = np.where(met[:, np.newaxis], level, uplink.level)
    uplink.residual = np.where(met, uplink.residual, 0.0)
    silent = met[:, np.newaxis] & (uplink.loss * uplink.level < SILENT)
    uplink.leeway = np.where(silent, uplink.leeway, 0.0)


def downlink(uplink: Uplink, power: Array, leak: Array) -> tuple[Array, Array]:
    """Return the SINRs and the powers that reach them, |a^H w_k|^2 / (N P_T), ``(T, K)`` each."""
    sinr = uplink.level / (power + _times(leak, uplink.level))
    coupling = sinr[:, :, np.newaxis] * np.swapaxes(leak, 1, 2)
    system = np.eye(sinr.shape[1]) - coupling
    received = np.linalg.solve(system, (sinr * uplink.loss)[:, :, np.newaxis])[:, :, 0]
    spent = np.sum(received * power, axis=1, keepdims=True)
    return sinr, received / spent


def _floors(
    threshold: Array, power: Array, leak: Array, loss: Array
) -> tuple[Array, Array, BoolArray]:
    """Return the least lambda, how it grows with the surplus, and whether it can be paid."""
    spread, bounded = _inverse(np.eye(power.shape[1]) - threshold[:, :, np.newaxis] * leak)
    base = _times(spread, threshold * power)
    met: BoolArray = bounded & (np.sum(loss * base, axis=1) < 1.0)
    return base, spread, met


def _inverse(matrix: Array) -> tuple[Array, BoolArray]:
    """Return inverses of ``(T, K, K)`` matrices 1 - A, A >= 0, and which have A's radius below 1.

    They have if all pivots of elimination are positive (M-matrices), which then needs no pivoting.
    """
    size = matrix.shape[1]
    work = np.concatenate([matrix, np.broadcast_to(np.eye(size), matrix.shape)], axis=2)
    positive = np.ones(matrix.shape[0], dtype=bool)
    for row in range(size):
        pivot = work[:, row, row]
        positive &= pivot > 0.0
        line = work[:, row] / np.where(pivot > 0.0, pivot, 1.0)[:, np.newaxis]
        work -= work[:, :, row, np.newaxis] * line[:, np.newaxis]
        work[:, row] = line
    return work[:, :, size:], positive


def _share_shortage(uplink: Uplink, short: IntArray, power: Array, leak: Array) -> None:
    """Where the floors cannot be paid, meet the largest common part of their rates, Eq. (38e)."""
    rate = np.log1p(uplink.threshold[short])
    low, high = np.zeros(short.size), np.ones(short.size)
    level = uplink.level[short]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        threshold = np.expm1(middle[:, np.newaxis] * rate)
        base, _, met = _floors(threshold, power[short], leak[short], uplink.loss[short])
        low, high = np.where(met, middle, low), np.where(met, high, middle)
        level = np.where(met[:, np.newaxis], base, level)
    uplink.factor[short] = low
    uplink.level[short] = level / np.sum(uplink.loss[short] * level, axis=1, keepdims=True)


def _newton(uplink: Uplink, base: Array, jacobian: Array, power: Array, leak: Array) -> None:
    """Take a primal-dual step on the share, with the interference term linearised."""
    share, price, scale = uplink.share, uplink.price, uplink.scale[:, np.newaxis]
    level = base + _times(jacobian, share)
    noise = power + _times(leak, level)
    total = noise + level
    relief = 1.0 / noise - 1.0 / total
    slope = 1.0 / total - _times(np.swapaxes(leak, 1, 2), relief)
    slope = _times(np.swapaxes(jacobian, 1, 2), slope) / scale
    margin = np.maximum(np.sum(share * slope, axis=1, keepdims=True) - slope, 0.0)
    own = np.einsum("tkk->tk", jacobian) / total / scale
    uplink.leeway = margin / (margin + own)
    reach = (np.eye(share.shape[1]) + leak) @ jacobian / total[:, :, np.newaxis]
    bend = np.swapaxes(reach, 1, 2) @ reach / scale[:, :, np.newaxis]
    mean = np.sum(share * price, axis=1, keepdims=True) / share.shape[1]
    gap = np.maximum(FALL * mean, LAST_GAP)
    diagonal = np.arange(share.shape[1])
    bend[:, diagonal, diagonal] += price / share
    right = np.stack([slope + gap / share, np.ones_like(share)], axis=-1)
    answer = np.linalg.solve(bend, right)
    value = np.sum(answer[..., 0], axis=1) / np.sum(answer[..., 1], axis=1)
    change = answer[..., 0] - value[:, np.newaxis] * answer[..., 1]
    price_change = (gap - price * change) / share - price
    error = np.abs(slope + price - value[:, np.newaxis])
    uplink.residual = np.max(share * np.maximum(error, price), axis=1)
    share = share + _reach(share, change) * change
    uplink.share = share / np.sum(share, axis=1, keepdims=True)
    uplink.price = price + _reach(price, price_change) * price_change


def _reach(value: Array, change: Array) -> Array:
    limit = np.where(change < 0.0, -TO_BOUNDARY * value / np.minimum(change, -1e-100), 1.0)
    reach: Array = np.minimum(1.0, np.min(limit, axis=1, keepdims=True))
    return reach


def _cost(spread: Array, loss: Array) -> Array:
    return _times(np.swapaxes(spread, 1, 2), loss)


def _times(matrix: Array, vector: Array) -> Array:
    product: Array = (matrix @ vector[..., np.newaxis])[..., 0]
    return product
