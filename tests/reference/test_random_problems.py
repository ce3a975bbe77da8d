"""A slice of the random problems: each solved or named, feasible, no worse than the relaxation."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

PIECES, SIZE = 6, 10
FEASIBLE = 1e-6
WORSE = 1e-5
SDP_SECONDS = 5.0


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
    compared = 0
    for index in range(piece * SIZE, (piece + 1) * SIZE):
        row = benchmark.examined(index, SDP_SECONDS)
        assert row["status"] == "optimal" or benchmark.named(row["message"]), row
        assert row["violation"] <= FEASIBLE, row
        if row["sdp"] is not None and benchmark.comparable(row):
            compared += 1
            assert benchmark.loss(row) <= WORSE, row
    assert compared > 0
