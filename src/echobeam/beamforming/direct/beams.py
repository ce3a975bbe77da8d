"""Data of one beam: its basis, and steering vectors reduced to it.

A beam matters on the span of the objects' steering vectors, of those on the nodes of its own cover,
and of one spare direction, in which it can have power without being received on the cover.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.compiling import compiled
from echobeam.beamforming.direct.linear import orthonormal
from echobeam.beamforming.direct.steering import fill_steering
from echobeam.values import Array


@compiled
def beam_basis(beam: int, own: Array, nodes: Array, columns: int, n_tx: int) -> Array:
    """Return the orthonormal basis ``(r, N)`` of one beam.

    Parameters
    ----------
    beam
        Index of the beam.
    own
        ``(K, d)`` rad: phases of the objects.
    nodes
        ``(J, d)`` rad: phases of the cover's nodes, and of a direction far off.
    columns, n_tx
        Elements in a row, and N.
    """
    n_objects, n_nodes = own.shape[0], nodes.shape[0]
    vectors = np.empty((n_objects + n_nodes, n_tx))
    fill_steering(own[beam], columns, vectors[0])
    count = 1
    for other in range(n_objects):
        if other != beam:
            fill_steering(own[other], columns, vectors[count])
            count += 1
    for node in range(n_nodes):
        fill_steering(nodes[node], columns, vectors[count + node])
    basis = orthonormal(vectors)
    if vectors[0, 0] < 0.0:
        for antenna in range(n_tx):
            basis[0, antenna] = -basis[0, antenna]
    return basis


@compiled
def reduce(basis: Array, phase: Array, columns: int, rows: Array, row: int) -> float:
    """Fill one row of ``(r - 1, R)`` with a reduced steering vector; return its offset."""
    size, n_tx = basis.shape
    vector = np.empty(n_tx)
    fill_steering(phase, columns, vector)
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
