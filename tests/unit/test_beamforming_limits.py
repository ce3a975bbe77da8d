"""Limits of work: no fallback takes over for minutes, and answers do not depend on the clock."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation import conic
from echobeam.beamforming.relaxation import solver as relaxation
from echobeam.beamforming.relaxation.conic import limited

WIDE = BeamProblem(
    angles=np.radians([45.47193, 0.3, 51.92874]),
    distances=[17.585165, 39.885186, 29.616255],
    coverage_halfwidths=np.radians([38.62205, 0.29402, 2.79759]),
    ripple=1.048745,
    min_rate=[2.694613, 1.793673, 10.229964],
    power=348915.76,
    noise=1.0,
    spacing=0.97999,
    n_tx=40,
)
USUAL = BeamProblem(
    angles=np.radians([75.0, 135.0]),
    distances=[103.5, 141.4],
    coverage_halfwidths=np.radians([3.0, 3.0]),
    ripple=2.0,
    min_rate=0.0,
    power=1e4,
    noise=1.0,
    n_tx=30,
)


@pytest.fixture
def units(monkeypatch):
    """Work of the programmes that are solved."""
    done = []
    solver = conic.work_of

    def counted(programme):
        done.append(solver(programme))
        return done[-1]

    monkeypatch.setattr(conic, "work_of", counted)
    return done


def test_work_within_a_limit_changes_nothing(units) -> None:
    free = relaxation.solve(USUAL)
    total = sum(units)
    assert total > 0.0
    with limited(total) as work:
        same = relaxation.solve(USUAL)
    assert not work.reached
    assert work.left == pytest.approx(0.0, abs=1e-6 * total)
    np.testing.assert_array_equal(free.beams, same.beams)


@pytest.mark.parametrize("part", [0.0, 0.2, 0.9])
def test_beyond_a_limit_the_answer_says_so_and_keeps_what_it_can(units, part: float) -> None:
    relaxation.solve(USUAL)
    with limited(part * sum(units)) as work:
        short = relaxation.solve(USUAL)
    assert work.reached
    assert work.left >= 0.0
    assert short.outcome != "converged"
    assert short.message.startswith("the relaxation reached its limit of work")
    missed = violation(USUAL, short.beams)
    assert max(missed.power, missed.coverage) <= 1e-6


def test_an_inner_limit_does_not_lift_the_outer_one() -> None:
    with limited(10.0) as outer, limited(1e9) as inner:
        assert inner is outer
    with limited(5.0) as again:
        assert again.left == 5.0


@pytest.mark.slow
def test_a_bound_that_took_half_a_minute_is_within_its_limit(units) -> None:
    answer = design_beams(WIDE)
    units.clear()
    bound = answer.upper_bound
    allowed = [unit for unit in units if unit <= relaxation.BOUND_WORK]
    assert sum(allowed[:-1]) <= relaxation.BOUND_WORK
    assert bound >= answer.objective
    assert np.isfinite(bound)


def test_a_bound_without_work_is_looser_and_still_a_bound(monkeypatch) -> None:
    answer = design_beams(USUAL)
    tight = answer.upper_bound
    monkeypatch.setattr(relaxation, "BOUND_WORK", 0.0)
    loose = design_beams(USUAL).upper_bound
    assert loose >= tight >= answer.objective
