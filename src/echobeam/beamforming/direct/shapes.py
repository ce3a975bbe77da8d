"""All shapes of one trial: where they start, what is heard of them, what they miss; `direct`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.beamforming.direct.arrays import copy_into
from echobeam.beamforming.direct.beams import (
    beam_basis,
    first_points,
    node_count,
    point_counts,
    reduce,
)
from echobeam.beamforming.direct.compiling import compiled, inlined
from echobeam.beamforming.direct.grid import relative_excess
from echobeam.beamforming.direct.shape import SCALARS, TARGET, Shape, power_of
from echobeam.beamforming.direct.start import keep_warm, make_feasible, start_shape
from echobeam.beamforming.direct.steering import lift
from echobeam.values import Array, ComplexArray, IntArray

LEAST_TARGET = 1e-12
"""Ripple that is imposed in place of none: an interior is needed."""


class Covers(NamedTuple):
    """What a trial's K beams have to cover.

    Attributes
    ----------
    phases
        ``(K, G)`` rad: the full grid of (38f), centred; what is beyond ``reach`` is not looked at.
    reach
        ``(K,)``: grid steps of each beam's own cover on either side.
    ripple
        ``(K,)``: B_k / N.
    """

    phases: Array
    reach: IntArray
    ripple: Array


class Shapes(NamedTuple):
    """The shapes of a trial's K beams on their way, see `Shape`.

    Attributes
    ----------
    basis
        ``(K, r, N)``.
    turns
        ``(K, 2, G)``: cosines and sines of the phases.
    points
        ``(K, m)``: grid points imposed.
    rows, offset, response
        ``(K, n, R)``, ``(K, R)``, ``(K, 2, R)``.
    z
        ``(K, 2 n)``: real parts, then imaginary ones.
    low, high
        ``(K, m)``: multipliers.
    scalars
        ``(K, SCALARS)``.
    spare
        Number of points that may be replaced.
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
    spare: int


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
def set_out(covers: Covers, n_tx: int, chirp: float, warm: ComplexArray) -> Shapes:
    """Return where a trial's shapes start.

    Parameters
    ----------
    covers
        Of the trial.
    n_tx, chirp
        Number of antennas, and rate of the chirp of the start.
    warm
        ``(K, N)`` beams to start from, NaN where there are none, or ``(0, 0)``.
    """
    low, high = _ends(covers)
    nodes = node_count(low, high, n_tx)
    count, spare = point_counts(nodes)
    shapes = _room(covers, n_tx, nodes, count, spare)
    n_objects, size = covers.phases.shape
    own, imposed = np.empty(n_objects), np.empty(count + spare)
    for beam in range(n_objects):
        own[beam] = covers.phases[beam, size // 2]
    for beam in range(n_objects):
        shape = shape_of(shapes, beam)
        basis = beam_basis(beam, own, low[beam], high[beam], nodes, n_tx)
        for direction in range(basis.shape[0]):
            copy_into(shape.basis[direction], basis[direction])
        for point in range(size):
            shapes.turns[beam, 0, point] = np.cos(covers.phases[beam, point])
            shapes.turns[beam, 1, point] = np.sin(covers.phases[beam, point])
        first_points(covers.reach[beam], size // 2, count, shape.points)
        for place in range(imposed.size):
            imposed[place] = covers.phases[beam, shape.points[place]]
        _fill_rows(shape, imposed, own, beam)
        shape.scalars[TARGET] = max(covers.ripple[beam], LEAST_TARGET)
        start_shape(shape, imposed, (own[beam], low[beam], high[beam]), chirp)
        if warm.size:
            keep_warm(shape, warm[beam])
        make_feasible(shape)
    return shapes


@compiled
def _ends(covers: Covers) -> tuple[Array, Array]:
    """Return the least and the largest phase of every cover, ``(K,)`` each."""
    n_objects, size = covers.phases.shape
    centre = size // 2
    low, high = np.empty(n_objects), np.empty(n_objects)
    for beam in range(n_objects):
        low[beam] = high[beam] = covers.phases[beam, centre]
        for point in range(centre - covers.reach[beam], centre + covers.reach[beam] + 1):
            low[beam] = min(low[beam], covers.phases[beam, point])
            high[beam] = max(high[beam], covers.phases[beam, point])
    return low, high


@compiled
def _room(covers: Covers, n_tx: int, nodes: int, count: int, spare: int) -> Shapes:
    """Return shapes that are yet to be filled."""
    n_objects, size = covers.phases.shape
    m, n = count + spare, min(n_tx, n_objects + nodes + 1) - 1
    heard = m + n_objects - 1
    return Shapes(
        basis=np.empty((n_objects, n + 1, n_tx)),
        turns=np.empty((n_objects, 2, size)),
        points=np.empty((n_objects, m), dtype=np.int64),
        rows=np.empty((n_objects, n, heard)),
        offset=np.empty((n_objects, heard)),
        response=np.empty((n_objects, 2, heard)),
        z=np.empty((n_objects, 2 * n)),
        low=np.empty((n_objects, m)),
        high=np.empty((n_objects, m)),
        scalars=np.empty((n_objects, SCALARS)),
        spare=spare,
    )


@compiled
def _fill_rows(shape: Shape, imposed: Array, own: Array, beam: int) -> None:
    """Fill a beam's rows: the points imposed on it, then the other objects."""
    place = 0
    for phase in imposed:
        shape.offset[place] = reduce(shape.basis, phase, shape.rows, place)
        place += 1
    for other in range(own.size):
        if other != beam:
            shape.offset[place] = reduce(shape.basis, own[other], shape.rows, place)
            place += 1


@compiled
def listen(shapes: Shapes, power: Array, leak: Array) -> None:
    """Fill ``(K,)`` powers and ``(K, K)`` leaks of shapes."""
    n_objects, m = shapes.low.shape
    for beam in range(n_objects):
        power[beam] = power_of(shapes.z[beam])
        leak[beam, beam] = 0.0
        row = m
        for other in range(n_objects):
            if other != beam:
                response = shapes.response[beam]
                leak[beam, other] = response[0, row] ** 2 + response[1, row] ** 2
                row += 1


@compiled
def excess_of(
    covers: Covers, shapes: Shapes, beam: int, weights: ComplexArray, excess: Array
) -> float:
    """Fill what a beam misses of its own grid, relative; return the largest."""
    centre, reach = covers.phases.shape[1] // 2, covers.reach[beam]
    turns = shapes.turns[beam, :, centre - reach : centre + reach + 1]
    lift(shapes.basis[beam], shapes.z[beam], weights)
    allowed = shapes.scalars[beam, TARGET] * power_of(shapes.z[beam])
    return relative_excess(turns, weights, allowed, excess[: 2 * reach + 1])
