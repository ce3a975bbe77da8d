"""The printed table's last lines: genie, bound and coverage probability, where known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import echobeam as eb
from echobeam.cli.report import far_field_warning, json_report, measured, text_report
from echobeam.simulation.decisions import DecisionTime
from echobeam.simulation.summary import summarise

SCENARIO = eb.load_scenario("paper-single")


@pytest.fixture(scope="module")
def result():
    return eb.simulate(
        SCENARIO, ["water-filling", "genie", "pilot-needle", "pilot-predict"], trials=10, seed=1
    )


def lines_of(result):
    text = text_report(result, SCENARIO, Path("r.nc"))
    return dict(line.split(": ", 1) for line in text.splitlines()[1:] if ": " in line)


def test_genie_bound_and_coverage_are_said_of_whom_they_are_defined_for(result):
    lines, figures = lines_of(result), summarise(result, SCENARIO)
    others = ("water-filling", "pilot-needle", "pilot-predict")
    shares = [f"{name} {100 * figures[name].frame_rate_over_genie:.3g} %" for name in others]
    assert lines["mean sum rate over the genie's"] == ", ".join(shares)
    means = {name: np.nanmean(figures[name].angle_over_bound) for name in (others[0], others[2])}
    (over,) = [v for k, v in lines.items() if k.startswith("angle RMSE over")]
    assert over == ", ".join(f"{name} {mean:.2f}" for name, mean in means.items())
    inside = lines["true angles in the covered interval (nominal 99.73 %)"]
    assert inside == f"pilot-predict {100 * figures['pilot-predict'].coverage:.4g} %"


def test_without_any_of_them_nothing_is_said(result):
    assert set(lines_of(result.sel(scheme=["pilot-needle"]))) == {"result"}


def test_what_is_not_defined_is_null_in_json(result):
    document = json.loads(json_report(result, SCENARIO, Path("r.nc")))
    held = document["schemes"]["pilot-needle"]
    assert held["angle_over_bound"] == [None] * 10
    assert np.isfinite(held["rate_over_genie"]).all()
    assert document["schemes"]["genie"]["frame_rate_over_genie"] == pytest.approx(1.0)
    assert document["decision_seconds"] is None


def test_times_of_decisions_stand_outside_the_schemes(result):
    taken = {"genie": DecisionTime(2.5e-4, 1.25e-3), "omni": DecisionTime(np.nan, np.nan)}
    document = json.loads(json_report(result, SCENARIO, Path("r.nc"), taken))
    assert document["decision_seconds"] == {
        "genie": {"mean": 2.5e-4, "p99": 1.25e-3}, "omni": {"mean": None, "p99": None},
    }  # fmt: skip
    assert "decision_seconds" not in document["schemes"]["genie"]
    (line,) = [x for x in text_report(result, SCENARIO, Path("r.nc"), taken).splitlines()
               if x.startswith("decision")]  # fmt: skip
    assert line.endswith("ms, mean (99th percentile): genie 0.25 (1.25)")


def test_an_array_whose_far_field_begins_behind_the_objects_is_warned_of():
    near = eb.load_scenario("paper-single", {"array.n_tx": 256, "radio.carrier": "28 GHz"})
    result = eb.simulate(near, ["water-filling"], trials=1)
    line = far_field_warning(result, near)
    assert "begins at 348 m" in line
    assert f"as near as {float(result.truth[..., 1].min()):.0f} m" in line
    assert far_field_warning(result, SCENARIO) is None


@pytest.mark.parametrize(
    ("mean", "low", "high", "text"),
    [
        (2.8312e-5, 2.7e-5, 2.96e-5, "(2.83 ± 0.13)e-05"),
        (0.0032424, 0.0031424, 0.0033424, "(3.24 ± 0.10)e-03"),
        (0.32424, 0.31424, 0.33424, "0.324 ± 0.010"),
        (12.3456, 12.2, 12.5, "12.35 ± 0.15"),
        (1234.5, 1134.5, 1334.5, "1234 ± 100"),
        (2e-5, -1e-5, 5e-5, "(2.0 ± 3.0)e-05"),
        (0.0, -0.1, 0.1, "0.00 ± 0.10"),
        (1.08014e-5, np.nan, np.nan, "1.08e-05"),
        (1.5, 1.5, np.nextafter(1.5, 2), "1.5"),
        (np.nan, np.nan, np.nan, "nan"),
    ],
)
def test_a_mean_has_the_digits_that_its_interval_supports(mean, low, high, text):
    assert measured(mean, (low, high)) == text
