"""Powers of one trial's beams, found in the dual uplink.

For given shapes the SINRs that K beams reach with power P_T are those that K users would reach if
the beams received instead, user i sending with lambda_i and sum_i loss_i lambda_i = P_T
(uplink-downlink duality: the two power equations are each other's transpose). In the uplink the
shapes separate: beam k wants the least P_k + sum_i lambda_i leak_ki, whatever the others do. So
shapes and lambda are improved in turn, each step raising the same sum rate; little is coupled,
and a few turns suffice.

lambda lives on a simplex once the floors (38e) are taken off:
lambda = (I - Gamma leak)^-1 (Gamma P + surplus), surplus >= 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.beamforming.direct.arrays import copy_into, fill, scaled_identity, zeros
from echobeam.beamforming.direct.compiling import compiled
from echobeam.beamforming.direct.linear import eliminate, inverse_of
from echobeam.values import Array

LAST_GAP = 1e-11
"""Complementarity, relative to the sum rate, at which the powers are taken as optimal."""

FIRST_GAP = 1e-2

FALL = 0.1

TO_BOUNDARY = 0.99

BISECTIONS = 50

SILENT = 1e-8
"""Part of the power below which an object counts as not served."""

SCALE, FACTOR, RESIDUAL, SCALARS = 0, 1, 2, 3
"""Places in `Powers.scalars`, and their number."""


class Powers(NamedTuple):
    """Dual uplink of one trial: ``(K,)`` each, and ``(SCALARS,)``.

    Attributes
    ----------
    loss
        Noise referred to the array, relative to N P_T.
    threshold
        2^Gamma_k - 1.
    share, price
        Surplus as parts of the whole, and their multipliers.
    level
        lambda.
    reduced_cost
        Part by which the cost of an object's beam could fall before the object would be worth
        serving; 0 for those that are served.
    scalars
        A sum rate (nats) to measure others by; the common factor of the floors' rates that can be
        met, 1 if all can; the KKT residual of the share, relative.
    """

    loss: Array
    threshold: Array
    share: Array
    price: Array
    level: Array
    reduced_cost: Array
    scalars: Array


@compiled
def start_powers(loss: Array, threshold: Array, share: Array) -> Powers:
    """Return the start of a trial's powers; the share is changed later on."""
    users = loss.size
    powers = Powers(
        loss=loss,
        threshold=threshold,
        share=share,
        price=np.empty(users),
        level=np.empty(users),
        reduced_cost=np.empty(users),
        scalars=np.empty(SCALARS),
    )
    least = np.inf
    for user in range(users):
        least = min(least, loss[user])
        powers.price[user] = FIRST_GAP
        powers.level[user] = share[user] / loss[user]
        powers.reduced_cost[user] = 0.0
    powers.scalars[SCALE] = np.log1p(1.0 / least)
    powers.scalars[FACTOR] = 1.0
    powers.scalars[RESIDUAL] = np.inf if users > 1 else 0.0
    return powers


@compiled
def improve(powers: Powers, power: Array, leak: Array, hold: bool) -> None:
    """Improve lambda for shapes as they are, in place.

    Parameters
    ----------
    powers
        All but loss and threshold is changed.
    power
        ``(K,)``.
    leak
        ``(K, K)``: [k, i] gain of beam k at object i, zero on the diagonal.
    hold
        Leave the shares of the surplus as they are.
    """
    loss, threshold, level, scalars = powers.loss, powers.threshold, powers.level, powers.scalars
    users = loss.size
    base, spread, met = _floors(threshold, power, leak, loss)
    if met:
        scalars[FACTOR] = 1.0
    else:
        scalars[FACTOR] = _share_shortage(threshold, power, leak, loss, level)
        fill(base, 0.0)
        spread = scaled_identity(users, 1.0)
    budget = 1.0
    for user in range(users):
        budget -= loss[user] * base[user]
    for column in range(users):
        cost = 0.0
        for row in range(users):
            cost += spread[row, column] * loss[row]
        for row in range(users):
            spread[row, column] *= budget / cost
    if users > 1 and not hold:
        _newton(powers, base, spread, power, leak)
    if met:
        for row in range(users):
            level[row] = base[row]
            for column in range(users):
                level[row] += spread[row, column] * powers.share[column]
    else:
        scalars[RESIDUAL] = 0.0
    for user in range(users):
        if not (met and loss[user] * level[user] < SILENT):
            powers.reduced_cost[user] = 0.0


@compiled
def downlink(powers: Powers, power: Array, leak: Array, ratio: Array, received: Array) -> bool:
    """Fill ``(K,)`` SINRs and the powers that reach them; return whether they exist."""
    loss, level = powers.loss, powers.level
    users = loss.size
    system = scaled_identity(users, 1.0)
    right = np.empty((users, 1))
    for row in range(users):
        noise = power[row]
        for column in range(users):
            noise += leak[row, column] * level[column]
        ratio[row] = level[row] / noise
    for row in range(users):
        right[row, 0] = ratio[row] * loss[row]
        for column in range(users):
            system[row, column] -= ratio[row] * leak[column, row]
    eliminate(system, right)
    spent = 0.0
    for row in range(users):
        spent += right[row, 0] * power[row]
    good = True
    for row in range(users):
        received[row] = right[row, 0] / spent
        good &= 0.0 <= received[row] < np.inf
    return good


