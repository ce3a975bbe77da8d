"""Full coverage grid of one beam: violations of (38f) on it, and the points to impose next."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.arrays import fill
from echobeam.beamforming.direct.beams import reduce
from echobeam.beamforming.direct.compiling import compiled
from echobeam.beamforming.direct.shape import (
    BARRIER,
    RIPPLE,
    TARGET,
    Shape,
    power_of,
    respond_from,
    slacks,
)
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

MISSED = 2e-8
"""Excess of ripple, relative to what is allowed, that is left to `repair_coverage`."""

NEAR, LEAST_NEAR, MOST_NEAR = 1.0, 0.01, 0.5
"""Slack, relative to what is allowed, up to which a peak is imposed: NEAR sqrt(barrier), within
bounds."""

IDLE, LEAST_IDLE = 0.1, 1e-5
"""Slack, relative to what is allowed, from which an imposed point may be replaced: by one that is
near its limit, and by one beyond it."""

LAST_RESORT = 2.0 * LEAST_IDLE
"""Slack for which one of the first points counts that has more than IDLE: it is replaced by points
beyond their limit when no other is idle."""

RESTART, MOST_RESTART = 0.03, 1e-3

ROOM = 3.0


@compiled
def relative_excess(
    turns: Array, columns: int, weights: ComplexArray, n_tx: int, allowed: float, excess: Array
) -> float:
    """Fill ``(G,)`` with the excess over the ripple allowed, relative to it; return the largest.

    Parameters
    ----------
    turns
        ``(d, 2, G)``: cosines and sines of the phases of a beam's own grid.
    columns, n_tx
        Elements in a row, and N.
    weights
        ``(r N,)``: antenna weights of unit own response.
    allowed
        Ripple times power.
    excess
        Filled.
    """
    size = excess.size
    parts = np.empty((2, size))
    fill(excess, 0.0)
    for begin in range(0, weights.size, n_tx):
        _respond_to_grid(turns, columns, weights[begin : begin + n_tx], parts)
        for point in range(size):
            excess[point] += parts[0, point] ** 2 + parts[1, point] ** 2
    worst = -1.0
    for point in range(size):
        excess[point] = abs(excess[point] / n_tx - 1.0) / allowed - 1.0
        worst = max(worst, excess[point])
    return worst


@compiled
def _respond_to_grid(turns: Array, columns: int, weights: ComplexArray, parts: Array) -> None:
    """Fill ``(2, G)`` with the responses a^H w: by Horner's rule along each row, then over rows."""
    axes, size = turns.shape[0], parts.shape[1]
    along = np.empty((2, size))
    if axes == 1:
        _along_row(turns[0], weights, parts)
        return
    fill(parts[0], 0.0)
    fill(parts[1], 0.0)
    for begin in range(weights.size - columns, -1, -columns):
        _along_row(turns[1], weights[begin : begin + columns], along)
        for point in range(size):
            right, up = parts[0, point], parts[1, point]
            cosine, sine = turns[0, 0, point], turns[0, 1, point]
            parts[0, point] = right * cosine + up * sine + along[0, point]
            parts[1, point] = up * cosine - right * sine + along[1, point]


@compiled
def _along_row(turns: Array, weights: ComplexArray, parts: Array) -> None:
    """Fill ``(2, G)`` with the polynomial of one row's weights."""
    last, size = weights.size - 1, parts.shape[1]
    real, imaginary = parts[0], parts[1]
    fill(real, weights[last].real)
    fill(imaginary, weights[last].imag)
    for antenna in range(last - 1, -1, -1):
        right, up = weights[antenna].real, weights[antenna].imag
        for point in range(size):
            along, across = real[point], imaginary[point]
            cosine, sine = turns[0, point], turns[1, point]
            real[point] = along * cosine + across * sine + right
            imaginary[point] = across * cosine - along * sine + up


