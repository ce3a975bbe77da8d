"""Factors and solutions of small dense systems.

LAPACK says nothing about inertia; here the pivots tell which matrices are positive definite.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.arrays import copied, fill, scaled_identity
from echobeam.beamforming.direct.compiling import compiled
from echobeam.values import Array

GROWTH = 4.0
"""Factor between the shifts that are tried on a matrix that is not positive definite."""

LEAST_SHIFT = 1e-2

MOST_TRIES = 40

LEAST_PIVOT = 1e-11

DEPENDENT = 1e-24
"""Square of what is left of a unit vector that depends on those before; the inverse of still less,
after many equal vectors, is no number."""


@compiled
def factor(matrix: Array, inverse: Array) -> bool:
    """Factor a symmetric matrix as L diag(1/inverse) L^T in place; return whether it is definite.

    Products of contiguous rows are what vector instructions are good at, hence the lower triangle.

    Parameters
    ----------
    matrix
        ``(n, n)``: its lower triangle, but for the diagonal, is replaced by the unit factor.
    inverse
        ``(n,)``: filled with the inverse pivots.
    """
    size = inverse.size
    scaled = np.empty(size)
    for row in range(size):
        line = matrix[row]
        for column in range(row):
            other = matrix[column]
            value = line[column]
            for place in range(column):
                value -= scaled[place] * other[place]
            scaled[column] = value
        pivot = line[row]
        for place in range(row):
            line[place] = scaled[place] * inverse[place]
            pivot -= scaled[place] * line[place]
        if not pivot > LEAST_PIVOT:
            return False
        inverse[row] = 1.0 / pivot
    return True


@compiled
def solve(lower: Array, inverse: Array, right: Array) -> None:
    """Replace a right side ``(n,)`` by the solution of a factored system."""
    size = inverse.size
    for row in range(size):
        line = lower[row]
        value = right[row]
        for place in range(row):
            value -= line[place] * right[place]
        right[row] = value
    for row in range(size):
        right[row] *= inverse[row]
    for row in range(size - 1, 0, -1):
        line = lower[row]
        value = right[row]
        for place in range(row):
            right[place] -= line[place] * value


@compiled
def factor_shifted(matrix: Array, inverse: Array, shift: float) -> tuple[Array, float]:
    """Factor a matrix plus a multiple of the identity, raised until it is positive definite."""
    size = inverse.size
    lower = copied(matrix)
    for _ in range(MOST_TRIES):
        for row in range(size):
            lower[row, row] += shift
        if factor(lower, inverse):
            break
        shift = max(GROWTH * shift, LEAST_SHIFT)
        lower = copied(matrix)
    return lower, shift


@compiled
def inverse_of(matrix: Array) -> tuple[Array, bool]:
    """Return the inverse of 1 - A, A >= 0, and whether A's radius is below 1."""
    size = matrix.shape[0]
    work = copied(matrix)
    result = scaled_identity(size, 1.0)
    positive = True
    for row in range(size):
        pivot = work[row, row]
        if not pivot > 0.0:
            positive = False
            pivot = 1.0
        for column in range(size):
            work[row, column] /= pivot
            result[row, column] /= pivot
        for other in range(size):
            weight = work[other, row]
            if other != row and weight != 0.0:
                for column in range(size):
                    work[other, column] -= weight * work[row, column]
                    result[other, column] -= weight * result[row, column]
    return result, positive


@compiled
def eliminate(matrix: Array, right: Array) -> None:
    """Replace right sides ``(n, J)`` by the solutions of a system; the matrix is used up."""
    size = matrix.shape[0]
    for row in range(size):
        best = row
        for other in range(row + 1, size):
            if abs(matrix[other, row]) > abs(matrix[best, row]):
                best = other
        for column in range(size):
            matrix[row, column], matrix[best, column] = matrix[best, column], matrix[row, column]
        for column in range(right.shape[1]):
            right[row, column], right[best, column] = right[best, column], right[row, column]
        for other in range(row + 1, size):
            weight = matrix[other, row] / matrix[row, row]
            for column in range(row, size):
                matrix[other, column] -= weight * matrix[row, column]
            for column in range(right.shape[1]):
                right[other, column] -= weight * right[row, column]
    for row in range(size - 1, -1, -1):
        for column in range(right.shape[1]):
            value = right[row, column]
            for other in range(row + 1, size):
                value -= matrix[row, other] * right[other, column]
            right[row, column] = value / matrix[row, row]


@compiled
def orthonormal(vectors: Array) -> Array:
    """Return ``(r, N)`` orthonormal rows, r = min(J, N), by Householder reflections.

    The first ones span the first rows of ``vectors``, ``(J, N)``; rows that depend on those before
    leave arbitrary directions. The vectors are used up; [0, 0] is left with the product of the
    first vector and the first row returned.
    """
    count, length = vectors.shape
    size = min(count, length)
    weights = np.empty(size)
    head = 0.0
    for row in range(size):
        norm = 0.0
        for place in range(row, length):
            norm += vectors[row, place] ** 2
        norm = -np.copysign(np.sqrt(norm), vectors[row, row])
        if row == 0:
            head = norm
        vectors[row, row] -= norm
        total = 0.0
        for place in range(row, length):
            total += vectors[row, place] ** 2
        weights[row] = 2.0 / total if total > DEPENDENT else 0.0
        for other in range(row + 1, count):
            _reflect(vectors[row], weights[row], row, vectors[other])
    basis = np.empty((size, length))
    for direction in range(size):
        fill(basis[direction], 0.0)
        basis[direction, direction] = 1.0
        for row in range(direction, -1, -1):
            _reflect(vectors[row], weights[row], row, basis[direction])
    vectors[0, 0] = head
    return basis


@compiled
def _reflect(normal: Array, weight: float, first: int, vector: Array) -> None:
    product = 0.0
    for place in range(first, vector.size):
        product += normal[place] * vector[place]
    product *= weight
    for place in range(first, vector.size):
        vector[place] -= product * normal[place]
