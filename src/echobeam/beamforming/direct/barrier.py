"""One Newton step of the interior-point method on the shapes of many beams at once.

A beam's shape is scaled to unit response at its own object: w = v_0 + sum_l z_l v_l, with v_0 the
matched direction. What remains is to spend the least on power and on what the others hear,

    minimise   P + sum_i weight_i |f_i|^2,   P = 1 + |z|^2,
    subject to |1 - |f_j|^2| <= ripple P     on the cover, Eq. (38f),

where every response f = a_0 + a^T z has real data a and complex z. The iterates keep all
constraints strictly (no merit function is needed beyond the barrier itself); steps follow the
curved boundary by a second-order correction, since straight ones must be short there.

Arrays have the batch of S beams on the last axis: R rows (m of the cover, then one per other
object), n reduced coordinates, 2 parts (real, imaginary).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from echobeam.beamforming.direct.symmetric import LEAST_SHIFT, factor_shifted, solve
from echobeam.values import Array, IntArray

LAST_BARRIER = 1e-9
"""Barrier parameter at which the iteration ends; costs about this much per active constraint."""

CENTRED = 3.0
"""The barrier falls when the residual is below this multiple of it."""

FALL, FALL_POWER = 0.1, 1.3
"""The barrier falls to min(FALL mu, mu**FALL_POWER)."""

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


@dataclass(slots=True)
class Shapes:
    """The shapes of S beams on their way to the optimum; every array ends with the batch.

    Attributes
    ----------
    rows, offset
        ``(R, n, S)``, ``(R, S)``: a and a_0 of every response.
    target
        ``(S,)``: B_k / N, the ripple asked for.
    ripple
        ``(S,)``: the ripple imposed now, wider than asked until the iterates fit it.
    coordinates
        ``(2, n, S)``: z.
    response
        ``(R, 2, S)``: f at the rows.
    low, high
        ``(m, S)``: multipliers of |f|^2 >= 1 - ripple P and |f|^2 <= 1 + ripple P.
    barrier, shift, residual
        ``(S,)``: barrier parameter, last shift of the matrix, last KKT residual.
    """

    rows: Array
    offset: Array
    target: Array
    ripple: Array
    coordinates: Array
    response: Array
    low: Array
    high: Array
    barrier: Array
    shift: Array
    residual: Array

    @property
    def cover(self) -> int:
        """Number of rows on the cover, m."""
        return int(self.low.shape[0])

    @property
    def power(self) -> Array:
        """``(S,)``: P."""
        power: Array = 1.0 + np.einsum("cns,cns->s", self.coordinates, self.coordinates)
        return power

    @property
    def leak(self) -> Array:
        """``(R - m, S)``: |f|^2 at the other objects."""
        heard = self.response[self.cover :]
        leak: Array = np.einsum("rcs,rcs->rs", heard, heard)
        return leak

    def taken(self, index: IntArray) -> Shapes:
        """Return some of the beams, copied."""
        return Shapes(*(getattr(self, field.name)[..., index] for field in fields(self)))

    def put(self, index: IntArray, part: Shapes) -> None:
        """Write back beams that were taken."""
        for field in fields(self):
            getattr(self, field.name)[..., index] = getattr(part, field.name)


def slacks(response: Array, ripple: Array, power: Array) -> tuple[Array, Array]:
    """Return what is left of (38f) below and above, ``(m, S)`` each, at responses ``(m, 2, S)``."""
    excess = np.einsum("mcs,mcs->ms", response, response) - 1.0
    allowed = ripple * power
    return allowed + excess, allowed - excess


def step(shapes: Shapes, weight: Array, last: float) -> None:
    """Take one step of every beam, in place; `Shapes.residual` is that of the point left.

    Parameters
    ----------
    shapes
        Strictly feasible for the ripple imposed now.
    weight
        ``(R - m, S)``: price of what the other objects hear, relative to that of power.
    last
        Barrier parameter not to fall below.
    """
    m, z, f = shapes.cover, shapes.coordinates, shapes.response
    power = shapes.power
    below, above = slacks(f[:m], shapes.ripple, power)
    _lower_barrier(shapes, weight, below, above, last)
    mu = shapes.barrier
    bend = np.concatenate([shapes.high - shapes.low, weight])
    stiff_low, stiff_high = shapes.low / below, shapes.high / above
    lost = (shapes.target - shapes.ripple) * power
    aim_low, aim_high = mu / below - stiff_low * lost, mu / above - stiff_high * lost
    slope = np.concatenate([aim_high - aim_low, weight])
    spread = 1.0 - shapes.ripple * np.sum(aim_low + aim_high, axis=0)
    right = -_pull(shapes, slope, spread)
    upper, inverse = factor_shifted(_matrix(shapes, bend, stiff_low, stiff_high), shapes.shift)
    flat = z.shape[0] * z.shape[1]
    ahead = solve(upper, inverse, right.reshape(flat, -1)).reshape(z.shape)
    moved = _responses(shapes.rows, ahead)
    lift = np.einsum("mcs,mcs->ms", moved[:m], moved[:m])
    widen = shapes.ripple * np.einsum("cns,cns->s", ahead, ahead)
    curve_low, curve_high = stiff_low * (widen + lift), stiff_high * (widen - lift)
    nothing = np.zeros_like(weight)
    aside = -_pull(
        shapes,
        np.concatenate([curve_low - curve_high, nothing]),
        shapes.ripple * np.sum(curve_low + curve_high, axis=0),
    )
    bent = solve(upper, inverse, aside.reshape(flat, -1)).reshape(z.shape)
    size = np.einsum("cns,cns->s", ahead, ahead)
    bent *= np.minimum(1.0, np.sqrt(size / np.maximum(np.einsum("cns,cns->s", bent, bent), 1e-300)))
    bowed = _responses(shapes.rows, bent)
    inclination = -np.einsum("cns,cns->s", right, ahead)
    length = _search(shapes, weight, (ahead, bent, moved, bowed), inclination, (below, above))
    _move_multipliers(shapes, ahead, moved, below, above, lost)
    # To the last digit where the search has been, so that what was feasible there is so here.
    shapes.coordinates = z + length * (ahead + length * bent)
    shapes.response = f + length * (moved + length * bowed)
    eased = shapes.shift * np.where(length >= 1.0, EASE_FAST, EASE)
    tightened = np.maximum(TIGHTEN * shapes.shift, LEAST_SHIFT)
    shapes.shift = np.where(length < SHORT, tightened, np.where(eased < NO_SHIFT, 0.0, eased))
    shapes.ripple = _narrowed(shapes.ripple, shapes.target, length)
    _trust_multipliers(shapes)


def _narrowed(ripple: Array, target: Array, reach: Array) -> Array:
    return np.where(reach < 1.0, ripple + reach * (target - ripple), target)


def _responses(rows: Array, coordinates: Array) -> Array:
    real = np.einsum("rns,ns->rs", rows, coordinates[0])
    imaginary = np.einsum("rns,ns->rs", rows, coordinates[1])
    return np.stack([real, imaginary], axis=1)


def respond(shapes: Shapes) -> None:
    """Set the responses from the coordinates."""
    shapes.response = _responses(shapes.rows, shapes.coordinates)
    shapes.response[:, 0] += shapes.offset


def _pull(shapes: Shapes, slope: Array, spread: Array) -> Array:
    """Return the gradient ``(2, n, S)`` of spread P + sum_r slope_r |f_r|^2."""
    force = slope[:, np.newaxis] * shapes.response
    pull = np.stack([np.einsum("rns,rs->ns", shapes.rows, force[:, part]) for part in range(2)])
    pull += spread * shapes.coordinates
    return 2.0 * pull


def _lower_barrier(shapes: Shapes, weight: Array, below: Array, above: Array, last: float) -> None:
    """Measure the KKT residual and let the barrier fall where the point is centred."""
    mu = shapes.barrier
    slope = np.concatenate([shapes.high - shapes.low, weight])
    spread = 1.0 - shapes.ripple * np.sum(shapes.low + shapes.high, axis=0)
    gradient = np.max(np.abs(_pull(shapes, slope, spread)), axis=(0, 1), initial=0.0)
    gap = np.maximum(
        np.max(np.abs(shapes.low * below - mu), axis=0),
        np.max(np.abs(shapes.high * above - mu), axis=0),
    )
    shapes.residual = np.maximum(gradient, gap) / shapes.power
    ready = (shapes.residual < CENTRED * mu) & (shapes.ripple <= shapes.target)
    lower = np.maximum(np.minimum(FALL * mu, mu**FALL_POWER), last)
    shapes.barrier = np.where(ready & (mu > last), lower, mu)


def curvature(shapes: Shapes, bend: Array, spread: Array) -> Array:
    """Return spread I + sum_r bend_r a_r a_r^T, ``(n, n, S)``."""
    rows = np.ascontiguousarray(np.moveaxis(shapes.rows, -1, 0))
    weighted = rows * bend.T[:, :, np.newaxis]
    form = np.moveaxis(np.swapaxes(weighted, 1, 2) @ rows, 0, -1).copy()
    diagonal = np.arange(form.shape[0])
    form[diagonal, diagonal] += spread
    return form


def _matrix(shapes: Shapes, bend: Array, stiff_low: Array, stiff_high: Array) -> Array:
    """Return the condensed Newton matrix ``(2 n, 2 n, S)``: Lagrangian and constraints."""
    m, n = shapes.cover, shapes.rows.shape[1]
    batch = shapes.barrier.size
    real, imaginary = shapes.response[:m, 0], shapes.response[:m, 1]
    stiff = 4.0 * (stiff_low + stiff_high)
    weights = np.zeros((3, *bend.shape))
    weights[0] = weights[2] = 2.0 * bend
    weights[0, :m] += stiff * real**2
    weights[1, :m] = stiff * real * imaginary
    weights[2, :m] += stiff * imaginary**2
    rows = np.ascontiguousarray(np.moveaxis(shapes.rows, -1, 0))
    order = np.ascontiguousarray(np.transpose(weights, (2, 0, 1)))
    weighted = order[:, :, :, np.newaxis] * rows[:, np.newaxis]
    blocks = np.swapaxes(weighted.reshape(batch, 3, -1, n), -1, -2) @ rows[:, np.newaxis]
    blocks = np.transpose(blocks, (1, 2, 3, 0))
    matrix = np.empty((2 * n, 2 * n, batch))
    matrix[:n, :n], matrix[:n, n:], matrix[n:, n:] = blocks
    spread = 1.0 - shapes.ripple * np.sum(shapes.low + shapes.high, axis=0)
    diagonal = np.arange(2 * n)
    matrix[diagonal, diagonal] += 2.0 * spread
    z = shapes.coordinates.reshape(2 * n, batch)
    force = (stiff_low - stiff_high)[:, np.newaxis] * shapes.response[:m]
    side = np.stack(
        [np.einsum("mns,ms->ns", shapes.rows[:m], force[:, part]) for part in range(2)]
    ).reshape(2 * n, batch)
    total = np.sum(stiff_low + stiff_high, axis=0)
    # e e^T total + v e^T + e v^T with e = 2 ripple z and v = 2 side, as one symmetric product.
    outer = 4.0 * shapes.ripple * (side + 0.5 * shapes.ripple * total * z)
    for row in range(2 * n):
        matrix[row, row:] += z[row] * outer[row:] + outer[row] * z[row:]
    return matrix


def _search(
    shapes: Shapes,
    weight: Array,
    arc: tuple[Array, Array, Array, Array],
    inclination: Array,
    slack: tuple[Array, Array],
) -> Array:
    """Return how far each beam goes along its arc: feasible, and lower on the barrier function.

    While the ripple is being narrowed the barrier function is another one at every point, and
    feasibility alone decides.
    """
    m, z, f = shapes.cover, shapes.coordinates, shapes.response
    below, above = slack
    base = _merit(z, f[m:], below * above, weight, shapes.barrier)
    length = np.ones(inclination.size)
    left = np.arange(length.size)
    narrowing = shapes.ripple > shapes.target
    for _ in range(MOST_BACKTRACKS):
        every = left.size == length.size
        pick = slice(None) if every else left
        reach = length[pick]
        ahead, bent, moved, bowed = (array[..., pick] for array in arc)
        at = z[..., pick] + reach * (ahead + reach * bent)
        heard = f[..., pick] + reach * (moved + reach * bowed)
        ripple = _narrowed(shapes.ripple[pick], shapes.target[pick], reach)
        low, high = slacks(heard[:m], ripple, 1.0 + np.einsum("cns,cns->s", at, at))
        inside = np.all(low > (1.0 - TO_BOUNDARY) * below[:, pick], axis=0)
        inside &= np.all(high > (1.0 - TO_BOUNDARY) * above[:, pick], axis=0)
        value = _merit(at, heard[m:], np.abs(low * high), weight[:, pick], shapes.barrier[pick])
        start = base[pick]
        lower = value <= start + DECREASE * reach * inclination[pick] + ROUNDING * (
            1.0 + np.abs(start)
        )
        bad = ~(inside & (lower | narrowing[pick]))
        if not bad.any():
            return length
        left = left[bad]
        length[left] *= BACKTRACK
    length[left] = 0.0
    return length


def _merit(z: Array, heard: Array, slack_products: Array, weight: Array, mu: Array) -> Array:
    cost = 1.0 + np.einsum("cns,cns->s", z, z) + np.einsum("rs,rcs,rcs->s", weight, heard, heard)
    merit: Array = cost - mu * np.sum(np.log(np.maximum(slack_products, 1e-300)), axis=0)
    return merit


def _move_multipliers(
    shapes: Shapes, ahead: Array, moved: Array, below: Array, above: Array, lost: Array
) -> None:
    m, mu = shapes.cover, shapes.barrier
    rise = 2.0 * np.einsum("mcs,mcs->ms", shapes.response[:m], moved[:m])
    widen = 2.0 * shapes.ripple * np.einsum("cns,cns->s", shapes.coordinates, ahead) + lost
    low = (mu - shapes.low * (widen + rise)) / below - shapes.low
    high = (mu - shapes.high * (widen - rise)) / above - shapes.high
    reach = np.ones(mu.size)
    for change, value in ((low, shapes.low), (high, shapes.high)):
        limit = np.where(change < 0.0, -TO_BOUNDARY * value / np.minimum(change, -1e-100), 1.0)
        reach = np.minimum(reach, np.min(limit, axis=0, initial=1.0))
    shapes.low = shapes.low + reach * low
    shapes.high = shapes.high + reach * high


def _trust_multipliers(shapes: Shapes) -> None:
    """Keep multipliers near the central path, so that the matrix models the barrier."""
    below, above = slacks(shapes.response[: shapes.cover], shapes.ripple, shapes.power)
    for name, slack in (("low", below), ("high", above)):
        centre = shapes.barrier / slack
        kept = np.clip(getattr(shapes, name), centre / TRUSTED_DUAL, centre * TRUSTED_DUAL)
        setattr(shapes, name, kept)
