"""The posterior bound against Kalman filters, a closed form and the recursion as published."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.estimation.bound import posterior_bound

STEP = np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]])


def kalman_covariances(
    P: np.ndarray, G: np.ndarray, Q: np.ndarray, H: np.ndarray, variance: np.ndarray
) -> np.ndarray:
    """Posterior covariances of a linear filter for one object; ``(n, M, S)`` rows."""
    result = []
    for slot in range(H.shape[0]):
        if slot > 0:
            P = G[slot - 1] @ P @ G[slot - 1].T + Q
        measured = np.isfinite(variance[slot])
        if measured.any():
            h = H[slot][measured]
            K = P @ h.T @ np.linalg.inv(h @ P @ h.T + np.diag(variance[slot][measured]))
            P = (np.eye(3) - K @ h) @ P
        result.append(P)
    return np.stack(result)


@pytest.mark.parametrize("noise", [[0.01, 0.02, 0.03], [0.0, 0.0, 0.03], [0.0, 0.0, 0.0]])
def test_bound_of_a_linear_model_is_the_kalman_covariance(noise: list[float]) -> None:
    rng = np.random.default_rng(1)
    Q, P = np.diag(noise), np.diag([1.0, 2.0, 3.0])
    G = np.broadcast_to(STEP, (4, 6, 2, 3, 3))
    H = np.broadcast_to(rng.normal(size=(7, 2, 2, 3)), (4, 7, 2, 2, 3))
    variance = np.broadcast_to(rng.uniform(0.1, 1.0, (7, 2, 2)), (4, 7, 2, 2)).copy()
    variance[:, 3] = np.inf  # a slot without measurement
    variance[:, 5, 0, 1] = np.inf
    information = np.broadcast_to(np.linalg.inv(P), (2, 3, 3))
    bound = posterior_bound(G, Q, H, variance, information)
    for k in range(2):
        expected = kalman_covariances(P, G[0, :, k], Q, H[0, :, k], variance[0, :, k])
        np.testing.assert_allclose(bound[:, k], expected, rtol=1e-10, atol=1e-13)


def test_bound_settles_at_the_root_of_the_riccati_equation() -> None:
    q, r, slots = 0.3, 2.0, 60
    shape = (1, slots, 1, 1, 1)
    G, H, variance = np.ones((1, slots - 1, 1, 1, 1)), np.ones(shape), np.full(shape[:-1], r)
    bound = posterior_bound(G, np.array([[q]]), H, variance)
    assert bound[0, 0, 0, 0] == pytest.approx(r)
    assert bound[-1, 0, 0, 0] == pytest.approx((-q + np.sqrt(q * q + 4 * q * r)) / 2, rel=1e-12)


def test_one_step_is_the_recursion_as_published_when_the_jacobians_scatter() -> None:
    rng = np.random.default_rng(2)
    Q, J = np.diag([0.1, 0.2, 0.3]), np.diag([3.0, 2.0, 1.0])
    G = STEP + 0.2 * rng.normal(size=(50, 1, 1, 3, 3))
    H, variance = rng.normal(size=(50, 2, 1, 2, 3)), rng.uniform(0.5, 1.0, (50, 2, 1, 2))
    variance[:, 0] = np.inf
    bound = posterior_bound(G, Q, H, variance, J[None])[1, 0]
    Q_inv, g = np.linalg.inv(Q), G[:, 0, 0]
    D11 = np.mean([a.T @ Q_inv @ a for a in g], axis=0)
    D12 = -np.mean(g, axis=0).T @ Q_inv
    gained = [h.T @ np.diag(1 / v) @ h for h, v in zip(H[:, 1, 0], variance[:, 1, 0], strict=True)]
    D22 = Q_inv + np.mean(gained, axis=0)
    expected = np.linalg.inv(D22 - D12.T @ np.linalg.inv(J + D11) @ D12)
    np.testing.assert_allclose(bound, expected, rtol=1e-10)


def test_bound_is_infinite_until_the_measurements_determine_the_state() -> None:
    G = np.broadcast_to(STEP, (1, 3, 1, 3, 3))
    H = np.broadcast_to(np.array([[1.0, 0.0, 0.0]]), (1, 4, 1, 1, 3))
    variance = np.ones((1, 4, 1, 1))
    variance[0, 0] = np.inf
    bound = posterior_bound(G, np.diag([0.0, 0.0, 1e-3]), H, variance)
    spread = np.diagonal(bound[:, 0], axis1=-2, axis2=-1)
    assert np.isinf(spread[:3]).all()  # one component measured, three to be known
    assert np.isfinite(bound[3]).all()


def test_an_object_that_was_absent_is_known_anew_from_its_measurements_alone() -> None:
    G = np.broadcast_to(STEP, (2, 3, 1, 3, 3)).copy()
    H = np.broadcast_to(np.diag([1.0, 2.0, 4.0]), (2, 4, 1, 3, 3)).copy()
    G[:, :2], H[:, 1] = np.nan, np.nan  # absent in the second slot
    bound = posterior_bound(G, np.eye(3), H, np.ones((2, 4, 1, 3)))
    first = np.diag([1.0, 0.25, 0.0625])
    np.testing.assert_allclose(bound[0, 0], first)
    assert np.isinf(np.diag(bound[1, 0])).all()
    np.testing.assert_allclose(bound[2, 0], first)
    assert np.all(np.diag(bound[3, 0]) < np.diag(first))
