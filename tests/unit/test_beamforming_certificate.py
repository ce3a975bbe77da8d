from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

import echobeam.beamforming.certify.bounds
import echobeam.beamforming.certify.certificate
from echobeam.beamforming.certify.certificate import numerical_rank, violation
from echobeam.beamforming.problem import BeamProblem

DEG = np.pi / 180.0


def _problem(**changes: object) -> BeamProblem:
    values: dict[str, object] = {
        "angles": np.array([60.0, 100.0]) * DEG,
        "distances": np.array([100.0, 120.0]),
        "coverage_halfwidths": np.array([1.0, 2.0]) * DEG,
        "ripple": np.array([0.5, 0.25]),
        "min_rate": np.array([0.1, 0.0]),
        "power": 1e4,
        "noise": 1.0,
        "n_tx": 6,
    }
    return BeamProblem(**{**values, **changes})  # type: ignore[arg-type]


def _pattern(beam: np.ndarray, angle: float) -> float:
    steering = np.exp(1j * np.pi * np.arange(beam.size) * np.sin(angle))
    return float(abs(np.vdot(steering, beam)) ** 2)


def test_violation_is_the_definition_written_out() -> None:
    problem = _problem(ripple=np.array([0.01, 0.02]))
    rng = np.random.default_rng(5)
    beams = 50 * (rng.normal(size=(2, 6)) + 1j * rng.normal(size=(2, 6)))
    found = violation(problem, beams)
    spent = np.sum(np.abs(beams) ** 2)
    assert found.power == pytest.approx(spent / 1e4 - 1, rel=1e-12)
    gains = np.array([[_pattern(b, a) for b in beams] for a in problem.angles])
    rate = np.log2(1 + gains[0, 0] / (gains[0, 1] + 100.0**2))
    assert found.rate == pytest.approx(max(0.0, 1 - rate / 0.1), abs=1e-12)
    worst = 0.0
    for k, steps in ((0, 10), (1, 20)):
        power = np.sum(np.abs(beams[k]) ** 2)
        for j in range(-steps, steps + 1):
            gap = abs(gains[k, k] - _pattern(beams[k], problem.angles[k] + j * 0.1 * DEG))
            allowed = problem.ripple[k] * power
            worst = max(worst, (gap - allowed) / allowed)
    assert worst > 0
    assert found.coverage == pytest.approx(worst, rel=1e-9)
    assert found.largest == max(found.power, found.rate, found.coverage)


def test_one_antenna_is_flat_for_any_ripple() -> None:
    beams = np.zeros((2, 6), dtype=complex)
    beams[:, 0] = 70.0
    found = violation(_problem(ripple=0.0, min_rate=0.0), beams)
    assert found.power == 0.0
    assert found.coverage < 1e-9


def test_a_beam_without_power_violates_nothing_but_its_floor() -> None:
    found = violation(_problem(), np.zeros((2, 6), dtype=complex))
    assert (found.power, found.rate, found.coverage) == (0.0, 1.0, 0.0)


def test_beams_that_are_not_numbers_are_infinitely_wrong() -> None:
    assert violation(_problem(), np.full((2, 6), np.nan + 0j)).largest == np.inf


def test_rank_counts_what_is_not_noise() -> None:
    rng = np.random.default_rng(1)
    factor = rng.normal(size=(6, 2)) + 1j * rng.normal(size=(6, 2))
    assert numerical_rank(factor @ factor.conj().T) == 2
    assert numerical_rank(factor @ factor.conj().T + 1e-9 * np.eye(6)) == 2
    assert numerical_rank(np.zeros((4, 4), dtype=complex)) == 0


@pytest.mark.parametrize(
    "module", [echobeam.beamforming.certify.certificate, echobeam.beamforming.certify.bounds]
)
def test_judges_import_no_solver(module: object) -> None:
    tree = ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8"))  # type: ignore[attr-defined]
    imported = {
        name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom | ast.Import)
        for name in (
            [node.module] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
        )
    }
    solvers = ("clarabel", "cvxpy", "scipy.optimize", "conic", "sdp", "shape", "relaxation")
    assert not [name for name in imported if name and name.split(".")[-1] in solvers]
    assert not [name for name in imported if name and "direct" in name]
