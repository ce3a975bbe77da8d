"""The full coverage grid: what beams miss of (38f) on it, and which points to impose next."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.barrier import Shapes, respond, slacks
from echobeam.beamforming.direct.beams import BeamSet
from echobeam.values import Array, BoolArray, ComplexArray

MISSED = 2e-8
"""Excess of ripple, relative to what is allowed, that is left to `patched`."""

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


def grid_excess(beams: BeamSet, weights: ComplexArray) -> Array:
    """Return ||w(own)|^2 - |w(grid)|^2| of beams of unit own response, ``(G, S)``.

    Parameters
    ----------
    beams
        S beams.
    weights
        ``(S, N)``: antenna weights.
    """
    turn = np.exp(-1j * beams.phases.T)
    coefficients = weights.T
    response = np.broadcast_to(coefficients[-1], turn.shape).copy()
    for antenna in range(beams.n_tx - 2, -1, -1):
        response *= turn
        response += coefficients[antenna]
    squared = response.real**2 + response.imag**2
    excess: Array = np.abs(squared / beams.n_tx - 1.0)
    return excess


def relative_excess(beams: BeamSet, shapes: Shapes) -> Array:
    """Return excess over the ripple asked for, relative to it, ``(G, S)``; negative where met."""
    allowed = shapes.target * shapes.power
    return grid_excess(beams, beams.lift(shapes.coordinates)) / allowed - 1.0


def impose(beams: BeamSet, shapes: Shapes, excess: Array) -> None:
    """Impose grid points that are near their limit or beyond, in place of idle ones.

    The first points stay, unless there is no other room for a point beyond its limit.

    Parameters
    ----------
    beams, shapes
        S beams; rows, responses, ripple and multipliers of those with new points are replaced.
    excess
        ``(G, S)``: `relative_excess`.
    """
    near = np.clip(NEAR * np.sqrt(shapes.barrier), LEAST_NEAR, MOST_NEAR)
    wanted = np.where(_peaks(excess), excess, -np.inf)
    np.put_along_axis(wanted, beams.points.T, -np.inf, axis=0)
    given = np.take_along_axis(excess, beams.points.T, axis=0)
    first = given[: beams.points.shape[1] - beams.spare]
    given[: len(first)] = np.where(first < -IDLE, -LAST_RESORT, np.inf)
    room = min(given.shape[0], wanted.shape[0])
    order = np.argsort(-wanted, axis=0, kind="stable")[:room]
    idle = np.argsort(given, axis=0, kind="stable")[:room]
    urgent = np.take_along_axis(wanted, order, axis=0)
    slack = -np.take_along_axis(given, idle, axis=0)
    worth = (urgent > -near) & (slack > np.where(urgent > MISSED, LEAST_IDLE, IDLE))
    for rank in range(room):
        which = np.flatnonzero(worth[rank])
        if not which.size:
            break
        beams.points[which, idle[rank, which]] = order[rank, which]
    _refresh(beams, shapes, np.any(worth, axis=0))


def _peaks(excess: Array) -> BoolArray:
    """Tell the local maxima along the grid, and their neighbours."""
    walled = np.pad(excess, ((1, 1), (0, 0)), constant_values=-np.inf)
    top = (excess >= walled[:-2]) & (excess >= walled[2:])
    peaks: BoolArray = top.copy()
    peaks[1:] |= top[:-1]
    peaks[:-1] |= top[1:]
    return peaks


def _refresh(beams: BeamSet, shapes: Shapes, changed: BoolArray) -> None:
    """Take over changed points: rows, responses, a ripple that fits, multipliers."""
    which = np.flatnonzero(changed)
    if not which.size:
        return
    part = shapes.taken(which)
    m = part.cover
    imposed = np.take_along_axis(beams.phases[which], beams.points[which], axis=1)
    vectors = beams.taken(which).reduced(imposed)
    new = np.any(part.rows[:m] != vectors[0], axis=1)
    part.rows[:m], part.offset[:m] = vectors
    respond(part)
    power = part.power
    below, above = slacks(part.response[:m], part.ripple, power)
    least = np.minimum(np.min(below, axis=0), np.min(above, axis=0))
    missing = np.maximum(-least, 0.0)
    part.barrier = np.maximum(part.barrier, np.minimum(RESTART * missing, MOST_RESTART))
    short = np.maximum(ROOM * part.barrier - least, 0.0)
    part.ripple = part.target + short / power
    below, above = slacks(part.response[:m], part.ripple, power)
    part.low = np.where(new, part.barrier / below, part.low)
    part.high = np.where(new, part.barrier / above, part.high)
    shapes.put(which, part)


def patched(beams: BeamSet, shapes: Shapes, excess: Array) -> tuple[ComplexArray, Array]:
    """Return antenna weights ``(S, N)`` that keep the grid to rounding, and their power ``(S,)``.

    What little a beam misses is bought with power in the spare direction, which hears and reaches
    nobody: the ripple allowed grows with it. Over a wide cover that is true only nearly; where more
    was missed than a finished beam does, what is still missing is bought after that. A cover that
    takes all directions leaves none to spare, and what is missed stays.
    """
    if beams.basis.shape[2] == beams.n_tx:
        return beams.lift(shapes.coordinates), shapes.power
    shapes = shapes.taken(np.arange(shapes.target.size))
    worst = np.maximum(np.max(excess, axis=0), 0.0)
    _buy(shapes, worst)
    again = np.flatnonzero(worst > MISSED)
    if again.size:
        part = shapes.taken(again)
        left = np.max(relative_excess(beams.taken(again), part), axis=0)
        _buy(part, np.maximum(left, 0.0))
        shapes.put(again, part)
    return beams.lift(shapes.coordinates), shapes.power


def _buy(shapes: Shapes, worst: Array) -> None:
    """Spend power in the spare direction for an excess ``(S,)``, relative, in place."""
    spare = shapes.coordinates[:, -1]
    missing = worst * shapes.power * (1.0 + 1e-3)
    size = np.einsum("cs,cs->s", spare, spare)
    grown = np.sqrt((size + missing) / np.where(size > 0.0, size, 1.0))
    shapes.coordinates[:, -1] = np.where(size > 0.0, spare * grown, 0.0)
    shapes.coordinates[0, -1] += np.where(size > 0.0, 0.0, np.sqrt(missing))
