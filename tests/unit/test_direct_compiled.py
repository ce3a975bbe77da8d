"""The compiled solver against its own text, interpreted: the compiler changes rounding alone."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import FEASIBLE, violation
from echobeam.beamforming.direct import compiling, solve_batch
from echobeam.beamforming.direct.trials import compile_solver
from echobeam.beamforming.problem import ProblemBatch
from echobeam.physics.planar import PlanarArray

from ..interpreted import interpreted, solve_interpreted
from ..problems import problem_batch


def _batch(seed: int, n_tx: int, count: int, trials: int = 6, **changes: Any) -> ProblemBatch:
    rng = np.random.default_rng(seed)
    shape = (trials, count)
    values: dict[str, Any] = {
        "angles": np.radians(rng.uniform(20.0, 160.0, shape)),
        "distances": rng.uniform(100.0, 200.0, shape),
        "coverage_halfwidths": np.radians(3.0 * rng.uniform(0.1, 1.5, shape)),
        "active": np.ones(shape, dtype=bool),
        "ripple": np.exp(rng.uniform(np.log(0.5), np.log(n_tx / 2), count)),
        "min_rate": np.zeros(count),
        "power": 10.0 ** rng.uniform(0.0, 4.0),
        "noise": 1.0,
        "n_tx": n_tx,
    }
    return problem_batch(**{**values, **changes})


CASES = {
    "two antennas": _batch(0, 2, 1, ripple=np.array([0.5])),
    "one object": _batch(1, 30, 1),
    "two objects": _batch(2, 30, 2, power=1.0),
    "an odd array": _batch(3, 17, 3, power=10.0),
    "four objects": _batch(4, 64, 4, power=100.0),
    "a wide cover": _batch(5, 30, 2, coverage_halfwidths=np.full((6, 2), 0.25), power=1.0),
    "no cover": _batch(6, 30, 3, coverage_halfwidths=np.zeros((6, 3))),
    "floors": _batch(7, 30, 2, power=100.0, min_rate=np.full(2, 0.02)),
    "floors out of reach": _batch(8, 30, 2, power=1.0, min_rate=np.full(2, 3.0)),
    "objects that come and go": _batch(
        9,
        30,
        3,
        active=np.array([[1, 1, 0], [0, 0, 0], [1, 1, 1], [0, 0, 1], [1, 0, 1], [1] * 3]) > 0,
    ),
    "the array's axis": _batch(10, 30, 1, angles=np.full((6, 1), np.pi / 2)),
    "nearly as many objects as antennas": _batch(
        11, 8, 6, power=10.0, coverage_halfwidths=np.radians(np.full((6, 6), 0.5))
    ),
}


def _planar(seed: int, array: PlanarArray, count: int, **changes: Any) -> ProblemBatch:
    rng = np.random.default_rng(seed)
    shape = (2, count)
    root = rng.normal(size=(*shape, 2, 2)) * rng.uniform(0.02, 0.06, (*shape, 1, 1))
    values: dict[str, Any] = {
        "angles": rng.uniform(-0.5, 0.5, (*shape, 2)),
        "loss": 10.0 ** rng.uniform(-1.0, 1.0, shape),
        "coverage_halfwidths": root @ np.swapaxes(root, -1, -2),
        "active": np.ones(shape, dtype=bool),
        "ripple": np.full(count, 0.2 * array.elements),
        "min_rate": np.zeros(count),
        "power": 1.0,
        "array": array,
        "resolution": 0.05,
    }
    return ProblemBatch(**{**values, **changes})


BOTH = {
    **{name: batch.taken(np.arange(2)) for name, batch in CASES.items()},
    "four objects": CASES["four objects"].taken(np.arange(1)),  # of 64 antennas: seconds for each
    "a planar array": _planar(20, PlanarArray(4, 4), 1),
    "two objects of a planar array": _planar(21, PlanarArray(3, 4), 2),
    "two polarisations": _planar(22, PlanarArray(4, 3, polarisations=2), 2),
    "no cover of a planar array": _planar(
        23, PlanarArray(3, 3), 2, coverage_halfwidths=np.zeros((2, 2, 2, 2))
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BOTH)
def test_both_find_the_same_beams(name: str) -> None:
    batch = BOTH[name]
    found, plain = solve_batch(batch), solve_interpreted(batch)
    np.testing.assert_array_equal(found.converged, plain.converged)
    np.testing.assert_array_equal(found.floors_infeasible, plain.floors_infeasible)
    np.testing.assert_allclose(found.objective, plain.objective, rtol=1e-7)
    np.testing.assert_allclose(found.floor_factor, plain.floor_factor, rtol=1e-7)


def test_the_interpreted_solver_is_not_the_compiled_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python functions put in place of two of its own are called, for each trial and step."""
    direct, calls = interpreted(), {"descend": 0, "step": 0}

    def counted(module: Any, name: str) -> None:
        inner = getattr(module, name)

        def count(*arguments: Any) -> Any:
            calls[name] += 1
            return inner(*arguments)

        monkeypatch.setattr(module, name, count)

    counted(direct.trials, "descend")
    counted(direct.climb, "step")
    batch = BOTH["two antennas"]
    plain = solve_interpreted(batch)
    assert calls["descend"] == len(batch)
    assert calls["step"] >= plain.iterations.sum() > 0
    before = dict(calls)
    np.testing.assert_allclose(solve_batch(batch).objective, plain.objective, rtol=1e-7)
    assert calls == before


