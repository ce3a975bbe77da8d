from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.relaxation import conic


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
    block = conic.Block(5)
    np.testing.assert_allclose(block.matrix(_triangle(left)), left, atol=1e-15)
    vector = rng.normal(size=5)
    np.testing.assert_allclose(
        block.squares(vector) @ _triangle(left), vector @ left @ vector, rtol=1e-12
    )
    assert block.identity() @ _triangle(left) == pytest.approx(np.trace(left), rel=1e-12)


def test_a_spare_entry_stands_alone_on_the_diagonal() -> None:
    rng = np.random.default_rng(2)
    block = conic.Block(4, spare=True)
    vector = rng.normal(size=block.length)
    full = block.matrix(vector)
    assert block.length == 7
    assert np.all(full[-1, :-1] == 0)
    assert full[-1, -1] == vector[-1]
    steering = rng.normal(size=(3, 4))
    np.testing.assert_allclose(
        block.squares(steering) @ vector, np.sum((steering @ full) * steering, axis=1), rtol=1e-12
    )
    assert block.identity() @ vector == pytest.approx(np.trace(full), rel=1e-12)


def test_power_that_has_to_go_somewhere_goes_to_the_spare_entry() -> None:
    # minimise X_00 with tr X >= 1: all power belongs where it costs nothing.
    block = conic.Block(3, spare=True)
    cost = block.squares(np.array([1.0, 0, 0])) + block.squares(np.array([0, 1.0, 0]))
    programme = conic.Programme(
        blocks=[block],
        cost=[cost],
        most=[-block.identity()[np.newaxis]],
        most_of=-np.ones(1),
        own=[np.zeros((0, block.length))],
    )
    answer = conic.solve(programme)
    assert answer.matrices[0][2, 2] >= 1 - 1e-8
    np.testing.assert_allclose(answer.matrices[0][:2, :2], 0, atol=1e-6)


def test_largest_eigenvalues_of_two_matrices_at_once() -> None:
    rng = np.random.default_rng(1)
    costs = [_symmetric(rng, 4), _symmetric(rng, 6)]
    programme = conic.Programme(
        blocks=[conic.Block(4), conic.Block(6)],
        cost=[-_triangle(cost) for cost in costs],
        most=[
            np.stack([conic.Block(4).identity(), 0 * conic.Block(4).identity()]),
            np.stack([0 * conic.Block(6).identity(), conic.Block(6).identity()]),
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
        blocks=[conic.Block(2)],
        cost=[np.zeros(3)],
        most=[conic.Block(2).identity()[np.newaxis]],
        most_of=np.array([0.4]),
        own=[np.zeros((0, 3))],
        equal=[conic.Block(2).identity()[np.newaxis]],
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
        blocks=[conic.Block(2)],
        cost=[conic.Block(2).identity()],
        most=[np.stack([conic.Block(2).identity(), -conic.Block(2).identity()])],
        most_of=np.array([1.0, -2.0]),
        own=[np.zeros((0, 3))],
    )
    answer = conic.solve(programme)
    assert answer.infeasible
    assert not answer.usable


@pytest.mark.parametrize("size", [np.inf, np.nan, 1e301])
def test_numbers_that_overflow_give_no_answer_and_no_panic(size: float) -> None:
    block = conic.Block(3)
    programme = conic.Programme(
        blocks=[block],
        cost=[-size * block.squares(np.ones(3))],
        most=[block.identity()[np.newaxis]],
        most_of=np.ones(1),
        own=[np.zeros((0, block.length))],
    )
    answer = conic.solve(programme)
    assert not answer.usable or np.isfinite(answer.matrices[0]).all()
    assert not answer.infeasible


def test_a_panic_of_the_solver_is_no_answer_but_ctrl_c_goes_through(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import clarabel

    class PanicException(BaseException):
        pass

    class Panics:
        fault: type[BaseException] = PanicException

        def __init__(self, *_: object) -> None: ...

        def solve(self) -> None:
            raise self.fault

    monkeypatch.setattr(clarabel, "DefaultSolver", Panics)
    block = conic.Block(2)
    programme = conic.Programme(
        blocks=[block],
        cost=[-block.identity()],
        most=[block.identity()[np.newaxis]],
        most_of=np.ones(1),
        own=[np.zeros((0, block.length))],
    )
    assert not conic.solve(programme).usable
    Panics.fault = KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        conic.solve(programme)
