"""The Newton step's derivatives against complex steps through the Lagrangian, written down anew."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..interpreted import interpreted

direct = interpreted()
step, shape = direct.step, direct.shape

ROWS, COVER, SIZE = 7, 5, 4
STEP = 1e-30
SEEDS = range(3)


def _shape(seed: int) -> Any:
    rng = np.random.default_rng(seed)
    scalars = np.zeros(shape.SCALARS)
    scalars[[shape.BARRIER, shape.RIPPLE, shape.TARGET]] = 0.1, 2.0, 2.0
    made = shape.Shape(
        basis=np.zeros((SIZE + 1, 2)),
        points=np.zeros(COVER, dtype=np.int64),
        rows=0.4 * rng.standard_normal((SIZE, ROWS)),
        offset=0.8 + 0.2 * rng.random(ROWS),
        response=np.zeros((2, ROWS)),
        z=0.3 * rng.standard_normal(2 * SIZE),
        low=rng.random(COVER),
        high=rng.random(COVER),
        scalars=scalars,
    )
    shape.respond_from(made.rows, made.offset, made.z, made.response)
    return made


def _weight(seed: int) -> np.ndarray:
    return np.asarray(np.random.default_rng(100 + seed).random(ROWS - COVER))


def _slacks(made: Any) -> tuple[np.ndarray, np.ndarray]:
    below, above = np.empty(COVER), np.empty(COVER)
    allowed = made.scalars[shape.RIPPLE] * shape.power_of(made.z)
    shape.slacks(made.response, allowed, below, above)
    return below, above


def _squares(made: Any, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return |f|^2 at all rows and P, for coordinates that may be complex for their derivative."""
    real = z[:SIZE] @ made.rows + made.offset
    imaginary = z[SIZE:] @ made.rows
    return real**2 + imaginary**2, 1.0 + np.sum(z**2)


def _lagrangian(made: Any, weight: np.ndarray, z: np.ndarray) -> np.ndarray:
    squares, power = _squares(made, z)
    excess, allowed = squares[:COVER] - 1.0, made.scalars[shape.RIPPLE] * power
    cost = power + np.sum(weight * squares[COVER:])
    return np.asarray(
        cost - np.sum(made.low * (allowed + excess)) - np.sum(made.high * (allowed - excess))
    )


def _barrier_function(made: Any, weight: np.ndarray, z: np.ndarray) -> np.ndarray:
    squares, power = _squares(made, z)
    excess, allowed = squares[:COVER] - 1.0, made.scalars[shape.RIPPLE] * power
    cost = power + np.sum(weight * squares[COVER:])
    logs = np.sum(np.log(allowed + excess) + np.log(allowed - excess))
    return np.asarray(cost - made.scalars[shape.BARRIER] * logs)


def _gradient(function: Any, made: Any, weight: np.ndarray, z: np.ndarray) -> np.ndarray:
    steps = z + 1j * STEP * np.eye(z.size)
    return np.array([function(made, weight, at).imag for at in steps]) / STEP


def test_pull_is_the_gradient_of_the_lagrangian() -> None:
    for seed in SEEDS:
        made, weight = _shape(seed), _weight(seed)
        bend, spread = step.bends(made.low, made.high, weight, made.scalars[shape.RIPPLE])
        pull = step._pull(made.rows.T.copy(), made.response, bend, spread, made.z)
        expected = _gradient(_lagrangian, made, weight, made.z)
        np.testing.assert_allclose(pull, expected, rtol=1e-12, atol=1e-12)


def test_on_the_central_path_the_newton_matrix_is_the_hessian_of_the_barrier_function() -> None:
    for seed in SEEDS:
        made, weight = _shape(seed), _weight(seed)
        below, above = _slacks(made)
        assert min(below.min(), above.min()) > 0.0
        made.low[:], made.high[:] = (
            made.scalars[shape.BARRIER] / below,
            made.scalars[shape.BARRIER] / above,
        )
        ripple = made.scalars[shape.RIPPLE]
        bend, spread = step.bends(made.low, made.high, weight, ripple)
        stiff = made.low / below, made.high / above
        lower = np.tril(
            step._matrix(made.rows.T.copy(), made.response, made.z, bend, spread, ripple, *stiff)
        )
        expected = np.zeros((2 * SIZE, 2 * SIZE))
        for column in range(2 * SIZE):
            for sign in (1.0, -1.0):
                moved = made.z.copy()
                moved[column] += sign * 1e-6
                slope = _gradient(_barrier_function, made, weight, moved)
                expected[:, column] += sign * slope / 2e-6
        found = lower + np.tril(lower, -1).T
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


def test_a_step_stays_feasible_and_keeps_its_books() -> None:
    for seed in SEEDS:
        made, weight = _shape(seed), _weight(seed)
        for _ in range(15):
            step.step(made, weight)
            below, above = _slacks(made)
            assert min(below.min(), above.min()) > 0.0
        carried = made.response.copy()
        shape.respond_from(made.rows, made.offset, made.z, made.response)
        np.testing.assert_allclose(carried, made.response, atol=1e-12)


def test_steps_end_where_the_lagrangian_is_flat() -> None:
    for seed in SEEDS:
        made, weight = _shape(seed), _weight(seed)
        for _ in range(60):
            step.step(made, weight)
        assert np.max(np.abs(_gradient(_lagrangian, made, weight, made.z))) < 1e-6
        below, above = _slacks(made)
        assert np.max(made.low * below) < 1e-7
        assert np.max(made.high * above) < 1e-7
