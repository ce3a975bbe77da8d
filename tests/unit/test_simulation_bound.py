"""Posterior bound of objects that appear and leave: that of the same object at another time."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb
from echobeam.scenario.model import Scenario
from echobeam.simulation.bound import with_bound

LATER = 6  # slots


def bound_of(objects, detections, process_noise):
    """Return the bound ``(slot, object, S)`` under a hovering UAV that never beams.

    So an object has the same measurements at any time.
    """
    scenario = Scenario.model_validate(
        {
            "name": "bound",
            "array": {"n_tx": 8},
            "radio": {"power": 1e6},
            "radar": {"detections": detections, "crb": "exact"},
            "uav": {"height": 100.0, "speed": 0.0},
            "objects": objects,
            "frame": {"slots_per_frame": 20, "frames": 1},
            "filter": {"velocity_prior": 30.0},
            "truth": {"process_noise": process_noise},
        }
    )
    result = eb.simulate(scenario, ["omni"], trials=20, seed=1)
    assert np.isfinite(eb.summary(result)["value"]).any()
    return with_bound(result, scenario)["bound"].values[0]


@pytest.mark.parametrize("process_noise", [False, True])
@pytest.mark.parametrize("detections", ["labelled", "unlabelled"])
@pytest.mark.slow
def test_an_object_that_appears_later_has_the_bound_of_one_that_was_there(
    detections, process_noise
):
    one = {"angle": 1.0, "velocity": 12.0}
    found = bound_of(
        [one, one | {"appears": 0.01 * LATER}, one | {"leaves": 0.01 * LATER}],
        detections, process_noise,
    )  # fmt: skip
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:LATER, 1]).all()
    assert np.isnan(found[LATER:, 2]).all()
    # With noise of nature's own the motion, and so the information, differs a little. Without
    # labels the streams are those of the tracks, and the angle's accuracy depends on them.
    rtol = 1e-9 if detections == "labelled" and not process_noise else 0.02
    first = 0 if detections == "labelled" else 1
    one, later, before = (found[..., column, first:] for column in range(3))
    np.testing.assert_allclose(later[LATER:], one[:-LATER], rtol=rtol)
    np.testing.assert_allclose(before[:LATER], one[:LATER], rtol=rtol)


@pytest.mark.slow
def test_an_object_that_is_measured_late_has_no_bound_until_then():
    """With noise of nature's own and nothing known, rounding leaves information below zero."""
    weak = Scenario.model_validate(
        {
            "name": "weak",
            "array": {"n_tx": 8},
            "radio": {"power": 1e6},
            "radar": {"detections": "unlabelled", "crb": "exact", "fluctuation": "swerling1"},
            "uav": {"height": 100.0, "speed": 15.0, "heading": 0.0},
            "objects": [
                {"angle": 1.0, "velocity": 12.0},
                {"angle": 0.21, "velocity": 25.0},  # beyond the longest delay
                {"angle": 2.9, "velocity": 29.0, "leaves": 0.03},
            ],
            "frame": {"slots_per_frame": 7, "frames": 4},
            "truth": {"process_noise": True},
        }
    )
    result = eb.simulate(weak, ["omni", "pilot-predict"], trials=4, seed=1)
    bound = with_bound(result, weak)["bound"].values
    assert np.isfinite(bound[0, -1, 0]).all()
    assert np.isnan(bound[:, :, 1]).all()
    assert len(eb.summary(result))
