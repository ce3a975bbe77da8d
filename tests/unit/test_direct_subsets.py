from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.direct import batch, solve_batch, subsets
from echobeam.beamforming.direct.found import Found
from echobeam.beamforming.objective import rates
from echobeam.beamforming.power import water_filling
from echobeam.beamforming.problem import ProblemBatch

from ..problems import problem_batch

CLOSE = np.array([60.0, 62.5, 66.0, 69.0, 74.0])


def _batch(angles: np.ndarray, n_tx: int, power: float) -> ProblemBatch:
    count = angles.size
    return problem_batch(
        angles=np.radians(angles)[np.newaxis],
        distances=np.linspace(110.0, 180.0, count)[np.newaxis],
        coverage_halfwidths=np.full((1, count), np.radians(0.5)),
        active=np.ones((1, count), dtype=bool),
        ripple=np.full(count, 0.3 * n_tx),
        min_rate=np.zeros(count),
        power=power,
        noise=1.0,
        n_tx=n_tx,
    )


def _subset(batch: ProblemBatch, members: tuple[int, ...]) -> ProblemBatch:
    active = np.zeros(batch.active.shape, dtype=bool)
    active[:, list(members)] = True
    return replace(batch, active=active)


def test_neighbours_differ_by_one_object_or_one_swap() -> None:
    served = np.array([True, True, False, False])
    found = {tuple(row.tolist()) for row in subsets._neighbours(served)}
    every = [np.array([code >> bit & 1 for bit in range(4)]) > 0 for code in range(1, 16)]
    expected = set()
    for other in every:
        added, removed = np.sum(other & ~served), np.sum(served & ~other)
        if added + removed <= 1 or added == removed == 1:
            expected.add(tuple(other.tolist()))
    assert found == expected


def test_of_the_neighbours_of_one_object_none_is_empty() -> None:
    assert all(row.any() for row in subsets._neighbours(np.array([False, True, False])))


def test_uneven_shares_sum_to_one_and_favour_the_set() -> None:
    shares = subsets._shares(np.array([[True, False, True], [False, True, False]]))
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    assert np.all(shares[0, [0, 2]] > 10.0 * shares[0, 1])


@pytest.mark.slow
@pytest.mark.parametrize(("count", "n_tx"), [(3, 12), (4, 10)])
def test_serving_all_is_no_worse_than_designing_for_any_set_alone(count: int, n_tx: int) -> None:
    batch = _batch(CLOSE[:count], n_tx, 3e4)
    best = solve_batch(batch)
    assert best.converged.all()
    for size in range(1, count):
        for members in combinations(range(count), size):
            alone = solve_batch(_subset(batch, members))
            # What these beams reach for all objects is feasible for the whole problem.
            reached = float(np.sum(rates(batch.problem(0), alone.beams[0])))
            assert best.objective[0] >= reached * (1.0 - 1e-5)


@pytest.mark.slow
def test_adding_dropping_and_swapping_find_what_trying_every_set_finds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for n_tx, power in ((10, 1e4), (12, 3e4), (16, 1e5)):
        batch = _batch(CLOSE, n_tx, power)
        found = solve_batch(batch)
        with monkeypatch.context() as patch:
            patch.setattr(subsets, "FEW", CLOSE.size)
            every = solve_batch(batch)
        assert found.objective[0] >= every.objective[0] * (1.0 - 1e-5)


def test_the_search_ends_where_its_limit_of_work_is_reached(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lost = []
    for n_tx, power in ((10, 1e4), (12, 3e4), (10, 1e5), (12, 1e6)):
        problem = _batch(CLOSE, n_tx, power)
        whole = solve_batch(problem)
        with monkeypatch.context() as patch:
            patch.setattr(batch, "MOST_WORK", 0.0)
            first = solve_batch(problem)
        assert violation(problem.problem(0), first.beams[0]).largest <= 1e-6
        lost.append(1.0 - first.objective[0] / whole.objective[0])
    assert min(lost) >= -1e-12
    assert max(lost) > 1e-3


def test_the_bound_of_a_set_is_that_of_water_filling() -> None:
    rng = np.random.default_rng(4)
    loss = np.exp(rng.uniform(-3.0, 3.0, (50, 3)))
    for row, bound in zip(loss, subsets._most(loss), strict=True):
        powers, _ = water_filling(np.ones(3), row, np.zeros(3))
        assert bound == pytest.approx(np.sum(np.log2(1.0 + powers / row)), rel=1e-12)


def test_every_trial_has_the_work_of_its_own_covers() -> None:
    """A trial's answer does not depend on how wide the covers beside it are."""
    narrow, wide = _batch(CLOSE, 16, 1e5), _batch(CLOSE, 16, 1e5)
    both = replace(
        narrow,
        angles=np.concatenate([narrow.angles, wide.angles]),
        loss=np.concatenate([narrow.loss, wide.loss]),
        active=np.concatenate([narrow.active, wide.active]),
        coverage_halfwidths=np.concatenate(
            [narrow.coverage_halfwidths, 20.0 * wide.coverage_halfwidths]
        ),
    )
    (alone,) = batch._tasks(narrow)
    tasks = {int(trial): task for task in batch._tasks(both) for trial in task.which}
    assert sorted(tasks) == [0, 1]
    assert tasks[0].most_steps == alone.most_steps
    assert tasks[1].most_steps < tasks[0].most_steps


def _found(objective: float, converged: bool, kept: bool = True, factor: float = 1.0) -> Found:
    return Found(
        beams=np.zeros((1, 2, 3), dtype=complex),
        objective=np.array([objective]),
        converged=np.array([converged]),
        proved=np.array([converged]),
        kept=np.array([kept]),
        factor=np.array([factor]),
        iterations=np.array([7]),
        interference_loss=np.zeros(1),
    )


@pytest.mark.parametrize(
    ("old", "new", "better"),
    [
        (_found(4.0, True), _found(6.0, False), True),  # a poor optimum that converged
        (_found(6.0, False), _found(4.0, True), False),
        (_found(6.0, False), _found(6.0 * (1.0 - 1e-7), True), True),  # alike, but converged
        (_found(6.0, True, kept=False), _found(1.0, False), True),
        (_found(6.0, True, factor=0.5), _found(1.0, True, factor=0.6), True),
    ],
)
def test_beams_are_better_that_keep_covers_meet_floors_and_have_the_higher_rate(
    old: Found, new: Found, better: bool
) -> None:
    first = replace(old, objective=old.objective.copy())
    first.put(np.zeros(1, dtype=np.int64), new)
    assert first.objective[0] == (new if better else old).objective[0]


def test_a_set_alone_is_the_problem_of_its_own_objects() -> None:
    problem = _batch(CLOSE, 24, 1e4)
    task = next(batch._tasks(problem))
    (chirp, *_) = batch.chirps(problem.array)
    members = (0, 2, 4)
    alone = task.trials.only(np.zeros(1, dtype=np.int64), np.array([members])).climb(chirp)
    direct = solve_batch(_subset(problem, members))
    assert alone.objective[0] == pytest.approx(direct.objective[0], rel=1e-6)
    among = alone.among(np.array([members]), CLOSE.size)
    power = np.sum(np.abs(among.beams[0]) ** 2, axis=-1)
    assert np.all(power[[1, 3]] == 0.0)
    assert np.all(power[list(members)] > 0.0)
