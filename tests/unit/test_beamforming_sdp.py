from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation import sdp
from echobeam.beamforming.relaxation.model import build_model, model_gains, ripple_excess

DEG = np.pi / 180.0


def _problem(power: float = 1e4, min_rate: float = 0.5) -> BeamProblem:
    return BeamProblem(
        np.array([75.0, 100.0]) * DEG,
        [100.0, 120.0],
        np.array([2.0, 3.0]) * DEG,
        1.5,
        min_rate,
        power,
        1,
        16,
    )


def _flat_start(model) -> sdp.Design:
    covariances = [np.eye(beam.size) / (2 * beam.size) for beam in model.beams]
    return sdp.Design(covariances, [beam.start for beam in model.beams], 0)


@pytest.mark.parametrize("power", [1e-3, 1.0, 1e4, 1e6])
def test_climb_ends_feasible_and_far_above_its_start(power: float) -> None:
    model = build_model(_problem(power, min_rate=0.0))
    start = _flat_start(model)
    design = sdp.improve(model, start)
    assert design is not None
    before = sdp.sum_rate(model_gains(model, start.covariances), model.loss)
    after = sdp.sum_rate(model_gains(model, design.covariances), model.loss)
    assert after > 1.5 * before
    assert sum(np.trace(c) for c in design.covariances) <= 1 + 1e-12
    for beam, covariance in zip(model.beams, design.covariances, strict=True):
        assert np.linalg.eigvalsh(covariance)[0] >= -1e-12
        assert ripple_excess(beam, covariance).max() <= 2e-10


def test_climbing_again_from_the_end_gains_nothing() -> None:
    model = build_model(_problem())
    design = sdp.improve(model, _flat_start(model))
    assert design is not None
    again = sdp.improve(model, design)
    assert again is not None
    values = [
        float(sdp.sum_rate(model_gains(model, d.covariances), model.loss)) for d in (design, again)
    ]
    assert values[1] == pytest.approx(values[0], rel=1e-7)


def test_floors_hold_at_the_end() -> None:
    model = build_model(_problem(power=2e3, min_rate=0.6))
    design = sdp.improve(model, _flat_start(model))
    assert design is not None
    gains = model_gains(model, design.covariances)
    own = np.diagonal(gains)
    rates = np.log2(1 + own / (gains.sum(axis=1) - own + model.loss))
    assert np.all(rates >= 0.6 * (1 - 1e-6))


def test_floors_out_of_reach_give_nothing() -> None:
    model = build_model(_problem(power=2e3, min_rate=4.0))
    assert sdp.improve(model, _flat_start(model)) is None


def test_sum_rate_is_the_logarithm_of_the_sinr() -> None:
    gains = np.array([[[6.0, 1.0], [2.0, 9.0]], [[0.0, 0.0], [0.0, 0.0]]])
    expected = [np.log(1 + 6 / 2) + np.log(1 + 9 / 4), 0.0]
    np.testing.assert_allclose(sdp.sum_rate(gains, np.array([1.0, 2.0])), expected)
