"""Beams that are given to start from: the answer is never worse than they are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.design import design_batch, design_beams
from echobeam.beamforming.methods import Method
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.proposal import Proposal

CLOSE = BeamProblem(
    angles=np.radians([60.0, 62.0]),
    distances=[115.47, 113.257],
    coverage_halfwidths=np.radians([1.0, 1.0]),
    ripple=3.0,
    min_rate=0.0,
    power=1e6,
    noise=1.0,
    n_tx=30,
)
FOUR = BeamProblem(
    angles=np.radians([60.38986722550119, 60.4542989248572, 61.583678661051604, 62.21609429347459]),
    distances=100.0
    / np.sin(
        np.radians([60.38986722550119, 60.4542989248572, 61.583678661051604, 62.21609429347459])
    ),
    coverage_halfwidths=np.radians(np.full(4, 0.3)),
    ripple=0.6,
    min_rate=0.0,
    power=29712.493,
    noise=1.0,
    n_tx=30,
)


def warm(problem: BeamProblem, beams: np.ndarray) -> BeamProblem:
    return BeamProblem(
        angles=problem.angles,
        distances=problem.distances,
        coverage_halfwidths=problem.coverage_halfwidths,
        ripple=problem.ripple,
        min_rate=problem.min_rate,
        power=problem.power,
        noise=problem.noise,
        array=problem.array,
        warm_start=beams,
    )


def drawn(seed: int) -> BeamProblem:
    rng = np.random.default_rng(seed)
    count, n_tx = int(rng.integers(2, 6)), int(rng.integers(8, 33))
    angles = np.radians(60.0 + rng.uniform(-8.0, 8.0, count))
    return BeamProblem(
        angles=angles,
        distances=100.0 / np.sin(angles),
        coverage_halfwidths=np.radians(rng.uniform(0.0, 2.0, count)),
        ripple=0.1 * n_tx,
        min_rate=0.0,
        power=10.0 ** rng.uniform(2.0, 6.0),
        noise=1.0,
        n_tx=n_tx,
    )


def test_a_start_from_the_answer_keeps_it() -> None:
    """Close objects at high power: a start that does not ask whom to serve loses a quarter."""
    cold = design_beams(CLOSE)
    again = design_beams(warm(CLOSE, cold.beams))
    assert again.objective == pytest.approx(cold.objective, rel=1e-12)


def test_of_four_objects_the_best_set_is_served() -> None:
    """Serving one of them is best, 6.14505 bit/s/Hz; at most 6.1455 was proved."""
    assert 6.14505 <= design_beams(FOUR).objective <= 6.1455


@pytest.mark.parametrize(("first", "second"), [(60.0, 60.0), (60.0, 120.0)])
def test_of_two_objects_in_one_direction_one_gets_all_power(first: float, second: float) -> None:
    answer = design_beams(
        BeamProblem(
            angles=np.radians([first, second]),
            distances=[115.47, 115.47],
            coverage_halfwidths=[0.0, 0.0],
            ripple=3.0,
            min_rate=0.0,
            power=5.0,
            noise=1.0,
            n_tx=30,
        )
    )
    best = math.log2(1.0 + 30.0 * 5.0 / 115.47**2)
    assert answer.objective == pytest.approx(best, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_no_answer_is_worse_than_the_beams_given(seed: int) -> None:
    problem = drawn(seed)
    cold = design_beams(problem)
    rng = np.random.default_rng(1000 + seed)
    for spread in (0.0, 1e-3, 0.1):
        noise = rng.standard_normal(cold.beams.shape) + 1j * rng.standard_normal(cold.beams.shape)
        given = cold.beams * (1.0 + spread * noise)
        given *= math.sqrt(problem.power / max(np.sum(np.abs(given) ** 2), problem.power))
        answer = design_beams(warm(problem, given))
        assert answer.max_violation.largest <= 1e-7
        if violation(problem, given).largest <= 1e-9:
            assert answer.objective >= float(np.sum(rates(problem, given))) * (1.0 - 1e-9)


def worst(problem: BeamProblem) -> Proposal:
    """A solver that finds feasible beams which are hardly worth anything."""
    beams = np.zeros((problem.n_objects, problem.n_tx), dtype=complex)
    beams[:, 0] = 1e-3
    return Proposal(beams, Proof(np.inf), "converged", "", 1)


def test_beams_given_stand_where_a_search_finds_nothing_better(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cold = design_beams(CLOSE)
    monkeypatch.setattr(Method, "solver", lambda method: worst)
    answer = design_beams(warm(CLOSE, cold.beams))
    np.testing.assert_array_equal(answer.beams, cold.beams)
    assert answer.objective == pytest.approx(cold.objective, rel=1e-12)
    assert answer.outcome == "unproved"
    assert (
        answer.message == "no search found beams better than those that it was given to start from"
    )
    strong = design_beams(warm(CLOSE, 1.1 * cold.beams))  # more than all the power: not feasible
    assert strong.objective < 0.1 * cold.objective


def test_the_same_holds_for_a_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    cold = design_beams(CLOSE)
    batch = warm(CLOSE, cold.beams).batch()
    batch = replace(
        batch,
        angles=np.repeat(batch.angles, 2, axis=0),
        loss=np.repeat(batch.loss, 2, axis=0),
        coverage_halfwidths=np.repeat(batch.coverage_halfwidths, 2, axis=0),
        active=np.repeat(batch.active, 2, axis=0),
        warm_start=np.stack([cold.beams, np.full_like(cold.beams, np.nan)]),
    )
    monkeypatch.setattr(Method, "solver", lambda method: worst)
    answer = design_batch(batch, "sdp")
    np.testing.assert_array_equal(answer.beams[0], cold.beams)
    assert answer.objective[0] == pytest.approx(cold.objective, rel=1e-12)
    assert answer.objective[1] < 0.1 * cold.objective
