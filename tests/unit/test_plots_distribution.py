"""Distributions: empirical distribution functions of the samples written out."""

from __future__ import annotations

import numpy as np
from scipy import stats

from .plot_dataset import build_result
from .plot_figures import figure_of, series_of


def check_against(one, samples):
    """Compare with scipy's empirical distribution at the places drawn."""
    found = stats.ecdf(np.asarray(samples).ravel()).cdf
    np.testing.assert_allclose(one.y, found.evaluate(one.x), atol=1e-12)


def test_rates_are_those_of_frames_over_all_trials():
    result = build_result(slots=30, trials=7)
    rate = result["rate"].sel(scheme="temporal").fillna(0.0).sum("object")
    frames = rate.transpose("trial", "slot").values.reshape(7, 3, 10).mean(axis=-1)
    check_against(series_of(figure_of("distribution", result).panels[0], "temporal"), frames)


def test_angle_errors_are_sizes_in_degrees_and_lost_objects_leave_the_curve_below_one():
    result = build_result(trials=10)
    off = np.degrees(abs((result["estimated"] - result["truth"]).sel(state="angle")))
    panel = figure_of("distribution", result).panels[1]
    check_against(series_of(panel, "temporal"), off.sel(scheme="temporal").values)
    result["estimated"].loc[{"trial": 0}] = np.nan
    lost = series_of(figure_of("distribution", result).panels[1], "temporal")
    np.testing.assert_allclose(lost.y[-1], 0.9)


def test_outage_counts_objects_in_slots_with_beams():
    result = build_result(trials=5)
    panel = figure_of("distribution", result).panels[2]
    rate = result["rate"].sel(scheme="pilot").transpose("trial", "slot", "object").values[:, 1:]
    check_against(series_of(panel, "pilot"), rate)
    assert series_of(figure_of("distribution", build_result(("omni",))).panels[2], "omni").empty


def test_the_floor_of_a_design_is_marked():
    result = build_result(trials=2)
    assert not figure_of("distribution", result).panels[2].guides
    result.attrs["scenario"] += "min_rate = 4e-4\n"
    (guide,) = figure_of("distribution", result).panels[2].guides
    assert guide.at == 4e-4
