"""Evolution and its Jacobian against plane geometry, SymPy and complex steps."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from echobeam.tracking.evolution import Evolution, evolution_jacobian, evolve

DOWN = -np.pi / 2
KINDS: list[Evolution] = ["paper", "exact"]


def random_states(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.stack(
        [rng.uniform(0.1, 3.0, n), rng.uniform(20, 200, n), rng.uniform(-40, 40, n)], axis=-1
    )


def moved_in_the_plane(
    state: np.ndarray, speed: float, heading: float, duration: float
) -> np.ndarray:
    """Positions on the road and below the UAV, moved, and turned back into angle and distance."""
    theta, d, v = np.moveaxis(state, -1, 0)
    x = d * np.cos(theta) + (v - speed * np.cos(heading)) * duration
    depth = d * np.sin(theta) + speed * np.sin(heading) * duration
    return np.stack([np.arctan2(depth, x), np.hypot(depth, x), v], axis=-1)


def exact_by_continuation(
    state: np.ndarray, speed: float, heading: float, duration: float
) -> np.ndarray:
    """The same map in functions that are analytic, for complex steps; depth positive."""
    theta, d, v = np.moveaxis(state, -1, 0)
    x = d * np.cos(theta) + (v - speed * np.cos(heading)) * duration
    depth = d * np.sin(theta) + speed * np.sin(heading) * duration
    return np.stack([np.pi / 2 - np.arctan(x / depth), np.sqrt(x * x + depth * depth), v], axis=-1)


@pytest.mark.parametrize("heading", [DOWN, np.pi, 0.3, np.pi / 2])
def test_exact_evolution_is_motion_in_the_plane(heading: float) -> None:
    state = random_states(np.random.default_rng(1), 200)
    expected = moved_in_the_plane(state, 15.0, heading, 0.05)
    result = evolve(state, 15.0, heading, 0.05, "exact")
    above = expected[:, 0] > 0  # the UAV has not gone below the road
    np.testing.assert_allclose(result[above], expected[above], rtol=1e-12)
    assert above.sum() > 150


def test_paper_evolution_is_its_first_order() -> None:
    state = random_states(np.random.default_rng(2), 200)
    errors = []
    for duration in (0.01, 0.001):
        paper, exact = (evolve(state, 15.0, DOWN, duration, kind) for kind in KINDS)
        errors.append(np.max(np.abs(paper - exact), axis=0))
    np.testing.assert_allclose(errors[0][0] / errors[1][0], 1e3, rtol=0.15)  # q^3 in the angle
    np.testing.assert_allclose(errors[0][1] / errors[1][1], 1e2, rtol=0.05)  # q^2 in the distance


def test_paper_evolution_misses_half_q_squared_over_the_distance() -> None:
    theta, d, v, duration = 1.0, 100.0, 30.0, 0.01
    state = np.array([theta, d, v])
    down, along = -15.0 * duration, v * duration
    q = along * np.sin(theta) - down * np.cos(theta)
    missing = evolve(state, 15.0, DOWN, duration, "exact") - evolve(state, 15.0, DOWN, duration)
    assert missing[1] == pytest.approx(q * q / (2 * d), rel=0.01)


def test_open_loop_error_in_the_papers_own_example_is_minimal() -> None:
    # Fig. 5: 40 slots of 50 ms at h = 60 m; the ledger's figures for the corrected model.
    state = truth = np.array([np.pi / 4, 60 * np.sqrt(2), 30.0])
    worst = np.zeros(3)
    for _ in range(40):
        state = evolve(state, 15.0, np.pi, 0.05)
        truth = moved_in_the_plane(truth, 15.0, np.pi, 0.05)
        worst = np.maximum(worst, np.abs(state - truth))
    assert np.degrees(worst[0]) == pytest.approx(0.0198, abs=1e-4)
    assert worst[1] == pytest.approx(0.243, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_moves_when_the_velocities_are_equal(kind: Evolution) -> None:
    state = np.array([1.2, 90.0, 20.0])
    np.testing.assert_allclose(evolve(state, 20.0, 0.0, 0.01, kind), state, rtol=1e-15)


def test_object_under_the_uav_keeps_its_angle_when_the_uav_sinks() -> None:
    state = np.array([np.pi / 2, 100.0, 0.0])
    for kind in KINDS:
        np.testing.assert_allclose(evolve(state, 15.0, DOWN, 0.01, kind), [np.pi / 2, 99.85, 0.0])


@pytest.mark.parametrize("kind", KINDS)
def test_an_unknown_state_stays_unknown_beside_known_ones(kind: Evolution) -> None:
    state = np.array([[1.2, 90.0, 20.0], [np.nan] * 3])
    alone = evolve(state[:1], 15.0, DOWN, 0.01, kind)
    both = evolve(state, 15.0, DOWN, 0.01, kind)
    assert np.array_equal(both[:1], alone)
    assert np.isnan(both[1]).all()
    assert np.isnan(evolution_jacobian(state, 15.0, DOWN, 0.01, kind)[1, 0, 0])


def test_motion_of_the_uav_may_differ_along_leading_axes() -> None:
    state = random_states(np.random.default_rng(3), 6).reshape(3, 2, 3)
    speed, heading = np.array([[0.0], [8.0], [15.0]]), np.array([[0.1], [-0.5], [DOWN]])
    for kind in KINDS:
        together = evolve(state, speed, heading, 0.01, kind)
        jacobians = evolution_jacobian(state, speed, heading, 0.01, kind)
        for i in range(3):
            motion = float(speed[i, 0]), float(heading[i, 0]), 0.01, kind
            np.testing.assert_allclose(together[i], evolve(state[i], *motion), rtol=1e-15)
            np.testing.assert_allclose(jacobians[i], evolution_jacobian(state[i], *motion))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("heading", [DOWN, np.pi, 0.7])
def test_jacobian_agrees_with_complex_steps(kind: Evolution, heading: float) -> None:
    state = random_states(np.random.default_rng(4), 100)
    state[:, 0] = state[:, 0].clip(0.3, 2.8)
    step = 1e-30
    derivative = np.empty((100, 3, 3))
    for j in range(3):
        moved = state + 1j * step * np.eye(3)[j]
        value = (
            evolve(moved, 15.0, heading, 0.05)
            if kind == "paper"
            else exact_by_continuation(moved, 15.0, heading, 0.05)
        )
        derivative[..., j] = value.imag / step
    jacobian = evolution_jacobian(state, 15.0, heading, 0.05, kind)
    np.testing.assert_allclose(jacobian, derivative, rtol=1e-12, atol=1e-13)


@pytest.mark.slow
def test_first_row_is_as_printed_and_the_second_is_corrected() -> None:
    theta, d, v, u, heading, T = sympy.symbols("theta d v u heading T", real=True)
    down, along = u * sympy.sin(heading) * T, v * T - u * sympy.cos(heading) * T
    p = down * sympy.sin(theta) + along * sympy.cos(theta)
    q = along * sympy.sin(theta) - down * sympy.cos(theta)
    derived = sympy.Matrix([theta - q / (d + p), d + p, v]).jacobian([theta, d, v])
    printed = sympy.Matrix(
        [
            [
                1 - (p * d + down**2 + along**2) / (d + p) ** 2,
                q / (d + p) ** 2,
                -(d * sympy.sin(theta) + down) * T / (d + p) ** 2,
            ],
            [u * T * sympy.sin(heading) * sympy.cos(theta), 1, T * sympy.cos(theta)],
            [0, 0, 1],
        ]
    )
    difference = (derived - printed).applyfunc(sympy.simplify)
    missing = sympy.zeros(3, 3)
    missing[1, 0] = -along * sympy.sin(theta)  # Eq. (42) as printed lacks this
    assert (difference - missing).applyfunc(sympy.simplify) == sympy.zeros(3, 3)
    at = {theta: 1.1, d: 95.0, v: 22.0, u: 15.0, heading: -1.3, T: 0.02}
    expected = np.array(derived.subs(at).evalf(20).tolist(), dtype=float)
    ours = evolution_jacobian(np.array([1.1, 95.0, 22.0]), 15.0, -1.3, 0.02)
    np.testing.assert_allclose(ours, expected, rtol=1e-13, atol=1e-16)
