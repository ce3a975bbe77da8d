"""One Newton step of the interior-point method on the shape of one beam.

A beam's shape is scaled to unit response at its own object: w = v_0 + sum_l z_l v_l, with v_0 the
matched direction. What remains is to spend the least on power and on interference,

    minimise   P + sum_i weight_i |f_i|^2,   P = 1 + |z|^2,
    subject to |1 - |f_j|^2| <= ripple P     on the cover, Eq. (38f),

where every response f = a_0 + a^T z has real data a and complex z. With a beam of two columns f and
z have a second component, without the a_0, and |f|^2 is the sum over both. The iterates satisfy all
constraints strictly (no merit function is needed beyond the barrier itself); steps follow the
curved boundary by a second-order correction, since straight ones must be short there.

Within a step plain arrays are handed on: a `Shape` handed from function to function counts
references, which was seen to take a fifth of the time.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.advance import (
    adapt,
    move_multipliers,
    step_length,
    trust_multipliers,
)
from echobeam.beamforming.direct.arrays import add_rows, copy_into, fill_block, turned, zeros
from echobeam.beamforming.direct.compiling import compiled, inlined
from echobeam.beamforming.direct.linear import factor_shifted, solve
from echobeam.beamforming.direct.shape import (
    BARRIER,
    RESIDUAL,
    RIPPLE,
    SHIFT,
    TARGET,
    Shape,
    power_of,
    received,
    respond,
    slacks,
)
from echobeam.values import Array

LAST_BARRIER = 1e-9
"""Barrier parameter at which the iteration ends; costs about this much per active constraint."""

CENTRED = 3.0
"""The barrier falls when the residual is below this multiple of it."""

ON_SADDLE, WIDE_BARRIER = 1e-2, 1e-3
"""Part of that, down to a barrier, where the matrix is indefinite: a saddle is left fastest while
the barrier is wide. Without, three starts in four ended near one under planar arrays' wide covers.
"""

FALL, FALL_POWER = 0.1, 1.3
"""The barrier falls to min(FALL mu, mu**FALL_POWER)."""


@compiled
def _pull(lines: Array, response: Array, slope: Array, spread: float, z: Array) -> Array:
    """Return twice the gradient's sums over the rows, ``(R, n)``, and the identity's part."""
    count, size = lines.shape
    pull = np.empty(z.size)
    force = np.empty(count)
    for place in range(z.size):
        pull[place] = spread * z[place]
    for part in range(response.shape[0]):
        for row in range(count):
            force[row] = slope[row] * response[part, row]
        add_rows(lines, force, pull[part * size : (part + 1) * size])
    for place in range(z.size):
        pull[place] *= 2.0
    return pull


@compiled
def bends(low: Array, high: Array, weight: Array, ripple: float) -> tuple[Array, float]:
    """Return the rows' part and the identity's part in the Lagrangian's curvature."""
    m = low.size
    bend = np.empty(m + weight.size)
    spread = 1.0
    for row in range(m):
        bend[row] = high[row] - low[row]
        spread -= ripple * (high[row] + low[row])
    for row in range(weight.size):
        bend[m + row] = weight[row]
    return bend, spread


@compiled
def _lower_barrier(
    scalars: Array,
    gradient: Array,
    power: float,
    low: Array,
    high: Array,
    below: Array,
    above: Array,
) -> None:
    mu = scalars[BARRIER]
    residual = 0.0
    for value in gradient:
        residual = max(residual, abs(value))
    for row in range(low.size):
        residual = max(residual, abs(low[row] * below[row] - mu), abs(high[row] * above[row] - mu))
    residual /= power
    scalars[RESIDUAL] = residual
    on_saddle = scalars[SHIFT] > 0.0 and mu >= WIDE_BARRIER
    centred = CENTRED * mu * (ON_SADDLE if on_saddle else 1.0)
    if residual < centred and scalars[RIPPLE] <= scalars[TARGET] and mu > LAST_BARRIER:
        scalars[BARRIER] = max(min(FALL * mu, mu**FALL_POWER), LAST_BARRIER)


