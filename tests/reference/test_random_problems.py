"""A slice of the random problems: feasible or named, no worse than given, than the relaxation."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

import echobeam as eb

PIECES, SIZE = 4, 10
FEASIBLE = 1e-6
WORSE = 1e-5
MOST_OBJECTS, MOST_SIZE = 3, 128
"""The relaxation is solved up to so many objects, and up to this K N."""


def _benchmark() -> ModuleType:
    path = Path(__file__).parents[2] / "benchmarks" / "random_problems.py"
    spec = importlib.util.spec_from_file_location("random_problems", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.parametrize("piece", range(PIECES))
def test_random_problems_are_solved_or_named(piece: int) -> None:
    benchmark = _benchmark()
    for index in range(piece * SIZE, (piece + 1) * SIZE):
        problem = benchmark.draw(index)
        answer = eb.design_beams(problem)
        missed = answer.max_violation
        assert max(missed.power, missed.coverage) <= FEASIBLE, index
        if answer.status != "optimal":
            assert answer.message, index
            continue
        assert missed.largest <= FEASIBLE, index
        own = eb.design_beams(benchmark.restarted(problem, answer.beams))
        assert own.objective >= answer.objective * (1.0 - 1e-9), index


@pytest.mark.slow
def test_none_is_worse_than_the_relaxation() -> None:
    benchmark = _benchmark()
    compared = 0
    for index in range(PIECES * SIZE):
        problem = benchmark.draw(index)
        if problem.n_objects > MOST_OBJECTS or problem.n_objects * problem.n_tx > MOST_SIZE:
            continue
        relaxed = eb.design_beams(problem, method="sdp")
        if relaxed.outcome != "converged":
            continue
        compared += 1
        answer = eb.design_beams(problem)
        assert answer.status == "optimal", index
        assert answer.objective >= relaxed.objective * (1.0 - WORSE), index
    assert compared >= 5


@pytest.mark.slow
def test_random_planar_problems_are_solved() -> None:
    benchmark = _benchmark()
    for index in range(12):
        row = benchmark.examined(index, planar=True, plain=False)
        assert row["violation"] <= FEASIBLE, row
        assert row["finer"] <= benchmark.FINER_EXCESS, row
        assert row["two"] >= row["objective"] * (1.0 - 1e-6), row