@compiled
def _floors(threshold: Array, power: Array, leak: Array, loss: Array) -> tuple[Array, Array, bool]:
    """Return the least lambda, how it grows with the surplus, and whether it can be paid."""
    users = loss.size
    matrix = scaled_identity(users, 1.0)
    for row in range(users):
        for column in range(users):
            matrix[row, column] -= threshold[row] * leak[row, column]
    spread, bounded = inverse_of(matrix)
    base = zeros(users)
    paid = 0.0
    for row in range(users):
        for column in range(users):
            base[row] += spread[row, column] * threshold[column] * power[column]
        paid += loss[row] * base[row]
    return base, spread, bounded and paid < 1.0


@compiled
def _share_shortage(
    threshold: Array, power: Array, leak: Array, loss: Array, level: Array
) -> float:
    """Set the levels to those of the largest common part of the floors' rates that can be paid."""
    low, high = 0.0, 1.0
    part = np.empty(loss.size)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        for user in range(loss.size):
            part[user] = np.expm1(middle * np.log1p(threshold[user]))
        base, _, met = _floors(part, power, leak, loss)
        if met:
            low = middle
            copy_into(level, base)
        else:
            high = middle
    total = 0.0
    for user in range(loss.size):
        total += loss[user] * level[user]
    for user in range(loss.size):
        level[user] /= total
    return low


@compiled
def _newton(powers: Powers, base: Array, jacobian: Array, power: Array, leak: Array) -> None:
    """Take a primal-dual step on the share, with the interference term linearised."""
    share, price, scalars = powers.share, powers.price, powers.scalars
    users = share.size
    scale = scalars[SCALE]
    level = np.empty(users)
    copy_into(level, base)
    mean = 0.0
    for row in range(users):
        for column in range(users):
            level[row] += jacobian[row, column] * share[column]
        mean += share[row] * price[row] / users
    gap = max(FALL * mean, LAST_GAP)
    total, relief = np.empty(users), np.empty(users)
    for row in range(users):
        noise = power[row]
        for column in range(users):
            noise += leak[row, column] * level[column]
        total[row] = noise + level[row]
        relief[row] = 1.0 / noise - 1.0 / total[row]
    pull = np.empty(users)
    for row in range(users):
        pull[row] = 1.0 / total[row]
        for column in range(users):
            pull[row] -= leak[column, row] * relief[column]
    reach = np.empty((users, users))
    for row in range(users):
        for column in range(users):
            value = jacobian[row, column]
            for other in range(users):
                value += leak[row, other] * jacobian[other, column]
            reach[row, column] = value / total[row]
    slope = zeros(users)
    bend = scaled_identity(users, 0.0)
    right = np.empty((users, 2))
    for row in range(users):
        for other in range(users):
            slope[row] += jacobian[other, row] * pull[other] / scale
        for column in range(users):
            for other in range(users):
                bend[row, column] += reach[other, row] * reach[other, column] / scale
        bend[row, row] += price[row] / share[row]
        right[row, 0] = slope[row] + gap / share[row]
        right[row, 1] = 1.0
    best = 0.0
    for row in range(users):
        best += share[row] * slope[row]
    for row in range(users):
        margin = max(best - slope[row], 0.0)
        powers.reduced_cost[row] = margin / (margin + jacobian[row, row] / total[row] / scale)
    eliminate(bend, right)
    value, weight = 0.0, 0.0
    for row in range(users):
        value += right[row, 0]
        weight += right[row, 1]
    value /= weight
    scalars[RESIDUAL] = _move(share, price, slope, right, value, gap)


@compiled
def _move(
    share: Array, price: Array, slope: Array, right: Array, value: float, gap: float
) -> float:
    """Move share and prices as far as they stay positive; return the residual of the old point."""
    users = share.size
    change, price_change = np.empty(users), np.empty(users)
    residual, reach, price_reach = 0.0, 1.0, 1.0
    for row in range(users):
        error = abs(slope[row] + price[row] - value)
        residual = max(residual, share[row] * max(error, price[row]))
        change[row] = right[row, 0] - value * right[row, 1]
        price_change[row] = (gap - price[row] * change[row]) / share[row] - price[row]
        if change[row] < 0.0:
            reach = min(reach, -TO_BOUNDARY * share[row] / change[row])
        if price_change[row] < 0.0:
            price_reach = min(price_reach, -TO_BOUNDARY * price[row] / price_change[row])
    total = 0.0
    for row in range(users):
        share[row] += reach * change[row]
        price[row] += price_reach * price_change[row]
        total += share[row]
    for row in range(users):
        share[row] /= total
    return residual