@compiled
def _matrix(
    lines: Array,
    response: Array,
    z: Array,
    bend: Array,
    spread: float,
    ripple: float,
    stiff_low: Array,
    stiff_high: Array,
) -> Array:
    """Return the condensed Newton matrix ``(2 r n, 2 r n)``; the lower triangle counts."""
    size, parts = lines.shape[1], response.shape[0]
    m = stiff_low.size
    matrix = np.empty((z.size, z.size))
    stiff, lean = np.empty(m), np.empty(m)
    total = 0.0
    for row in range(m):
        stiff[row] = 4.0 * (stiff_low[row] + stiff_high[row])
        lean[row] = stiff_low[row] - stiff_high[row]
        total += stiff_low[row] + stiff_high[row]
    weights = np.empty(bend.size)
    for part in range(parts):
        for row in range(bend.size):
            weights[row] = 2.0 * bend[row]
        for row in range(m):
            weights[row] += stiff[row] * response[part, row] ** 2
        fill_block(lines, weights, matrix, part * size, part * size)
        for other in range(part):
            for row in range(m):
                weights[row] = stiff[row] * response[part, row] * response[other, row]
            fill_block(lines, weights[:m], matrix, part * size, other * size)
    side = zeros(z.size)
    for part in range(parts):
        for row in range(m):
            weights[row] = lean[row] * response[part, row]
        add_rows(lines, weights[:m], side[part * size : (part + 1) * size])
    for place in range(z.size):
        side[place] = 4.0 * ripple * (side[place] + 0.5 * ripple * total * z[place])
    for first in range(z.size):
        matrix[first, first] += 2.0 * spread
        for second in range(first + 1):
            matrix[first, second] += z[first] * side[second] + side[first] * z[second]
    return matrix


@inlined
def step(shape: Shape, weight: Array) -> None:
    """Take one step, in place; the residual left in the scalars is that of the old point.

    Parameters
    ----------
    shape
        Strictly feasible for the ripple imposed now.
    weight
        ``(R - m,)``: price of the interference at the other objects.
    """
    rows, z, response = shape.rows, shape.z, shape.response
    low, high, scalars = shape.low, shape.high, shape.scalars
    m, flat = low.size, z.size
    ripple, target = scalars[RIPPLE], scalars[TARGET]
    power = power_of(z)
    below, above = np.empty(m), np.empty(m)
    slacks(response, ripple * power, below, above)
    bend, spread = bends(low, high, weight, ripple)
    lines = turned(rows)
    gradient = _pull(lines, response, bend, spread, z)
    _lower_barrier(scalars, gradient, power, low, high, below, above)
    mu = scalars[BARRIER]
    lost = (target - ripple) * power
    stiff_low, stiff_high = np.empty(m), np.empty(m)
    for row in range(m):
        stiff_low[row], stiff_high[row] = low[row] / below[row], high[row] / above[row]
    slope = np.empty(bend.size)
    copy_into(slope, bend)
    aimed = 1.0
    for row in range(m):
        aim_low = mu / below[row] - stiff_low[row] * lost
        aim_high = mu / above[row] - stiff_high[row] * lost
        slope[row] = aim_high - aim_low
        aimed -= ripple * (aim_low + aim_high)
    ahead = _pull(lines, response, slope, aimed, z)
    right = np.empty(flat)
    copy_into(right, ahead)
    inverse = np.empty(flat)
    matrix = _matrix(lines, response, z, bend, spread, ripple, stiff_low, stiff_high)
    lower, scalars[SHIFT] = factor_shifted(matrix, inverse, scalars[SHIFT])
    inclination = 0.0
    solve(lower, inverse, ahead)
    for place in range(flat):
        ahead[place] = -ahead[place]
        inclination += right[place] * ahead[place]
    moved = np.empty(response.shape)
    respond(rows, ahead, moved)
    bent = _correction(lines, response, z, ahead, moved, ripple, stiff_low, stiff_high)
    solve(lower, inverse, bent)
    size = power_of(ahead) - 1.0
    aside = power_of(bent) - 1.0
    factor = -min(1.0, np.sqrt(size / max(aside, 1e-300)))
    for place in range(flat):
        bent[place] *= factor
    bowed = np.empty(response.shape)
    respond(rows, bent, bowed)
    move_multipliers(response, moved, z, ahead, low, high, below, above, mu, ripple, lost)
    length = step_length(
        z, response, ahead, bent, moved, bowed, below, above, weight, scalars, inclination
    )
    for place in range(flat):
        z[place] += length * (ahead[place] + length * bent[place])
    for part in range(response.shape[0]):
        for row in range(rows.shape[1]):
            response[part, row] += length * (moved[part, row] + length * bowed[part, row])
    adapt(scalars, length)
    trust_multipliers(response, z, low, high, scalars)


@compiled
def _correction(
    lines: Array,
    response: Array,
    z: Array,
    ahead: Array,
    moved: Array,
    ripple: float,
    stiff_low: Array,
    stiff_high: Array,
) -> Array:
    """Return the pull of the constraints' curvature along a direction."""
    widen = ripple * (power_of(ahead) - 1.0)
    slope = zeros(lines.shape[0])
    spread = 0.0
    for row in range(stiff_low.size):
        lift = received(moved, row)
        curve_low = stiff_low[row] * (widen + lift)
        curve_high = stiff_high[row] * (widen - lift)
        slope[row] = curve_low - curve_high
        spread += ripple * (curve_low + curve_high)
    return _pull(lines, response, slope, spread, z)
