"""The Newton step's derivatives against complex steps through the Lagrangian, written down anew."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct import barrier
from echobeam.beamforming.direct.barrier import Shapes

ROWS, COVER, SIZE, BATCH = 7, 5, 4, 3
STEP = 1e-30


def _shapes(seed: int = 0) -> Shapes:
    rng = np.random.default_rng(seed)
    shapes = Shapes(
        rows=0.4 * rng.standard_normal((ROWS, SIZE, BATCH)),
        offset=0.8 + 0.2 * rng.random((ROWS, BATCH)),
        target=np.full(BATCH, 2.0),
        ripple=np.full(BATCH, 2.0),
        coordinates=0.3 * rng.standard_normal((2, SIZE, BATCH)),
        response=np.zeros((ROWS, 2, BATCH)),
        low=rng.random((COVER, BATCH)),
        high=rng.random((COVER, BATCH)),
        barrier=np.full(BATCH, 0.1),
        shift=np.zeros(BATCH),
        residual=np.zeros(BATCH),
    )
    barrier.respond(shapes)
    return shapes


def _weight(seed: int = 1) -> np.ndarray:
    return np.asarray(np.random.default_rng(seed).random((ROWS - COVER, BATCH)))


def _squares(shapes: Shapes, beam: int, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return |f|^2 at all rows and P, for coordinates that may be complex for their derivative."""
    real = shapes.rows[..., beam] @ z[:SIZE] + shapes.offset[:, beam]
    imaginary = shapes.rows[..., beam] @ z[SIZE:]
    return real**2 + imaginary**2, 1.0 + np.sum(z**2)


def _lagrangian(shapes: Shapes, weight: np.ndarray, beam: int, z: np.ndarray) -> np.ndarray:
    squares, power = _squares(shapes, beam, z)
    excess, allowed = squares[:COVER] - 1.0, shapes.ripple[beam] * power
    cost = power + np.sum(weight[:, beam] * squares[COVER:])
    below, above = allowed + excess, allowed - excess
    return np.asarray(
        cost - np.sum(shapes.low[:, beam] * below) - np.sum(shapes.high[:, beam] * above)
    )


def _barrier_function(shapes: Shapes, weight: np.ndarray, beam: int, z: np.ndarray) -> np.ndarray:
    squares, power = _squares(shapes, beam, z)
    excess, allowed = squares[:COVER] - 1.0, shapes.ripple[beam] * power
    cost = power + np.sum(weight[:, beam] * squares[COVER:])
    logs = np.sum(np.log(allowed + excess) + np.log(allowed - excess))
    return np.asarray(cost - shapes.barrier[beam] * logs)


def _gradient(function, shapes: Shapes, weight: np.ndarray, beam: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    z = shapes.coordinates[..., beam].reshape(-1)
    steps = z + 1j * STEP * np.eye(z.size)
    return np.array([function(shapes, weight, beam, at).imag for at in steps]) / STEP


def test_pull_is_the_gradient_of_the_lagrangian() -> None:
    shapes, weight = _shapes(), _weight()
    slope = np.concatenate([shapes.high - shapes.low, weight])
    spread = 1.0 - shapes.ripple * np.sum(shapes.low + shapes.high, axis=0)
    pull = barrier._pull(shapes, slope, spread)
    for beam in range(BATCH):
        expected = _gradient(_lagrangian, shapes, weight, beam)
        np.testing.assert_allclose(pull[..., beam].reshape(-1), expected, rtol=1e-12, atol=1e-12)


def test_on_the_central_path_the_newton_matrix_is_the_hessian_of_the_barrier_function() -> None:
    shapes, weight = _shapes(), _weight()
    below, above = barrier.slacks(shapes.response[:COVER], shapes.ripple, shapes.power)
    assert below.min() > 0.0
    assert above.min() > 0.0
    shapes.low, shapes.high = shapes.barrier / below, shapes.barrier / above
    bend = np.concatenate([shapes.high - shapes.low, weight])
    matrix = barrier._matrix(shapes, bend, shapes.low / below, shapes.high / above)
    for beam in range(BATCH):
        found = np.triu(matrix[..., beam])
        found = found + np.triu(found, 1).T
        z = shapes.coordinates[..., beam].copy()
        expected = np.zeros((2 * SIZE, 2 * SIZE))
        for column in range(2 * SIZE):
            for sign in (1.0, -1.0):
                moved = z.reshape(-1).copy()
                moved[column] += sign * 1e-6
                shapes.coordinates[..., beam] = moved.reshape(2, SIZE)
                slope = _gradient(_barrier_function, shapes, weight, beam)
                expected[:, column] += sign * slope / 2e-6
        shapes.coordinates[..., beam] = z
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


def test_curvature_is_that_of_one_part_of_the_lagrangian() -> None:
    shapes, weight = _shapes(), _weight()
    bend = np.concatenate([shapes.high - shapes.low, weight])
    spread = 1.0 - shapes.ripple * np.sum(shapes.low + shapes.high, axis=0)
    form = barrier.curvature(shapes, bend, spread)
    # The Lagrangian is quadratic: its gradient's differences are exact.
    for beam in range(BATCH):
        first = _gradient(_lagrangian, shapes, weight, beam)
        for column in range(SIZE):
            shapes.coordinates[0, column, beam] += 1.0
            change = _gradient(_lagrangian, shapes, weight, beam) - first
            shapes.coordinates[0, column, beam] -= 1.0
            np.testing.assert_allclose(2.0 * form[:, column, beam], change[:SIZE], atol=1e-12)


def test_a_step_stays_feasible_and_keeps_its_books() -> None:
    shapes, weight = _shapes(), _weight()
    for _ in range(15):
        barrier.step(shapes, weight, barrier.LAST_BARRIER)
        below, above = barrier.slacks(shapes.response[:COVER], shapes.ripple, shapes.power)
        assert below.min() > 0.0
        assert above.min() > 0.0
    carried = shapes.response.copy()
    barrier.respond(shapes)
    np.testing.assert_allclose(carried, shapes.response, atol=1e-12)


def test_steps_end_where_the_lagrangian_is_flat() -> None:
    shapes, weight = _shapes(), _weight()
    for _ in range(60):
        barrier.step(shapes, weight, barrier.LAST_BARRIER)
    for beam in range(BATCH):
        assert np.max(np.abs(_gradient(_lagrangian, shapes, weight, beam))) < 1e-6
    below, above = barrier.slacks(shapes.response[:COVER], shapes.ripple, shapes.power)
    assert np.max(shapes.low * below) < 1e-7
    assert np.max(shapes.high * above) < 1e-7
