"""Sigma points: a few points with the mean and covariance of a Gaussian, for any function of it.

The third-degree spherical-radial (cubature) rule: S components give 2 S points of equal weight at
m +- sqrt(S) L_i, L_i the columns of a root of P. It is exact for polynomials up to degree three
(Arasaratnam and Haykin, "Cubature Kalman filters", IEEE Trans. Automatic Control 54, 2009).
"""

from __future__ import annotations

import numpy as np

from echobeam.values import Array

_LOST = 1e-13
"""Share of a variance below which what the components before leave of it is rounding."""


def root(cov: Array) -> Array:
    """Return the lower triangular L of P = L L^T, ``(..., S, S)``.

    A component that is known exactly, or determined by those before it, has a zero on the diagonal
    and a zero column: P may be singular. NaN gives NaN.

    Parameters
    ----------
    cov
        ``(..., S, S)``, symmetric and positive semidefinite: P.
    """
    size = cov.shape[-1]
    L = np.zeros((size, size, *cov.shape[:-2]))
    for j in range(size):
        left = cov[..., j, j] - sum(L[j, k] * L[j, k] for k in range(j))
        regular = ~(left <= _LOST * cov[..., j, j])  # NaN stays
        pivot = np.sqrt(np.where(regular, left, 1.0))
        L[j, j] = np.where(regular, pivot, 0.0)
        for i in range(j + 1, size):
            rest = cov[..., i, j] - sum(L[i, k] * L[j, k] for k in range(j))
            L[i, j] = np.where(regular, rest / pivot, 0.0)
    return np.moveaxis(L, (0, 1), (-2, -1))


def principal_root(cov: Array) -> Array:
    """Return the principal axes of covariances by row, each as long as its deviation.

    Parameters
    ----------
    cov
        ``(..., A, A)`` of one or two components; the longer axis comes first.
    """
    if cov.shape[-1] == 1:
        return np.sqrt(cov)
    a, b, c = cov[..., 0, 0], cov[..., 1, 1], cov[..., 0, 1]
    angle = 0.5 * np.arctan2(2.0 * c, a - b)
    middle, half = 0.5 * (a + b), np.hypot(0.5 * (a - b), c)
    long, short = np.sqrt(middle + half), np.sqrt(np.maximum(middle - half, 0.0))
    x, y = np.cos(angle), np.sin(angle)
    rows = np.stack([long * x, long * y, -short * y, short * x], axis=-1)
    return rows.reshape(cov.shape)


def cubature_points(mean: Array, cov_root: Array) -> Array:
    """Return the points ``(..., 2 S, S)`` of the cubature rule, each of weight 1 / (2 S).

    The first S are m + sqrt(S) L_i, the others m - sqrt(S) L_i in the same order.

    Parameters
    ----------
    mean
        ``(..., S)``: m.
    cov_root
        ``(..., S, S)``: L with P = L L^T.
    """
    columns = np.sqrt(mean.shape[-1]) * np.swapaxes(cov_root, -1, -2)
    centre = mean[..., None, :]
    return np.concatenate([centre + columns, centre - columns], axis=-2)


def moments(deviation: Array) -> tuple[Array, Array]:
    """Return the mean ``(..., M)`` and covariance ``(..., M, M)`` of points of equal weight.

    Parameters
    ----------
    deviation
        ``(..., P, M)``: differences of the points to any one value, angles wrapped; the mean is
        relative to that value.
    """
    count = deviation.shape[-2]
    mean = deviation.sum(axis=-2) / count
    centred = deviation - mean[..., None, :]
    size = deviation.shape[-1]
    cov = np.empty((size, size, *mean.shape[:-1]))
    for i in range(size):
        for j in range(i, size):
            cov[i, j] = cov[j, i] = (centred[..., i] * centred[..., j]).sum(axis=-1) / count
    return mean, np.moveaxis(cov, (0, 1), (-2, -1))
