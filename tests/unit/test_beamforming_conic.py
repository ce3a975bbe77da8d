from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming import conic


def _symmetric(rng: np.random.Generator, size: int) -> np.ndarray:
    half = rng.normal(size=(size, size))
    return half + half.T


def _triangle(symmetric: np.ndarray) -> np.ndarray:
    row, column, weight = conic.triangle(len(symmetric))
    return symmetric[row, column] * weight


def test_triangle_vectors_keep_inner_products_and_come_back() -> None:
    rng = np.random.default_rng(0)
    left, right = _symmetric(rng, 5), _symmetric(rng, 5)
    assert _triangle(left) @ _triangle(right) == pytest.approx(np.trace(left @ right), rel=1e-12)
    np.testing.assert_allclose(conic.matrix(_triangle(left), 5), left, atol=1e-15)
    vector = rng.normal(size=5)
    np.testing.assert_allclose(
        conic.squares(vector) @ _triangle(left), vector @ left @ vector, rtol=1e-12
    )
    assert conic.identity(5) @ _triangle(left) == pytest.approx(np.trace(left), rel=1e-12)


def test_largest_eigenvalues_of_two_matrices_at_once() -> None:
    rng = np.random.default_rng(1)
    costs = [_symmetric(rng, 4), _symmetric(rng, 6)]
    programme = conic.Programme(
        sizes=[4, 6],
        cost=[-_triangle(cost) for cost in costs],
        most=[
            np.stack([conic.identity(4), 0 * conic.identity(4)]),
            np.stack([0 * conic.identity(6), conic.identity(6)]),
        ],
        most_of=np.ones(2),
        own=[np.zeros((0, 10)), np.zeros((0, 21))],
    )
    answer = conic.solve(programme)
    assert answer.usable
    expected = -sum(np.linalg.eigvalsh(cost)[-1] for cost in costs)
    assert answer.objective == pytest.approx(expected, rel=1e-7)
    for cost, found in zip(costs, answer.matrices, strict=True):
        vector = np.linalg.eigh(cost)[1][:, -1]
        np.testing.assert_allclose(found, np.outer(vector, vector), atol=1e-6)


def test_free_scalars_with_curvature_and_equalities() -> None:
    # minimise -z + z^2 / 2 with z = tr X and tr X <= 0.4: z = 0.4.
    programme = conic.Programme(
        sizes=[2],
        cost=[np.zeros(3)],
        most=[conic.identity(2)[np.newaxis]],
        most_of=np.array([0.4]),
        own=[np.zeros((0, 3))],
        equal=[conic.identity(2)[np.newaxis]],
        equal_free=-np.eye(1),
        equal_to=np.zeros(1),
        free_cost=-np.ones(1),
        curvature=np.ones(1),
    )
    answer = conic.solve(programme)
    assert answer.objective == pytest.approx(-0.4 + 0.08, rel=1e-6)
    assert np.trace(answer.matrices[0]) == pytest.approx(0.4, rel=1e-6)


def test_contradictions_are_infeasible() -> None:
    programme = conic.Programme(
        sizes=[2],
        cost=[conic.identity(2)],
        most=[np.stack([conic.identity(2), -conic.identity(2)])],
        most_of=np.array([1.0, -2.0]),
        own=[np.zeros((0, 3))],
    )
    answer = conic.solve(programme)
    assert answer.infeasible
    assert not answer.usable