@pytest.mark.parametrize("name", CASES)
def test_beams_keep_every_constraint(name: str) -> None:
    batch = CASES[name]
    found = solve_batch(batch)
    for trial in np.flatnonzero(found.converged & ~found.floors_infeasible):
        problem = batch.problem(trial)
        beams = found.beams[trial, batch.active[trial]]
        assert violation(problem, beams).largest <= FEASIBLE


def test_a_warm_start_ends_in_the_same_beams_sooner() -> None:
    batch = CASES["two objects"]
    cold = solve_batch(batch)
    warm = solve_batch(replace(batch, warm_start=cold.beams))
    np.testing.assert_allclose(warm.objective, cold.objective, rtol=1e-8)
    assert warm.iterations.sum() < cold.iterations.sum()
    unknown = np.full_like(cold.beams, np.nan)
    again = solve_batch(replace(batch, warm_start=unknown))
    np.testing.assert_array_equal(again.beams, cold.beams)


def test_a_trial_does_not_depend_on_the_others() -> None:
    batch = CASES["four objects"]
    together = solve_batch(batch)
    alone = solve_batch(batch.taken(np.array([4])))
    np.testing.assert_array_equal(alone.beams[0], together.beams[4])


SMALL = """
from echobeam.beamforming.direct import compiling, trials

@compiling.compiled
def half(x):
    return 0.5 * x

def small():
    def run(*arguments):
        return half(3.0)
    run.__module__ = trials.__name__  # progress counts functions of the package
    return compiling.compiled_once(run)

trials._runner = small
from echobeam.cli.main import main
main()
"""
"""A module with the command line, in which a small function takes the place of the solver."""


@pytest.mark.slow
def test_compiling_says_what_it_does_where_it_is_kept_and_is_done_once(tmp_path: Path) -> None:
    """A process of its own with an empty cache, and another one with what that left."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    (tmp_path / "small.py").write_text(SMALL)
    command = [sys.executable, str(tmp_path / "small.py"), "compile"]
    said = []
    for _ in range(2):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        said.append((done.stderr, done.stdout))
    first, second = said
    kept = tmp_path / "cache"
    assert f"compiling the beam solver, about {compiling.ABOUT} s; it is kept in {kept}" in first[0]
    assert re.fullmatch(rf"beam solver: compiled in \d+ s; stored in {kept}\S+\n", first[1])
    assert "compiling" not in second[0]
    assert re.fullmatch(rf"beam solver: already compiled; stored in {kept}\S+\n", second[1])


@pytest.mark.slow
def test_the_solver_that_was_compiled_is_found_by_the_next_process() -> None:
    compiling_here = compile_solver()
    command = [sys.executable, "-c", "from echobeam.cli.main import main; main()", "compile"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"beam solver: already compiled; stored in {compiling_here.folder}\n"


def test_code_that_cannot_be_kept_is_told_of() -> None:
    assert "cannot be kept" in compiling.message(None)
    assert "NUMBA_CACHE_DIR" in compiling.message(None)


@pytest.mark.slow
def test_no_bit_depends_on_where_arrays_lie_in_memory():
    """Sums of compiled code in an order of its own had other last bits after other allocations.

    Two objects that pass each other, as in the scenario where that was found.
    """
    time = 0.02 * np.arange(160, 200)
    x = np.stack([-44.9 + 23.0 * time, -33.1 + 17.0 * time], axis=-1)
    batch = problem_batch(
        angles=np.arctan2(100.0, x),
        distances=np.hypot(100.0, x),
        coverage_halfwidths=np.zeros(x.shape),
        active=np.ones(x.shape, dtype=bool),
        ripple=np.full(2, 1.2),
        min_rate=np.zeros(2),
        power=1500.0,
        noise=1.0,
        n_tx=12,
        axis="horizontal",
    )
    answers, kept = [], []
    for size in range(12):
        kept.append([np.ones(13 + 7 * size) for _ in range(5 * size)])  # moves what comes next
        alone = [solve_batch(batch.taken([trial])).beams[0] for trial in range(len(batch))]
        answers.append(np.stack(alone))
    for other in answers[1:]:
        np.testing.assert_array_equal(other, answers[0])
