"""Shape of one beam on its way: power, responses, slacks; the problem stands in `step`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.beamforming.direct.arrays import fill
from echobeam.beamforming.direct.compiling import compiled
from echobeam.values import Array, IntArray

BARRIER, RIPPLE, TARGET, SHIFT, RESIDUAL, SCALARS = 0, 1, 2, 3, 4, 5
"""Places in `Shape.scalars`, and their number."""


class Shape(NamedTuple):
    """Shape of one beam, with the points imposed on it and its basis.

    A beam of r columns has 2 r real parts: the real and the imaginary ones of its first column,
    then those of the second. Only the first column is received by the own object.

    Attributes
    ----------
    basis
        ``(r, N)``.
    points
        ``(m,)``: grid points imposed.
    rows, offset, response
        ``(n, R)``, ``(R,)``, ``(2 r, R)``.
    z
        ``(2 r n,)``, part after part.
    low, high
        ``(m,)``: multipliers.
    scalars
        ``(SCALARS,)``.
    """

    basis: Array
    points: IntArray
    rows: Array
    offset: Array
    response: Array
    z: Array
    low: Array
    high: Array
    scalars: Array


@compiled
def power_of(z: Array) -> float:
    """Return P = 1 + |z|^2."""
    total = 1.0
    for value in z:
        total += value * value
    return total


@compiled
def respond(rows: Array, z: Array, response: Array) -> None:
    """Fill ``(2 r, R)`` with a^T z."""
    size, count = rows.shape
    for part in range(response.shape[0]):
        line_response = response[part]
        fill(line_response, 0.0)
        for place in range(size):
            line, value = rows[place], z[part * size + place]
            for row in range(count):
                line_response[row] += line[row] * value


@compiled
def respond_from(rows: Array, offset: Array, z: Array, response: Array) -> None:
    """Fill ``(2 r, R)`` with the responses a_0 + a^T z."""
    respond(rows, z, response)
    for row in range(offset.size):
        response[0, row] += offset[row]


@compiled
def slacks(response: Array, allowed: float, below: Array, above: Array) -> float:
    """Fill what is left of (38f) below and above, ``(m,)`` each; return the least."""
    least = np.inf
    fill(above, -1.0)
    for part in range(response.shape[0]):
        line_response = response[part]
        for row in range(above.size):
            above[row] += line_response[row] ** 2
    for row in range(below.size):
        excess = above[row]
        below[row] = allowed + excess
        above[row] = allowed - excess
        least = min(least, below[row], above[row])
    return least


@compiled
def received(response: Array, row: int) -> float:
    """Return |f|^2 of one row, the sum over all parts."""
    total = 0.0
    for part in range(response.shape[0]):
        total += response[part, row] ** 2
    return total
