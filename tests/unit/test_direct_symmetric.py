from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct import symmetric


def _matrices(rng: np.random.Generator, size: int, batch: int) -> np.ndarray:
    root = rng.standard_normal((batch, size, size))
    return np.moveaxis(root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(size), 0, -1)


def test_solution_agrees_with_lapack() -> None:
    rng = np.random.default_rng(0)
    matrix, right = _matrices(rng, 7, 11), rng.standard_normal((7, 11))
    upper, inverse = symmetric.factor(matrix)
    found = symmetric.solve(upper, inverse, right)
    expected = np.linalg.solve(np.moveaxis(matrix, -1, 0), right.T[:, :, None])[:, :, 0].T
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    assert symmetric.positive_definite(upper).all()


def test_pivots_tell_an_indefinite_matrix_and_a_shift_makes_it_definite() -> None:
    rng = np.random.default_rng(1)
    matrix = _matrices(rng, 5, 2)
    matrix[:, :, 1] -= 30.0 * np.eye(5)
    assert symmetric.positive_definite(symmetric.factor(matrix)[0]).tolist() == [True, False]
    shift = np.zeros(2)
    upper, _ = symmetric.factor_shifted(matrix.copy(), shift)
    assert symmetric.positive_definite(upper).all()
    assert shift[0] == 0.0
    assert np.linalg.eigvalsh(matrix[:, :, 1] + shift[1] * np.eye(5)).min() > 0.0
