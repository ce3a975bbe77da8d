"""Beam problems that cannot be solved as asked: each has a named, feasible, fair answer."""

from __future__ import annotations

import builtins
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from echobeam.beamforming.design import design_batch, design_beams
from echobeam.beamforming.problem import BeamProblem, ProblemError
from echobeam.beamforming.relaxation import conic

from ..problems import problem_batch

DEG = np.pi / 180.0


def _problem(**changes: object) -> BeamProblem:
    values: dict[str, object] = {
        "angles": np.array([75.0, 135.0]) * DEG,
        "distances": np.array([103.0, 141.0]),
        "coverage_halfwidths": np.array([3.0, 2.0]) * DEG,
        "ripple": 2.0,
        "min_rate": 0.0,
        "power": 1e4,
        "noise": 1.0,
        "n_tx": 16,
    }
    return BeamProblem(**{**values, **changes})  # type: ignore[arg-type]


def test_a_floor_that_one_object_can_never_have_is_named_with_its_limit() -> None:
    answer = design_beams(_problem(min_rate=[1.0, 30.0]))
    alone = design_beams(
        BeamProblem([135 * DEG], [141.0], [2 * DEG], 2.0, 0.0, 1e4, 1.0, 16)
    ).objective
    assert answer.status == "fallback"
    assert f"object 1: floor 30 bit/s/Hz, at most {alone:.3g} reachable" in answer.message
    assert "object 0" not in answer.message
    assert answer.rates[0] / 1.0 == pytest.approx(answer.rates[1] / 30.0, rel=1e-5)
    assert answer.max_violation.power <= 2 * 16 * np.finfo(float).eps  # the sum's own rounding
    assert answer.max_violation.coverage <= 1e-6
    assert answer.max_violation.rate == pytest.approx(1 - answer.rates[0], rel=1e-6)


def test_floors_that_exceed_the_power_together_are_all_scaled_and_named() -> None:
    answer = design_beams(_problem(min_rate=2.8))
    assert answer.status == "fallback"
    assert "cannot be met together" in answer.message
    assert "object 0: floor 2.8" in answer.message
    assert "object 1: floor 2.8" in answer.message
    assert answer.rates[0] == pytest.approx(answer.rates[1], rel=1e-5)
    assert np.sum(np.abs(answer.beams) ** 2) == pytest.approx(1e4, rel=1e-9)
    # Fair and not wasteful: slightly lower floors are met by an ordinary design.
    met = design_beams(_problem(min_rate=float(answer.rates[0]) * (1 - 1e-4)))
    assert met.status == "optimal"
    assert design_beams(_problem(min_rate=float(answer.rates[0]) * 1.001)).status == "fallback"


def test_objects_of_one_sine_are_named_and_share_fairly() -> None:
    answer = design_beams(
        _problem(angles=np.array([75.0, 105.0]) * DEG, distances=[100.0, 100.0], min_rate=2.0)
    )
    assert answer.status == "fallback"
    assert "objects 0 and 1 lie in one direction" in answer.message
    assert answer.rates[0] == pytest.approx(answer.rates[1], rel=1e-5)
    assert answer.rates[0] < 1.0


def test_objects_of_one_sine_without_floors_leave_all_to_one() -> None:
    both = design_beams(_problem(angles=np.array([75.0, 105.0]) * DEG, distances=[90.0, 100.0]))
    one = design_beams(BeamProblem([75 * DEG], [90.0], [3 * DEG], 2.0, 0.0, 1e4, 1.0, 16))
    assert both.status == "optimal"
    assert both.objective == pytest.approx(one.objective, rel=1e-6)


def test_a_fallbacks_bound_still_holds_for_designs_without_floors() -> None:
    answer = design_beams(_problem(min_rate=2.8))
    assert answer.upper_bound >= design_beams(_problem()).objective


