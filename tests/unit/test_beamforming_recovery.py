from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.objective import beam_gains
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation.model import build_model, flattened, model_gains, ripple_excess
from echobeam.beamforming.relaxation.recovery import keep_coverage, recover_beams
from echobeam.physics.array import LinearArray

DEG = np.pi / 180.0


def _problem(min_rate: float = 0.0) -> BeamProblem:
    return BeamProblem(
        np.array([40.0, 125.0]) * DEG,
        [100.0, 120.0],
        np.array([6.0, 5.0]) * DEG,
        0.8,
        min_rate,
        50.0,
        1,
        12,
    )


@pytest.mark.parametrize("rank", [1, 2, 4])
def test_beams_have_the_gains_the_power_and_the_coverage_of_their_covariances(rank: int) -> None:
    problem = _problem()
    model = build_model(problem)
    rng = np.random.default_rng(rank)
    covariances = []
    for beam in model.beams:
        factor = rng.normal(size=(beam.size, rank))
        covariance = factor @ factor.T
        kept = flattened(covariance, ripple_excess(beam, covariance), beam.ripple)
        covariances.append(0.4 * kept / np.trace(kept))
    beams = recover_beams(problem, model, covariances)
    assert np.sum(np.abs(beams) ** 2) == pytest.approx(0.8 * 50.0, rel=1e-10)
    np.testing.assert_allclose(
        beam_gains(beams, problem.angles, LinearArray(beams.shape[-1])),
        50.0 * model_gains(model, covariances),
        rtol=1e-7,
    )
    assert violation(problem, beams).largest <= 1e-7


def test_beams_without_power_are_zero() -> None:
    problem = _problem()
    model = build_model(problem)
    flat = np.eye(model.beams[0].size) / model.beams[0].size
    beams = recover_beams(problem, model, [flat, np.zeros((model.beams[1].size,) * 2)])
    assert np.all(beams[1] == 0)
    assert np.sum(np.abs(beams[0]) ** 2) == pytest.approx(50.0, rel=1e-10)


def test_coverage_is_restored_by_mixing_with_a_flat_pattern() -> None:
    problem = _problem()
    rng = np.random.default_rng(0)
    beams = rng.normal(size=(2, 12)) + 1j * rng.normal(size=(2, 12))
    beams *= np.sqrt(0.5) / np.linalg.norm(beams, axis=1, keepdims=True)
    assert violation(problem, beams).coverage > 0.1
    kept = keep_coverage(problem, beams)
    assert violation(problem, kept).coverage <= 1e-9
    np.testing.assert_allclose(np.linalg.norm(kept, axis=1), np.linalg.norm(beams, axis=1))
