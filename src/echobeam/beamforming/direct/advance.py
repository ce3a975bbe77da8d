"""Length of a Newton step, and what it changes: multipliers, shift, imposed ripple."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.compiling import compiled
from echobeam.beamforming.direct.linear import LEAST_SHIFT
from echobeam.beamforming.direct.shape import BARRIER, RIPPLE, SHIFT, TARGET, power_of, slacks
from echobeam.values import Array

TO_BOUNDARY = 0.995
DECREASE = 1e-4
BACKTRACK = 0.6
MOST_BACKTRACKS = 30
ROUNDING = 1e-11

SHORT, TIGHTEN = 0.2, 4.0
"""A step this short shows that the matrix bends too little; its shift grows by TIGHTEN."""

EASE, EASE_FAST, NO_SHIFT = 0.25, 0.1, 1e-4
"""Otherwise the shift falls, faster after whole steps, and vanishes below NO_SHIFT."""

TRUSTED_DUAL = 1e4
"""Multipliers are kept within this factor of barrier / slack."""


@compiled
def _merit(
    z: Array, response: Array, below: Array, above: Array, weight: Array, mu: float
) -> float:
    m = below.size
    merit = power_of(z)
    for part in range(response.shape[0]):
        for row in range(weight.size):
            merit += weight[row] * response[part, m + row] ** 2
    logarithms = 0.0
    for row in range(m):
        logarithms += np.log(below[row] * above[row])
    return merit - mu * logarithms


@compiled
def step_length(
    z: Array,
    response: Array,
    ahead: Array,
    bent: Array,
    moved: Array,
    bowed: Array,
    below: Array,
    above: Array,
    weight: Array,
    scalars: Array,
    inclination: float,
) -> float:
    """Return how far to go along the arc: feasible, and lower on the barrier function."""
    m, mu = below.size, scalars[BARRIER]
    ripple, target = scalars[RIPPLE], scalars[TARGET]
    base = _merit(z, response, below, above, weight, mu)
    low, high = np.empty(m), np.empty(m)
    at, reached = np.empty(z.size), np.empty(response.shape)
    length = 1.0
    for _ in range(MOST_BACKTRACKS):
        for place in range(z.size):
            at[place] = z[place] + length * (ahead[place] + length * bent[place])
        for part in range(response.shape[0]):
            for row in range(response.shape[1]):
                arc = moved[part, row] + length * bowed[part, row]
                reached[part, row] = response[part, row] + length * arc
        least = slacks(reached, _narrowed(ripple, target, length) * power_of(at), low, high)
        inside = least > 0.0
        for row in range(m):
            inside &= low[row] > (1.0 - TO_BOUNDARY) * below[row]
            inside &= high[row] > (1.0 - TO_BOUNDARY) * above[row]
        if inside:
            if ripple > target:
                return length
            enough = base + DECREASE * length * inclination + ROUNDING * (1.0 + abs(base))
            if _merit(at, reached, low, high, weight, mu) <= enough:
                return length
        length *= BACKTRACK
    return 0.0


@compiled
def _narrowed(ripple: float, target: float, reach: float) -> float:
    return ripple + reach * (target - ripple) if reach < 1.0 else target


@compiled
def move_multipliers(
    response: Array,
    moved: Array,
    z: Array,
    ahead: Array,
    low: Array,
    high: Array,
    below: Array,
    above: Array,
    mu: float,
    ripple: float,
    lost: float,
) -> None:
    """Take a primal-dual step on the multipliers, as far as they stay positive."""
    widen = lost
    for place in range(z.size):
        widen += 2.0 * ripple * z[place] * ahead[place]
    m = low.size
    change_low, change_high = np.empty(m), np.empty(m)
    reach = 1.0
    for row in range(m):
        rise = 0.0
        for part in range(response.shape[0]):
            rise += 2.0 * response[part, row] * moved[part, row]
        change_low[row] = (mu - low[row] * (widen + rise)) / below[row] - low[row]
        change_high[row] = (mu - high[row] * (widen - rise)) / above[row] - high[row]
        if change_low[row] < 0.0:
            reach = min(reach, -TO_BOUNDARY * low[row] / change_low[row])
        if change_high[row] < 0.0:
            reach = min(reach, -TO_BOUNDARY * high[row] / change_high[row])
    for row in range(m):
        low[row] += reach * change_low[row]
        high[row] += reach * change_high[row]


@compiled
def adapt(scalars: Array, length: float) -> None:
    """Adapt the shift and the imposed ripple to the length of the step."""
    shift = scalars[SHIFT]
    if length < SHORT:
        shift = max(TIGHTEN * shift, LEAST_SHIFT)
    else:
        shift *= EASE_FAST if length >= 1.0 else EASE
        if shift < NO_SHIFT:
            shift = 0.0
    scalars[SHIFT] = shift
    scalars[RIPPLE] = _narrowed(scalars[RIPPLE], scalars[TARGET], length)


@compiled
def trust_multipliers(response: Array, z: Array, low: Array, high: Array, scalars: Array) -> None:
    """Keep the multipliers within a factor of barrier over slack."""
    m = low.size
    below, above = np.empty(m), np.empty(m)
    slacks(response, scalars[RIPPLE] * power_of(z), below, above)
    for row in range(m):
        centre = scalars[BARRIER] / below[row]
        low[row] = min(max(low[row], centre / TRUSTED_DUAL), centre * TRUSTED_DUAL)
        centre = scalars[BARRIER] / above[row]
        high[row] = min(max(high[row], centre / TRUSTED_DUAL), centre * TRUSTED_DUAL)
