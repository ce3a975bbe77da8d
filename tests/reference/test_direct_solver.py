from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.design import design_beams
from echobeam.beamforming.direct import solve_batch
from echobeam.beamforming.problem import BeamProblem, ProblemBatch

from ..problems import problem_batch


def _problem(rng: np.random.Generator) -> BeamProblem:
    n_tx, count = int(rng.choice([8, 16, 24])), int(rng.integers(1, 4))
    width = 3.0 * 10.0 ** rng.uniform(-1.0, np.log10(3.0))
    return BeamProblem(
        angles=np.radians(rng.uniform(30.0, 150.0, count)),
        distances=rng.uniform(80.0, 200.0, count),
        coverage_halfwidths=np.full(count, np.radians(width)),
        ripple=np.exp(rng.uniform(np.log(0.5), np.log(n_tx / 2))),  # type: ignore[arg-type]
        min_rate=0.0,  # type: ignore[arg-type]
        power=10.0 ** rng.uniform(0.0, 5.0),
        noise=1.0,
        n_tx=n_tx,
    )


def _batch(problem: BeamProblem) -> ProblemBatch:
    return problem_batch(
        angles=problem.angles[None],
        distances=problem.distances[None],
        coverage_halfwidths=problem.coverage_halfwidths[None],
        active=np.ones((1, problem.n_objects), dtype=bool),
        ripple=problem.ripple,
        min_rate=problem.min_rate,
        power=problem.power,
        noise=problem.noise,
        n_tx=problem.n_tx,
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_no_worse_than_the_reduced_relaxation(seed: int) -> None:
    problem = _problem(np.random.default_rng(seed))
    result = solve_batch(_batch(problem))
    answer = design_beams(problem, method="sdp")
    assert result.converged[0]
    assert answer.status == "optimal"
    assert result.objective[0] >= answer.objective * (1.0 - 1e-6)
    assert result.objective[0] <= answer.upper_bound * (1.0 + 1e-9)
