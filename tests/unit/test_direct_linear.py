"""Factors and solutions of small systems against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from ..interpreted import interpreted

linear = interpreted().linear


def _matrix(rng: np.random.Generator, size: int) -> np.ndarray:
    root = rng.standard_normal((size, size))
    return np.asarray(root @ root.T + 0.1 * np.eye(size))


def test_solution_agrees_with_lapack() -> None:
    rng = np.random.default_rng(0)
    for size in range(1, 9):
        matrix, right = _matrix(rng, size), rng.standard_normal(size)
        expected = np.linalg.solve(matrix, right)
        lower, inverse = matrix.copy(), np.empty(size)
        assert linear.factor(lower, inverse)
        linear.solve(lower, inverse, right)
        np.testing.assert_allclose(right, expected, rtol=1e-9, atol=1e-9)


def test_pivots_tell_an_indefinite_matrix_and_a_shift_makes_it_definite() -> None:
    matrix = _matrix(np.random.default_rng(1), 5)
    _, shift = linear.factor_shifted(matrix, np.empty(5), 0.0)
    assert shift == 0.0
    matrix -= 30.0 * np.eye(5)
    assert not linear.factor(matrix.copy(), np.empty(5))
    _, shift = linear.factor_shifted(matrix, np.empty(5), 0.0)
    assert np.linalg.eigvalsh(matrix).min() < 0.0
    assert np.linalg.eigvalsh(matrix + shift * np.eye(5)).min() > 0.0


def test_elimination_agrees_with_lapack() -> None:
    rng = np.random.default_rng(2)
    matrix, right = rng.standard_normal((6, 6)), rng.standard_normal((6, 3))
    expected = np.linalg.solve(matrix, right)
    linear.eliminate(matrix.copy(), right)
    np.testing.assert_allclose(right, expected, rtol=1e-9, atol=1e-9)


def test_the_inverse_tells_whether_the_spectral_radius_is_below_one() -> None:
    rng = np.random.default_rng(3)
    for scale, below in ((0.9, True), (1.1, False)):
        coupling = rng.random((4, 4))
        coupling *= scale / np.abs(np.linalg.eigvals(coupling)).max()
        inverse, positive = linear.inverse_of(np.eye(4) - coupling)
        assert positive == below
        if below:
            np.testing.assert_allclose(inverse, np.linalg.inv(np.eye(4) - coupling), rtol=1e-9)


@pytest.mark.parametrize(("count", "length"), [(3, 8), (8, 8), (9, 5)])
def test_householder_directions_are_orthonormal_and_span_the_rows(count: int, length: int) -> None:
    rows = np.random.default_rng(count).standard_normal((count, length))
    rows[1] = 2.0 * rows[0]  # Dependent rows leave arbitrary directions.
    basis = linear.orthonormal(rows.copy())
    size = min(count, length)
    np.testing.assert_allclose(basis @ basis.T, np.eye(size), atol=1e-13)
    np.testing.assert_allclose((rows[:size] @ basis.T) @ basis, rows[:size], atol=1e-12)


def test_many_equal_rows_leave_numbers() -> None:
    # what is left of each row after those before it is a 1e-16th of it: twenty of them underflow
    rng = np.random.default_rng(3)
    rows = np.repeat(rng.normal(size=(2, 40)), [1, 25], axis=0)
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    basis = linear.orthonormal(rows.copy())
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-12)
    np.testing.assert_allclose((rows @ basis[:2].T) @ basis[:2], rows, atol=1e-12)
