"""Beam design against other people's solvers: CVXPY on the full problem, linear programmes."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from scipy.optimize import linprog

from echobeam.beamforming.certify.certificate import numerical_rank
from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.problem import BeamProblem
from echobeam.physics.array import LinearArray

# CVXPY calls good solutions of these problems inaccurate; the comparisons judge them.
pytestmark = pytest.mark.filterwarnings("ignore:Solution may be inaccurate")

DEG = np.pi / 180.0

SINGLE = [
    # angle, half-width, ripple, antennas, resolution (degrees)
    (75.0, 10.0, 1.0, 8, 0.5),
    (135.0, 6.0, 0.5, 10, 0.5),
    (60.0, 4.0, 2.0, 16, 0.25),
    (88.0, 16.0, 1.6, 12, 0.5),
    (30.0, 3.0, 0.1, 9, 0.25),
]


def _single(angle: float, halfwidth: float, ripple: float, n_tx: int, resolution: float):
    return BeamProblem(
        [angle * DEG],
        [100.0],
        [halfwidth * DEG],
        ripple,
        0.0,
        1e4,
        1.0,
        n_tx,
        resolution=resolution * DEG,
    )


def _cover(problem: BeamProblem, k: int = 0) -> np.ndarray:
    grid, mask = coverage_grid(problem.angles, problem.coverage_halfwidths, problem.resolution)
    return LinearArray(problem.n_tx).steering(grid[k, mask[k]])


@pytest.mark.parametrize("case", SINGLE)
@pytest.mark.slow
def test_one_object_reaches_the_relaxed_gain_that_cvxpy_finds_on_the_full_problem(case) -> None:
    cp = pytest.importorskip("cvxpy")
    problem = _single(*case)
    own, cover = LinearArray(problem.n_tx).steering(problem.angles)[0], _cover(problem)
    W = cp.Variable((problem.n_tx, problem.n_tx), hermitian=True)
    gain = cp.real(own.conj() @ W @ own)
    pattern = cp.real(cp.sum(cp.multiply(cover.conj(), (W @ cover.T).T), axis=1))
    constraints = [
        W >> 0,
        cp.real(cp.trace(W)) <= 1,
        cp.abs(gain - pattern) <= problem.ripple[0] * cp.real(cp.trace(W)),
    ]
    stated = cp.Problem(cp.Maximize(gain), constraints)
    stated.solve(solver="CLARABEL", tol_gap_rel=1e-9, tol_feas=1e-9, tol_gap_abs=1e-9)
    assert stated.status in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)
    answer = design_beams(problem)
    relaxed = np.log2(1 + float(gain.value))
    assert answer.status == "optimal"
    assert answer.objective == pytest.approx(relaxed, rel=2e-6)
    assert answer.gap <= 1e-7
    assert answer.max_violation.largest <= 1e-6


@pytest.mark.parametrize("case", SINGLE)
def test_one_object_agrees_with_a_linear_programme_over_the_patterns_coefficients(case) -> None:
    # The pattern is a trigonometric polynomial r_0 + 2 Re sum r_l exp(-j l phase) with r_0 = 1;
    # asking it to be non-negative on a grid only is a relaxation, tight as the grid gets finer.
    problem = _single(*case)
    lags = np.arange(1, problem.n_tx)

    def rows(phases: np.ndarray) -> np.ndarray:
        argument = np.outer(phases, lags)
        return np.hstack([2 * np.cos(argument), 2 * np.sin(argument)])

    grid, mask = coverage_grid(problem.angles, problem.coverage_halfwidths, problem.resolution)
    own = rows(np.pi * np.sin(problem.angles))[0]
    difference = own - rows(np.pi * np.sin(grid[0, mask[0]]))
    circle = rows(np.linspace(0, 2 * np.pi, 64 * problem.n_tx, endpoint=False))
    found = linprog(
        -own,
        A_ub=np.vstack([difference, -difference, -circle]),
        b_ub=np.concatenate(
            [np.full(2 * len(difference), problem.ripple[0]), np.ones(len(circle))]
        ),
        bounds=(None, None),
    )
    assert found.status == 0
    linear = np.log2(1 + 1.0 - found.fun)
    answer = design_beams(problem)
    assert answer.objective <= linear * (1 + 1e-9)
    assert answer.objective >= linear * (1 - 2e-3)


def _pair(**changes: object) -> BeamProblem:
    values: dict[str, object] = {
        "angles": np.array([75.0, 135.0]) * DEG,
        "distances": np.array([103.0, 141.0]),
        "coverage_halfwidths": np.array([8.0, 6.0]) * DEG,
        "ripple": np.array([1.0, 0.8]),
        "min_rate": 0.0,
        "power": 1e4,
        "noise": 1.0,
        "n_tx": 8,
        "resolution": 1.0 * DEG,
    }
    return BeamProblem(**{**values, **changes})  # type: ignore[arg-type]


def _cvxpy_power(problem: BeamProblem, rates: np.ndarray) -> float:
    """Least power, in units of P_T, with which CVXPY meets given rates on the full problem."""
    cp = pytest.importorskip("cvxpy")
    n_tx, count = problem.n_tx, problem.n_objects
    steering = LinearArray(n_tx).steering(problem.angles)
    loss = problem.noise * problem.distances**2 / problem.power
    W = [cp.Variable((n_tx, n_tx), hermitian=True) for _ in range(count)]
    gain = [[cp.real(a.conj() @ V @ a) for V in W] for a in steering]
    constraints = [V >> 0 for V in W]
    for k in range(count):
        foreign = sum(gain[k]) - gain[k][k]
        need = 2.0 ** rates[k] - 1
        constraints.append(gain[k][k] / loss[k] >= need * (foreign / loss[k] + 1))
        cover = _cover(problem, k)
        pattern = cp.real(cp.sum(cp.multiply(cover.conj(), (W[k] @ cover.T).T), axis=1))
        allowed = problem.ripple[k] * cp.real(cp.trace(W[k]))
        constraints.append(cp.abs(gain[k][k] - pattern) <= allowed)
    stated = cp.Problem(cp.Minimize(sum(cp.real(cp.trace(V)) for V in W)), constraints)
    stated.solve(solver="CLARABEL")
    if stated.status in (cp.INFEASIBLE, cp.INFEASIBLE_INACCURATE):
        return np.inf
    return float(stated.value)


@pytest.mark.parametrize("power", [1.0, 1e4, 1e6])
def test_two_objects_rates_lie_on_the_edge_of_what_the_full_relaxation_can_reach(
    power: float,
) -> None:
    # If beams reach rates with power P_T and the relaxation needs (almost) all of P_T for them,
    # they are Pareto optimal for the relaxation.
    problem = _pair(
        power=power, min_rate=np.log2(1 + power * 3 / np.array([103.0, 141.0]) ** 2) / 4
    )
    answer = design_beams(problem)
    assert answer.status == "optimal"
    assert _cvxpy_power(problem, answer.rates) == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize("power", [1.0, 1e4])
def test_fair_rates_lie_on_the_edge_too(power: float) -> None:
    alone = np.log2(1 + power * 8 / np.array([103.0, 141.0]) ** 2)
    problem = _pair(power=power, min_rate=alone * 0.9)
    answer = design_beams(problem)
    assert answer.status == "fallback"
    np.testing.assert_allclose(answer.rates / alone, answer.rates[0] / alone[0], rtol=1e-6)
    assert _cvxpy_power(problem, answer.rates) == pytest.approx(1.0, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_two_objects_are_as_good_as_the_best_of_a_search_over_interference(seed: int) -> None:
    """Global optimum by brute force: CVXPY's least power for a fan of rate pairs of a larger sum.

    The least power grows with the rates of a direction, so that one pair decides each.
    """
    rng = np.random.default_rng(seed)
    problem = _pair(
        angles=rng.uniform(30, 150, 2) * DEG,
        distances=rng.uniform(80, 150, 2),
        coverage_halfwidths=rng.uniform(0, 6, 2) * DEG,
        ripple=rng.uniform(0.3, 3, 2),
        power=10.0 ** rng.uniform(2, 5),
        n_tx=6,
        resolution=2 * DEG,
    )
    answer = design_beams(problem)
    assert _cvxpy_power(problem, answer.rates) == pytest.approx(1.0, rel=1e-5)
    better = answer.objective * (1 + 1e-4)
    for share in np.linspace(0.0, 1.0, 21):
        assert _cvxpy_power(problem, better * np.array([share, 1 - share])) > 1.0
    assert answer.upper_bound >= answer.objective


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [{"min_rate": 1.0}, {"power": 1.0, "min_rate": 2e-4}, {"power": 1e5}],
)
def test_fast_beams_are_as_good_as_the_papers_relaxation_and_better_than_its_beams(
    changes: dict[str, object],
) -> None:
    pytest.importorskip("cvxpy")
    from echobeam.beamforming.reference import ReferenceProblem, minimise_rank, relax

    problem = _pair(**changes)
    fast = design_beams(problem)
    stated = ReferenceProblem(problem)
    relaxed = relax(stated)
    assert relaxed is not None
    assert fast.objective == pytest.approx(relaxed.objective, rel=1e-5)
    final = minimise_rank(stated, relaxed)
    assert max(numerical_rank(W, 1e-5) for W in final.covariances) == 1
    assert 0.85 * relaxed.objective <= final.objective <= relaxed.objective * (1 + 1e-5)


@pytest.mark.slow
def test_reference_method_gives_feasible_rank_one_beams_and_a_proved_bound(
    caplog: pytest.LogCaptureFixture,
) -> None:
    pytest.importorskip("cvxpy")
    caplog.set_level(logging.INFO, "echobeam.reference")
    problem = _pair(n_tx=6, min_rate=0.5)
    fast, reference = design_beams(problem), design_beams(problem, method="reference")
    assert reference.status == "optimal"
    assert reference.max_violation.largest <= 1e-6
    assert reference.objective <= fast.objective * (1 + 1e-6)
    assert reference.objective >= 0.85 * fast.objective
    assert reference.upper_bound >= fast.objective
    lost = float(reference.message.split("lost ")[1].split(" %")[0]) / 100.0
    whole = float(reference.message.split("relaxation's ")[1].split(" bit")[0])
    assert reference.objective == pytest.approx(whole * (1.0 - lost), rel=1e-4)
    words = [record.getMessage() for record in caplog.records]
    assert "at most 32 semidefinite programmes" in words[0]
    assert len(words) == 1 + reference.iterations
    assert all("s left" in line for line in words[1:])


@pytest.mark.slow
def test_reference_method_names_floors_that_cannot_be_met() -> None:
    pytest.importorskip("cvxpy")
    answer = design_beams(_pair(n_tx=4, min_rate=20.0), method="reference")
    assert answer.status == "fallback"
    assert "at most" in answer.message