def test_a_solver_that_fails_costs_optimality_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = conic.ConicAnswer([], [], usable=False, infeasible=False, objective=np.nan)
    monkeypatch.setattr(conic, "solve", lambda *_: failed)
    answer = design_beams(_problem(), method="sdp")
    assert answer.outcome == "unproved"
    assert answer.message
    assert answer.max_violation.largest <= 1e-6
    assert answer.objective > 0
    assert answer.upper_bound >= answer.objective


def test_a_solver_that_lies_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = conic.solve

    def lying(programme: conic.Programme, *rest: Any) -> conic.ConicAnswer:
        answer = solve(programme, *rest)
        noise = [5.0 * np.outer(m[0], m[0]) + 3.0 * np.eye(len(m)) for m in answer.matrices]
        wrong = [m + n for m, n in zip(answer.matrices, noise, strict=True)]
        multipliers = [0.1 * y + 1.0 for y in answer.own_multipliers]
        return conic.ConicAnswer(wrong, multipliers, True, False, answer.objective)

    honest = design_beams(_problem(), method="sdp")
    monkeypatch.setattr(conic, "solve", lying)
    answer = design_beams(_problem(), method="sdp")
    assert answer.max_violation.largest <= 1e-6 or answer.status == "fallback"
    assert answer.upper_bound >= honest.objective


@pytest.mark.parametrize(
    "changes",
    [
        {"ripple": 0.0},
        {"ripple": 1e-5},
        {"ripple": 16.0},
        {"coverage_halfwidths": np.array([90.0, 45.0]) * DEG, "n_tx": 8},
        {"angles": np.array([90.0, 90.0]) * DEG},
        {"angles": np.array([0.0, 180.0]) * DEG},
        {"angles": np.array([75.0, 75.001]) * DEG, "power": 1e6},
        {"n_tx": 1},
        {"n_tx": 1, "angles": np.zeros(2), "distances": [4746.0, 4746.0], "power": 1e-8},
        {"n_tx": 2, "coverage_halfwidths": np.array([20.0, 20.0]) * DEG},
        {"distances": [1e-3, 1e5]},
        {"power": 1e-12},
        {"noise": 1e-9},
        {"spacing": 3.0},
        {"axis": "horizontal"},
        {"resolution": 2.0 * DEG},
        {"warm_start": np.ones((2, 16))},
    ],
)
@pytest.mark.slow
def test_corners_of_the_domain_have_a_feasible_answer(changes: dict[str, object]) -> None:
    answer = design_beams(_problem(**changes))
    assert np.all(np.isfinite(answer.beams))
    assert answer.max_violation.largest <= 1e-6
    assert answer.status == "optimal" or answer.message
    assert 0 < answer.objective <= answer.upper_bound


def test_grids_beyond_memory_are_refused_in_words() -> None:
    with pytest.raises(ProblemError, match="coarser resolution"):
        design_beams(_problem(resolution=1e-12))
    with pytest.raises(ProblemError, match="n_tx = 1000000000"):
        design_beams(_problem(n_tx=10**9))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("angles", np.array([1.0 + 1.0j, 2.0])),
        ("angles", [10**400, 1]),
        ("power", 10**4000),
        ("n_tx", 10**400),
        ("axis", np.array(["vertical", "horizontal"])),
        ("warm_start", "beams"),
        ("warm_start", {}),
        ("warm_start", [[1], [1, 2]]),
        ("warm_start", [[10**400] * 16] * 2),
        ("warm_start", np.full((2, 16), np.nan)),
        ("warm_start", np.ones((3, 16))),
    ],
)
def test_what_is_no_number_is_refused_by_name_alone(name: str, value: object) -> None:
    with pytest.raises(ProblemError) as caught:
        _problem(**{name: value})
    assert str(caught.value).startswith(f"{name} must be ")
    assert ";" not in str(caught.value)  # what is right is not blamed for it
    assert len(str(caught.value)) < 200


