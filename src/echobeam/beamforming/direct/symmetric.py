"""Factors and solutions of many small symmetric systems at once, the batch on the last axis.

LAPACK factors one matrix after the other and says nothing about inertia; here each elementary
operation runs over the whole batch, and the pivots tell which matrices are positive definite.
"""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, BoolArray

GROWTH = 4.0
"""Factor between the shifts that are tried on a matrix that is not positive definite."""

LEAST_SHIFT = 1e-2
MOST_TRIES = 40

LEAST_PIVOT = 1e-11


def factor(matrix: Array) -> tuple[Array, Array]:
    """Return the upper factor and inverse pivots of U^T diag(1/pivots) U, without pivoting.

    Parameters
    ----------
    matrix
        ``(n, n, S)``, symmetric; only the upper triangle is read.

    Returns
    -------
    upper, inverse
        ``(n, n, S)``, of which the upper triangle counts, with the pivots on its diagonal; and
        ``(n, S)``. A pivot below `LEAST_PIVOT` shows that the matrix is not positive definite.
    """
    upper = matrix.copy()
    size = upper.shape[0]
    inverse = np.empty(upper.shape[1:])
    for row in range(size):
        if row:
            weights = upper[:row, row] * inverse[:row]
            upper[row, row:] -= np.einsum("ks,kjs->js", weights, upper[:row, row:])
        pivot = upper[row, row]
        inverse[row] = 1.0 / np.where(np.abs(pivot) < LEAST_PIVOT, LEAST_PIVOT, pivot)
    return upper, inverse


def positive_definite(upper: Array) -> BoolArray:
    """Tell ``(S,)`` which factored matrices are positive definite."""
    definite: BoolArray = np.min(np.einsum("iis->is", upper), axis=0, initial=np.inf) > LEAST_PIVOT
    return definite


def solve(upper: Array, inverse: Array, right: Array) -> Array:
    """Return the solution ``(n, S)`` of a factored system for a right side ``(n, S)``."""
    solution = right.copy()
    size = solution.shape[0]
    for row in range(size - 1):
        solution[row + 1 :] -= upper[row, row + 1 :] * (solution[row] * inverse[row])
    solution *= inverse
    for row in range(size - 2, -1, -1):
        done = np.einsum("js,js->s", upper[row, row + 1 :], solution[row + 1 :])
        solution[row] -= done * inverse[row]
    return solution


def factor_shifted(matrix: Array, shift: Array) -> tuple[Array, Array]:
    """Factor each matrix plus a multiple of the identity, raised until it is positive definite.

    Parameters
    ----------
    matrix
        ``(n, n, S)``, symmetric; changed in place.
    shift
        ``(S,)``: what to add; changed in place to what was added.
    """
    diagonal = np.arange(matrix.shape[0])
    matrix[diagonal, diagonal] += shift
    upper, inverse = factor(matrix)
    bad = np.flatnonzero(~positive_definite(upper))
    for _ in range(MOST_TRIES):
        if not bad.size:
            break
        raised = np.maximum(GROWTH * shift[bad], LEAST_SHIFT)
        part = matrix[:, :, bad]
        part[diagonal, diagonal] += raised - shift[bad]
        matrix[:, :, bad] = part
        shift[bad] = raised
        upper[:, :, bad], inverse[:, bad] = factor(part)
        bad = bad[~positive_definite(upper[:, :, bad])]
    return upper, inverse
