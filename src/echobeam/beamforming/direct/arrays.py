"""Fills and copies by loops: assignments to slices take Numba long to compile."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.compiling import compiled
from echobeam.values import Array


@compiled
def fill(vector: Array, value: float) -> None:
    """Set every number of a vector."""
    for place in range(vector.size):
        vector[place] = value


@compiled
def copy_into(vector: Array, source: Array) -> None:
    """Set a vector to another one."""
    for place in range(vector.size):
        vector[place] = source[place]


@compiled
def zeros(size: int) -> Array:
    """Return a vector of zeros."""
    vector = np.empty(size)
    fill(vector, 0.0)
    return vector


@compiled
def scaled_identity(size: int, value: float) -> Array:
    """Return a square matrix with a value on its diagonal and zero elsewhere."""
    matrix = np.empty((size, size))
    for row in range(size):
        for column in range(size):
            matrix[row, column] = 0.0
        matrix[row, row] = value
    return matrix


@compiled
def copied(matrix: Array) -> Array:
    """Return a copy of a matrix."""
    rows, columns = matrix.shape
    copy = np.empty((rows, columns))
    for row in range(rows):
        for column in range(columns):
            copy[row, column] = matrix[row, column]
    return copy


@compiled
def turned(matrix: Array) -> Array:
    """Return the transpose, as it lies best for sums over the columns."""
    rows, columns = matrix.shape
    turned = np.empty((columns, rows))
    for row in range(rows):
        for column in range(columns):
            turned[column, row] = matrix[row, column]
    return turned


@compiled
def add_rows(rows: Array, weights: Array, total: Array) -> None:
    """Add sum_r weights_r rows_r to a vector, which may be shorter than the rows.

    Numbers side by side are what vector instructions work on; four rows at a time, since reading
    and writing the vector takes longer than the sums. Each is summed in the order of the rows.
    """
    row, size = 0, total.size
    while row + 4 <= weights.size:
        first, second, third, fourth = rows[row], rows[row + 1], rows[row + 2], rows[row + 3]
        a, b, c, d = weights[row], weights[row + 1], weights[row + 2], weights[row + 3]
        for place in range(size):
            value = total[place]
            value += a * first[place]
            value += b * second[place]
            value += c * third[place]
            value += d * fourth[place]
            total[place] = value
        row += 4
    while row < weights.size:
        line, weight = rows[row], weights[row]
        for place in range(size):
            total[place] += weight * line[place]
        row += 1


@compiled
def fill_block(rows: Array, weights: Array, matrix: Array, begin: int, left: int) -> None:
    """Fill a square block of a matrix, itself symmetric, with sum_r weights_r a_r a_r^T.

    Parameters
    ----------
    rows
        ``(R, n)``: a_r^T.
    weights
        ``(R,)`` or the first of them.
    matrix
        Its block of size n from row ``begin`` and column ``left`` on is filled.
    begin, left
        Place of the block.
    """
    size = rows.shape[1]
    total, scaled = np.empty(size), np.empty(weights.size)
    for first in range(size):
        for row in range(weights.size):
            scaled[row] = weights[row] * rows[row, first]
        fill(total, 0.0)
        add_rows(rows, scaled, total[: first + 1])
        for second in range(first + 1):
            matrix[begin + first, left + second] = total[second]
            matrix[begin + second, left + first] = total[second]