def test_values_out_of_range_are_told() -> None:
    with pytest.raises(ProblemError, match=r"power must be positive, not -3; .*not 2\.5"):
        _problem(power=-3.0, n_tx=2.5)
    with pytest.raises(ProblemError, match=r"between 1e-30 and 300, not \[1000"):
        _problem(min_rate=1000.0)


def test_what_is_no_problem_method_or_gap_is_refused() -> None:
    with pytest.raises(ProblemError, match="must be a BeamProblem, not a dict"):
        design_beams({"angles": [1.0]})  # type: ignore[arg-type]
    with pytest.raises(ProblemError, match="method must be one of"):
        design_beams(_problem(), method=["fast"])  # type: ignore[arg-type]
    with pytest.raises(ProblemError, match="gap must be a positive number"):
        design_beams(_problem(), certify=True, gap="small")  # type: ignore[arg-type]


@pytest.mark.slow
def test_many_more_objects_than_antennas_are_served() -> None:
    values = {"angles": np.linspace(0.3, 2.9, 40), "distances": np.full(40, 100.0), "n_tx": 8}
    answer = design_beams(_problem(**values, coverage_halfwidths=np.full(40, 0.02), ripple=0.5))
    assert answer.max_violation.largest <= 1e-6
    assert answer.status == "optimal" or "40 objects, and the search did not" in answer.message
    assert answer.objective > 0.9 * answer.upper_bound


@pytest.mark.slow
@pytest.mark.parametrize(("min_rate", "part"), [(4e-4, 0.5), (4e-5, 1.0)])
def test_a_search_left_unfinished_is_not_thrown_away_for_its_floors(
    min_rate: float, part: float
) -> None:
    """Flat beams meet 12 % of the first floors, and have a fifth of the second's sum rate."""
    answer = design_beams(
        _problem(
            coverage_halfwidths=np.array([90.0, 90.0]) * DEG,
            ripple=3.0,
            min_rate=min_rate,
            power=1.0,
            n_tx=96,
        )
    )
    assert answer.outcome == ("floors lowered" if part < 1.0 else "unproved")
    assert answer.max_violation.power <= 1e-12
    assert answer.max_violation.coverage <= 1e-6
    assert np.min(answer.rates) >= part * min_rate * (1 - 1e-6)
    assert answer.objective > 3.5 * 9.5e-5  # that of flat beams
    assert ("all floors scaled by" in answer.message) == (part < 1.0)


def test_a_batch_survives_a_grid_beyond_memory() -> None:
    batch = problem_batch(
        angles=np.array([[1.3], [1.4]]),
        distances=np.array([[100.0], [100.0]]),
        coverage_halfwidths=np.array([[1.5], [0.0001]]),
        active=np.ones((2, 1), dtype=bool),
        ripple=np.ones(1),
        min_rate=np.zeros(1),
        power=1.0,
        noise=1.0,
        n_tx=8,
        resolution=1e-8,
    )
    answers = design_batch(batch)
    assert answers.fallback.tolist() == [True, False]
    warm = replace(batch, warm_start=np.full((2, 1, 8), 0.1 + 0j))
    again = design_batch(warm)
    assert again.fallback.tolist() == [True, False]
    assert again.objective[1] >= answers.objective[1] * (1.0 - 1e-9)


def test_reference_without_cvxpy_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    imported = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name == "cvxpy":
            raise ImportError(name)
        return imported(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match="pip install cvxpy scs"):
        design_beams(_problem(), method="reference")


def test_a_climb_that_ends_far_below_its_bound_says_so() -> None:
    high = _problem(min_rate=5.0, noise=1e-15)
    relaxed, direct = design_beams(high, method="sdp"), design_beams(high)
    assert relaxed.upper_bound >= direct.objective * (1.0 - 1e-9)
    assert relaxed.objective < 0.9 * direct.objective
    assert "may have ended early" in relaxed.message
    assert design_beams(_problem(), method="sdp").message == ""