@compiled
def exchange_points(
    shape: Shape, excess: Array, spare: int, grid: Array, near: IntArray, columns: int
) -> None:
    """Impose grid points that are near their limit or beyond, in place of idle ones.

    The first points stay, unless there is no other room for a point beyond its limit.

    Parameters
    ----------
    shape
        All but its basis and its coordinates is changed.
    excess
        ``(J,)``: `relative_excess` on the beam's own grid.
    spare
        Number of points, the last ones, that may be replaced freely.
    grid, near
        ``(d, G)`` rad and ``(G, n)``: phases of the grid points, and the neighbours of each.
    columns
        Elements in a row.
    """
    points = shape.points
    close = min(max(NEAR * np.sqrt(shape.scalars[BARRIER]), LEAST_NEAR), MOST_NEAR)
    wanted = _peaks(excess, near)
    kept = points.size - spare
    for place in range(points.size):
        wanted[points[place]] = -np.inf
    given = np.empty(points.size)
    for place in range(points.size):
        given[place] = excess[points[place]]
        if place < kept:
            given[place] = -LAST_RESORT if given[place] < -IDLE else np.inf
    new = np.empty(points.size, dtype=np.bool_)
    for place in range(points.size):
        new[place] = False
    changed = False
    for _ in range(min(points.size, excess.size)):
        best, idle = 0, 0
        for point in range(1, wanted.size):
            if wanted[point] > wanted[best]:
                best = point
        for place in range(1, points.size):
            if given[place] < given[idle]:
                idle = place
        urgent, slack = wanted[best], -given[idle]
        if not (urgent > -close and slack > (LEAST_IDLE if urgent > MISSED else IDLE)):
            break
        wanted[best], given[idle] = -np.inf, np.inf
        points[idle] = best
        new[idle] = changed = True
    if changed:
        _refresh(shape, new, grid, columns)


@compiled
def _peaks(excess: Array, near: IntArray) -> Array:
    """Return the excess at local maxima of the grid and at their neighbours, else -inf."""
    size, around = excess.size, near.shape[1]
    peaks = np.empty(size)
    fill(peaks, -np.inf)
    for point in range(size):
        highest = True
        for side in range(around):
            other = near[point, side]
            if 0 <= other < size and excess[other] > excess[point]:
                highest = False
        if highest:
            peaks[point] = excess[point]
            for side in range(around):
                other = near[point, side]
                if 0 <= other < size:
                    peaks[other] = excess[other]
    return peaks


@compiled
def _refresh(shape: Shape, new: BoolArray, grid: Array, columns: int) -> None:
    """Take over changed points: rows, responses, a ripple that fits, multipliers."""
    scalars, low, high, response = shape.scalars, shape.low, shape.high, shape.response
    m, phase = low.size, np.empty(grid.shape[0])
    for place in range(m):
        if new[place]:
            for axis in range(phase.size):
                phase[axis] = grid[axis, shape.points[place]]
            shape.offset[place] = reduce(shape.basis, phase, columns, shape.rows, place)
    respond_from(shape.rows, shape.offset, shape.z, response)
    power = power_of(shape.z)
    below, above = np.empty(m), np.empty(m)
    least = slacks(response, scalars[RIPPLE] * power, below, above)
    missing = max(-least, 0.0)
    scalars[BARRIER] = max(scalars[BARRIER], min(RESTART * missing, MOST_RESTART))
    short = max(ROOM * scalars[BARRIER] - least, 0.0)
    scalars[RIPPLE] = scalars[TARGET] + short / power
    slacks(response, scalars[RIPPLE] * power, below, above)
    for place in range(m):
        if new[place]:
            low[place] = scalars[BARRIER] / below[place]
            high[place] = scalars[BARRIER] / above[place]


@compiled
def repair_coverage(z: Array, worst: float) -> None:
    """Spend power in the spare direction for an excess, relative, in place.

    The spare direction is orthogonal to the cover, so that it raises the power alone, and with it
    the ripple that is allowed.
    """
    n = z.size // 2
    missing = max(worst, 0.0) * power_of(z) * (1.0 + 1e-3)
    size = z[n - 1] ** 2 + z[2 * n - 1] ** 2
    if size > 0.0:
        grown = np.sqrt((size + missing) / size)
        z[n - 1] *= grown
        z[2 * n - 1] *= grown
    else:
        z[n - 1] = np.sqrt(missing)
        z[2 * n - 1] = 0.0
