"""The full coverage grid of one beam: what it misses there, what to impose next; see `cuts`."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.compiled.arrays import fill
from echobeam.beamforming.direct.compiled.beams import reduce
from echobeam.beamforming.direct.compiled.decorate import compiled
from echobeam.beamforming.direct.compiled.shape import (
    BARRIER,
    RIPPLE,
    TARGET,
    Shape,
    power_of,
    respond_from,
    slacks,
)
from echobeam.beamforming.direct.cuts import (
    IDLE,
    LAST_RESORT,
    LEAST_IDLE,
    LEAST_NEAR,
    MISSED,
    MOST_NEAR,
    MOST_RESTART,
    NEAR,
    RESTART,
    ROOM,
)
from echobeam.values import Array, BoolArray, ComplexArray


@compiled
def relative_excess(turns: Array, weights: ComplexArray, allowed: float, excess: Array) -> float:
    """Fill ``(G,)`` with the excess over the ripple allowed, relative to it; return the largest.

    Parameters
    ----------
    turns
        ``(2, G)``: cosines and sines of the phases of a beam's own grid.
    weights
        ``(N,)``: antenna weights of unit own response.
    allowed
        Ripple times power.
    excess
        Filled.
    """
    n_tx = weights.size
    size = excess.size
    real, imaginary = np.empty(size), np.empty(size)
    fill(real, weights[n_tx - 1].real)
    fill(imaginary, weights[n_tx - 1].imag)
    for antenna in range(n_tx - 2, -1, -1):
        right, up = weights[antenna].real, weights[antenna].imag
        for point in range(size):
            along, across = real[point], imaginary[point]
            cosine, sine = turns[0, point], turns[1, point]
            real[point] = along * cosine + across * sine + right
            imaginary[point] = across * cosine - along * sine + up
    worst = -1.0
    for point in range(size):
        squared = real[point] * real[point] + imaginary[point] * imaginary[point]
        excess[point] = abs(squared / n_tx - 1.0) / allowed - 1.0
        worst = max(worst, excess[point])
    return worst


@compiled
def impose(shape: Shape, excess: Array, first: int, spare: int, phases: Array) -> None:
    """Impose grid points that are near their limit or beyond, in place of idle ones.

    The first points stay, unless there is no other room for a point beyond its limit.

    Parameters
    ----------
    shape
        All but its basis and its coordinates is changed.
    excess
        ``(J,)``: `relative_excess` on the beam's own grid, which begins at ``first``.
    first
        Index into the phases.
    spare
        Number of points, the last ones, that may be replaced freely.
    phases
        ``(G,)`` rad.
    """
    points = shape.points
    near = min(max(NEAR * np.sqrt(shape.scalars[BARRIER]), LEAST_NEAR), MOST_NEAR)
    wanted = _peaks(excess)
    kept = points.size - spare
    for place in range(points.size):
        wanted[points[place] - first] = -np.inf
    given = np.empty(points.size)
    for place in range(points.size):
        given[place] = excess[points[place] - first]
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
        if not (urgent > -near and slack > (LEAST_IDLE if urgent > MISSED else IDLE)):
            break
        wanted[best], given[idle] = -np.inf, np.inf
        points[idle] = first + best
        new[idle] = changed = True
    if changed:
        _refresh(shape, new, phases)


@compiled
def _peaks(excess: Array) -> Array:
    """Return the excess at local maxima along the grid and at their neighbours, else -inf."""
    size = excess.size
    peaks = np.empty(size)
    fill(peaks, -np.inf)
    for point in range(size):
        left = point == 0 or excess[point] >= excess[point - 1]
        right = point == size - 1 or excess[point] >= excess[point + 1]
        if left and right:
            for near in range(max(point - 1, 0), min(point + 2, size)):
                peaks[near] = excess[near]
    return peaks


@compiled
def _refresh(shape: Shape, new: BoolArray, phases: Array) -> None:
    """Take over changed points: rows, responses, a ripple that fits, multipliers."""
    scalars, low, high, response = shape.scalars, shape.low, shape.high, shape.response
    m = low.size
    for place in range(m):
        if new[place]:
            phase = phases[shape.points[place]]
            shape.offset[place] = reduce(shape.basis, phase, shape.rows, place)
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
def patch(z: Array, worst: float) -> None:
    """Spend power in the spare direction for an excess, relative, in place; see `cuts.patched`."""
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
