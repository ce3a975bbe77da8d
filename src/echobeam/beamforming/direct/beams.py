"""Data of one trial's beams: bases, imposed points, reduced steering vectors.

A beam matters on the span of the objects' steering vectors, of those on the nodes of its own cover,
and of one spare direction, in which it can have power without being received on the cover.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct import sizes
from echobeam.beamforming.direct.compiling import compiled
from echobeam.beamforming.direct.linear import orthonormal
from echobeam.beamforming.direct.steering import fill_steering
from echobeam.values import Array, IntArray

cover_nodes = compiled(sizes.node_count)
"""`sizes.node_count`, compiled."""

point_counts = compiled(sizes.point_counts)
"""`sizes.point_counts`, compiled."""


@compiled
def node_count(low: Array, high: Array, n_tx: int) -> int:
    """Return how many nodes stand for the widest of a trial's covers."""
    lobes = 0.0
    for beam in range(low.size):
        lobes = max(lobes, (high[beam] - low[beam]) * n_tx / (2.0 * np.pi))
    return cover_nodes(lobes)


@compiled
def beam_basis(beam: int, own: Array, low: float, high: float, nodes: int, n_tx: int) -> Array:
    """Return the orthonormal basis ``(r, N)`` of one beam."""
    n_objects = own.size
    vectors = np.empty((n_objects + nodes + 1, n_tx))
    fill_steering(own[beam], vectors[0])
    count = 1
    for other in range(n_objects):
        if other != beam:
            fill_steering(own[other], vectors[count])
            count += 1
    first = 0.5 - 0.5 * np.cos(0.5 * np.pi / nodes)
    last = 0.5 - 0.5 * np.cos(np.pi * (nodes - 0.5) / nodes)
    for node in range(nodes):
        site = 0.5 - 0.5 * np.cos(np.pi * (node + 0.5) / nodes)
        site = (site - first) / (last - first)
        fill_steering(low + (high - low) * site, vectors[count + node])
    fill_steering(0.5 * (low + high) + np.pi, vectors[count + nodes])
    basis = orthonormal(vectors)
    if vectors[0, 0] < 0.0:
        for antenna in range(n_tx):
            basis[0, antenna] = -basis[0, antenna]
    return basis


@compiled
def first_points(reach: int, centre: int, count: int, points: IntArray) -> None:
    """Fill ``(m,)`` with the grid points imposed first."""
    for place in range(points.size):
        points[place] = centre
    before = 0
    for place in range(count):
        chosen = int(np.rint(reach * (-1.0 + 2.0 * place / (count - 1))))
        if place == 0 or chosen != before:
            points[place] = centre + chosen
        before = chosen


@compiled
def reduce(basis: Array, phase: float, rows: Array, row: int) -> float:
    """Fill one row of ``(r - 1, R)`` with a reduced steering vector; return its offset."""
    size, n_tx = basis.shape
    vector = np.empty(n_tx)
    fill_steering(phase, vector)
    offset = 0.0
    for direction in range(size):
        line = basis[direction]
        total = 0.0
        for antenna in range(n_tx):
            total += vector[antenna] * line[antenna]
        if direction == 0:
            offset = total
        else:
            rows[direction - 1, row] = total
    return offset
