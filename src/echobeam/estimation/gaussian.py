"""The algebra of a Gaussian belief: propagate it, update it, wrap its angles.

A covariance is taken apart into its components, each an array over the whole batch (``...``), and
put together again. A stack of a thousand 3 x 3 matrices then costs a few hundred array operations
instead of a thousand small factorisations, only the upper triangle is computed (so the result is
symmetric by construction), and no number depends on how many others share the batch: only
elementwise operations occur, in a fixed order.

The arrays that come back keep this component-first order in memory and show the matrix axes last;
the next step then reads its components from contiguous memory.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from math import log, pi
from operator import add
from typing import NamedTuple

import numpy as np

from echobeam.values import Array, BoolArray

_HALF_LOG_TWO_PI = 0.5 * log(2.0 * pi)

Vector = Sequence[Array]
"""Components of a vector, each ``(...)``."""

Symmetric = Sequence[Sequence[Array]]
"""Components of a symmetric matrix, each ``(...)``; ``P[i][j]`` and ``P[j][i]`` are one array."""

Row = Mapping[int, Array]
"""Components ``(...)`` of a row by column, without those that are zero for the whole batch."""


def propagate(cov: Array, G: Array, Q: Array) -> Array:
    """Return the covariance after a linear step with noise, G P G^T + Q, Eq. (46).

    Parameters
    ----------
    cov
        ``(..., S, S)``, symmetric: P.
    G
        ``(..., S, S)``: Jacobian of the step.
    Q
        ``(S, S)`` or ``(..., S, S)``, symmetric: covariance of the process noise.
    """
    size = cov.shape[-1]
    P = _components(cov)
    rows = _rows(G)
    result = np.empty((size, size, *cov.shape[:-2]))
    for i in range(size):
        GP = [_dot(rows[i], column) for column in P]
        for j in range(i, size):
            result[i, j] = result[j, i] = _dot(rows[j], GP) + Q[..., i, j]
    return np.moveaxis(result, (0, 1), (-2, -1))


class Fusion(NamedTuple):
    """Belief after a measurement, and how well the measurement fitted the prior.

    ``mean`` ``(..., S)`` and ``cov`` ``(..., S, S)`` are the posterior's; ``innovation_cov``
    ``(..., M, M)`` is H P H^T + R, infinite on the diagonal for a component that does not count;
    ``log_likelihood`` ``(...)`` is the logarithm of the density of those that do.
    """

    mean: Array
    cov: Array
    innovation_cov: Array
    log_likelihood: Array


def update(mean: Array, cov: Array, innovation: Array, H: Array, variance: Array) -> Fusion:
    """Return the belief after a measurement with independent components, Eqs. (47)-(49).

    The components are used one after the other, which is exact because their noises are
    independent. Each meets only its own variance, so seconds and hertz, twenty orders of magnitude
    apart, never share a matrix: the result is that of whitened measurements, and it does not
    change in any bit when the unit of a measurement changes by a power of two. The covariance has
    Joseph's form (I - k h) P (I - k h)^T + k r k^T, which keeps its digits and stays positive
    where (I - k h) P cancels. The density of the measurement is the product of those of its
    components given the ones before.

    Parameters
    ----------
    mean
        ``(..., S)``: prior mean.
    cov
        ``(..., S, S)``, symmetric: prior covariance.
    innovation
        ``(..., M)``: measured minus predicted, angles wrapped by the caller.
    H
        ``(..., M, S)``, finite where the mean is: Jacobian of the measurement.
    variance
        ``(..., M)``, not negative: of the measurement noise. A component of which the variance or
        the innovation is not finite has weight zero and changes nothing.
    """
    used = np.isfinite(variance) & np.isfinite(innovation)
    r = np.where(used, variance, 1.0)
    difference = np.where(used, innovation, 0.0)
    P = _components(cov)
    rows = _rows(H)
    spread = _innovation_cov(P, rows, np.where(used, variance, np.inf))
    shift: Vector = [np.zeros(mean.shape[:-1])] * mean.shape[-1]
    likelihood = np.zeros(mean.shape[:-1])
    for m, h in enumerate(rows):
        step = _use_one(P, shift, h, difference[..., m], r[..., m], used[..., m])
        P, shift, surprise, variance_of_it = step
        log_density = -0.5 * (surprise * surprise / variance_of_it + np.log(variance_of_it))
        likelihood += np.where(used[..., m], log_density - _HALF_LOG_TWO_PI, 0.0)
    posterior = mean + np.moveaxis(np.stack(shift), 0, -1)
    return Fusion(posterior, _joined(P), spread, likelihood)


def wrap(angle: Array) -> Array:
    """Return the same direction in (-pi, pi]; an angle that lies there keeps every bit."""
    turns = np.ceil((angle - np.pi) / (2.0 * np.pi))
    wrapped: Array = angle - 2.0 * np.pi * turns
    return wrapped


def _innovation_cov(P: Symmetric, rows: Sequence[Row], variance: Array) -> Array:
    """Return H P H^T + R, component-first in memory, from the upper triangle."""
    size = len(rows)
    spread = np.empty((size, size, *P[0][0].shape))
    for i, row in enumerate(rows):
        Ph = [_dot(row, column) for column in P]
        for j in range(i, size):
            spread[i, j] = spread[j, i] = _dot(rows[j], Ph)
        spread[i, i] += variance[..., i]
    return np.moveaxis(spread, (0, 1), (-2, -1))


def _use_one(
    P: Symmetric, shift: Vector, h: Row, innovation: Array, r: Array, used: BoolArray
) -> tuple[Symmetric, Vector, Array, Array]:
    """Use one scalar measurement with row h on the covariance and on the shift of the mean.

    Returns covariance and shift, and the innovation given the components before it with its
    variance.
    """
    Ph = [_dot(h, row) for row in P]
    spread = _dot(h, Ph) + r
    surprise = innovation - _dot(h, shift)
    if not h:
        return P, shift, surprise, spread
    weight = np.where(used, 1.0 / spread, 0.0)
    k = [entry * weight for entry in Ph]
    shift = [moved + gain * surprise for moved, gain in zip(shift, k, strict=True)]
    # First B = (I - k h) P, then B (I - k h)^T + k r k^T = B - (B h - k r) k^T. The bracket is
    # zero but for rounding: it takes back what the subtraction in B lost.
    B = _less_product(P, k, Ph)
    lost = [_dot(h, row) - gain * r for gain, row in zip(k, B, strict=True)]
    return _less_product(B, lost, k), shift, surprise, spread


def _less_product(P: Symmetric, x: Vector, y: Vector) -> Symmetric:
    """Return P - x y^T, which is symmetric, from the upper triangle."""
    size = len(P)
    result = [list(row) for row in P]
    for i in range(size):
        for j in range(i, size):
            result[i][j] = result[j][i] = P[i][j] - x[i] * y[j]
    return result


def _dot(row: Row, vector: Vector) -> Array:
    """Return the product of a sparse row and a vector, summed in the order of the columns."""
    if not row:
        return np.zeros_like(vector[0])
    return reduce(add, [entry * vector[column] for column, entry in row.items()])


def _rows(matrix: Array) -> list[Row]:
    """Take a matrix apart, without what is zero for the whole batch: most of (42), (43) is."""
    somewhere = (matrix != 0.0).any(axis=tuple(range(matrix.ndim - 2)))
    rows, columns = matrix.shape[-2:]
    return [{j: matrix[..., i, j] for j in range(columns) if somewhere[i, j]} for i in range(rows)]


def _components(matrix: Array) -> Symmetric:
    """Take a symmetric matrix apart, reading its upper triangle."""
    size = matrix.shape[-1]
    return [[matrix[..., min(i, j), max(i, j)] for j in range(size)] for i in range(size)]


def _joined(P: Symmetric) -> Array:
    """Put a matrix together: component-first in memory, ``(..., S, S)`` in shape."""
    size = len(P)
    matrix = np.empty((size, size, *P[0][0].shape))
    for i in range(size):
        for j in range(size):
            matrix[i, j] = P[i][j]
    return np.moveaxis(matrix, (0, 1), (-2, -1))
