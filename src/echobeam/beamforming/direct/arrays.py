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
