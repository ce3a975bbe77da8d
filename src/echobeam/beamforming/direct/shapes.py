"""All shapes of one trial: where they start, their gains elsewhere, their violations; `direct`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.beamforming.direct.arrays import copy_into
from echobeam.beamforming.direct.beams import beam_basis, reduce
from echobeam.beamforming.direct.compiling import compiled, inlined
from echobeam.beamforming.direct.grid import relative_excess
from echobeam.beamforming.direct.shape import SCALARS, TARGET, Shape, power_of, received
from echobeam.beamforming.direct.start import keep_warm, make_feasible, start_shape
from echobeam.beamforming.direct.steering import lift
from echobeam.values import Array, ComplexArray, IntArray

LEAST_TARGET = 1e-12
"""Ripple that is imposed in place of none: an interior is needed."""


class Covers(NamedTuple):
    """Objects and covers of one trial's K beams; see `layout.Layout`.

    Attributes
    ----------
    own, nodes
        ``(K, d)`` and ``(K, J, d)`` rad.
    grid
        ``(K, d, G)`` rad: the full grid of (38f); only the first ones are a beam's own.
    points
        ``(K,)``.
    near
        ``(K or 1, G, n)``.
    first, bow
        ``(K, m)`` and ``(K, d, m)`` rad.
    spare
        Number of points that may be replaced.
    ripple
        ``(K,)``: B_k / N.
    n_tx, columns
        Number of elements, and of those in a row.
    """

    own: Array
    nodes: Array
    grid: Array
    points: IntArray
    near: IntArray
    first: IntArray
    bow: Array
    spare: int
    ripple: Array
    n_tx: int
    columns: int


class Shapes(NamedTuple):
    """The shapes of a trial's K beams on their way, see `Shape`.

    Attributes
    ----------
    basis
        ``(K, r, N)``.
    turns
        ``(K, d, 2, G)``: cosines and sines of the phases.
    points
        ``(K, m)``: grid points imposed.
    rows, offset, response
        ``(K, n, R)``, ``(K, R)``, ``(K, 2 r, R)``, see `Shape`.
    z
        ``(K, 2 r n)``.
    low, high
        ``(K, m)``: multipliers.
    scalars
        ``(K, SCALARS)``.
    """

    basis: Array
    turns: Array
    points: IntArray
    rows: Array
    offset: Array
    response: Array
    z: Array
    low: Array
    high: Array
    scalars: Array


@compiled
def shape_of(shapes: Shapes, beam: int) -> Shape:
    """Return one of the shapes; what is written into it is written into all."""
    return Shape(
        shapes.basis[beam],
        shapes.points[beam],
        shapes.rows[beam],
        shapes.offset[beam],
        shapes.response[beam],
        shapes.z[beam],
        shapes.low[beam],
        shapes.high[beam],
        shapes.scalars[beam],
    )


@inlined
def start_shapes(covers: Covers, chirp: Array, warm: ComplexArray) -> Shapes:
    """Return where a trial's shapes start.

    Parameters
    ----------
    covers
        Of the trial.
    chirp
        ``(r, d)``: rates of the chirps of each column's start.
    warm
        ``(K, r N)`` beams to start from, NaN where there are none, or ``(0, 0)``.
    """
    shapes = _room(covers, chirp.shape[0])
    n_objects, axes, size = covers.grid.shape
    for beam in range(n_objects):
        shape = shape_of(shapes, beam)
        basis = beam_basis(beam, covers.own, covers.nodes[beam], covers.columns, covers.n_tx)
        for direction in range(basis.shape[0]):
            copy_into(shape.basis[direction], basis[direction])
        for axis in range(axes):
            for point in range(size):
                shapes.turns[beam, axis, 0, point] = np.cos(covers.grid[beam, axis, point])
                shapes.turns[beam, axis, 1, point] = np.sin(covers.grid[beam, axis, point])
        for place in range(shape.points.size):
            shape.points[place] = covers.first[beam, place]
        _fill_rows(shape, covers, beam)
        shape.scalars[TARGET] = max(covers.ripple[beam], LEAST_TARGET)
        start_shape(shape, covers.bow[beam], chirp)
        if warm.size:
            keep_warm(shape, warm[beam])
        make_feasible(shape)
    return shapes


@compiled
def _room(covers: Covers, columns: int) -> Shapes:
    """Return shapes of so many columns that are yet to be filled."""
    n_objects, axes, size = covers.grid.shape
    m, n = covers.first.shape[1], min(covers.n_tx, n_objects + covers.nodes.shape[1]) - 1
    count = m + n_objects - 1
    return Shapes(
        basis=np.empty((n_objects, n + 1, covers.n_tx)),
        turns=np.empty((n_objects, axes, 2, size)),
        points=np.empty((n_objects, m), dtype=np.int64),
        rows=np.empty((n_objects, n, count)),
        offset=np.empty((n_objects, count)),
        response=np.empty((n_objects, 2 * columns, count)),
        z=np.empty((n_objects, 2 * columns * n)),
        low=np.empty((n_objects, m)),
        high=np.empty((n_objects, m)),
        scalars=np.empty((n_objects, SCALARS)),
    )


@compiled
def _fill_rows(shape: Shape, covers: Covers, beam: int) -> None:
    """Fill a beam's rows: the points imposed on it, then the other objects."""
    basis, rows, columns = shape.basis, shape.rows, covers.columns
    m, phase = shape.points.size, np.empty(covers.own.shape[1])
    for place in range(m):
        for axis in range(phase.size):
            phase[axis] = covers.grid[beam, axis, shape.points[place]]
        shape.offset[place] = reduce(basis, phase, columns, rows, place)
    place = m
    for other in range(covers.own.shape[0]):
        if other != beam:
            shape.offset[place] = reduce(basis, covers.own[other], columns, rows, place)
            place += 1


@compiled
def measure_leaks(shapes: Shapes, power: Array, leak: Array) -> None:
    """Fill ``(K,)`` powers and ``(K, K)`` leaks of shapes."""
    n_objects, m = shapes.low.shape
    for beam in range(n_objects):
        power[beam] = power_of(shapes.z[beam])
        leak[beam, beam] = 0.0
        row = m
        for other in range(n_objects):
            if other != beam:
                leak[beam, other] = received(shapes.response[beam], row)
                row += 1


@compiled
def excess_of(
    covers: Covers, shapes: Shapes, beam: int, weights: ComplexArray, excess: Array
) -> float:
    """Fill what a beam misses of its own grid, relative; return the largest."""
    count, n_tx = covers.points[beam], covers.n_tx
    lift(shapes.basis[beam], shapes.z[beam], weights)
    allowed = shapes.scalars[beam, TARGET] * power_of(shapes.z[beam])
    turns = shapes.turns[beam]
    return relative_excess(turns, covers.columns, weights, n_tx, allowed, excess[:count])
