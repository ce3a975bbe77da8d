from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.objective import rates_from_gains
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation.floors import largest_factor
from echobeam.beamforming.relaxation.model import build_model, model_gains
from echobeam.beamforming.relaxation.shape import best_shape

DEG = np.pi / 180.0


def _fair(problem: BeamProblem):
    model = build_model(problem)
    shapes = [best_shape(beam) for beam in model.beams]
    fair = largest_factor(model, shapes)
    reached = rates_from_gains(model_gains(model, fair.design.covariances), model.loss)
    return model, shapes, fair, reached


def test_one_object_reaches_all_that_its_gain_allows() -> None:
    problem = BeamProblem([1.3], [100.0], [3 * DEG], 1.0, 5.0, 1e4, 1, 16)
    model, shapes, fair, reached = _fair(problem)
    alone = np.log2(1 + shapes[0].gain / model.loss[0])
    assert fair.factor * 5.0 == pytest.approx(alone, rel=1e-6)
    assert reached[0] == pytest.approx(alone, rel=1e-6)


def test_all_get_the_same_part_of_their_floors_and_all_power_is_spent() -> None:
    problem = BeamProblem(
        np.array([60.0, 75.0, 120.0]) * DEG,
        [90.0, 110.0, 150.0],
        np.array([2.0, 1.0, 3.0]) * DEG,
        1.0,
        [2.0, 3.0, 1.0],
        1e4,
        1,
        16,
    )
    _, _, fair, reached = _fair(problem)
    assert 0.0 < fair.factor < 1.0
    np.testing.assert_allclose(reached, fair.factor * problem.min_rate, rtol=1e-6)
    assert sum(np.trace(c) for c in fair.design.covariances) == pytest.approx(1.0, rel=1e-9)


def test_two_objects_in_one_direction_share_it() -> None:
    # Same sine, same distance: both SINR are equal at g p / (g p + s) with p = 1/2 each.
    problem = BeamProblem(
        np.array([75.0, 105.0]) * DEG, [100.0, 100.0], [0.0, 0.0], 0.0, 3.0, 1e5, 1, 8
    )
    model, _, fair, reached = _fair(problem)
    expected = np.log2(1 + 4.0 / (4.0 + model.loss[0]))
    np.testing.assert_allclose(reached, expected, rtol=1e-6)
    assert fair.factor == pytest.approx(expected / 3.0, rel=1e-6)


def test_floors_that_can_be_met_have_the_factor_one() -> None:
    problem = BeamProblem([1.3], [100.0], [3 * DEG], 1.0, 0.5, 1e4, 1, 16)
    assert _fair(problem)[2].factor == 1.0
