"""The forecast figure: errors and statements of `forecast_errors`, from slots that all can use."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.plots import PlotError, Source
from echobeam.plots.forecast import origins, stated_band
from echobeam.simulation.forecast import forecast_errors

from .plot_dataset import build_result
from .plot_figures import figure_of, named, series_of, written


@pytest.fixture(scope="module")
def scenario():
    return eb.load_scenario("paper-single", {"frame.frames": 3})


@pytest.fixture(scope="module")
def result(scenario):
    return eb.simulate(scenario, ["omni", "pilot-needle", "genie"], trials=25, seed=5)


def test_lines_are_errors_and_statements_in_degrees_and_metres(result, scenario):
    panels = figure_of("forecast", result).panels
    found = forecast_errors(result, scenario, range(10, 11)).sel(scheme="omni")
    for panel, quantity, factor in zip(
        panels, ("angle", "position"), (180 / np.pi, 1.0), strict=False
    ):
        errors, stated = series_of(panel, "omni"), series_of(panel, "stated, omni")
        np.testing.assert_array_equal(errors.x, np.arange(1, 21))
        part = found.sel(quantity=quantity)
        np.testing.assert_allclose(errors.y, factor * part["rmse"])
        np.testing.assert_allclose(stated.y, factor * part["promised"])


def test_the_band_is_that_of_a_mean_square_of_so_many_degrees():
    band = stated_band(np.array([2.0, 3.0]), np.array([50.0, np.nan]))
    np.testing.assert_allclose(band[0], 2 * np.sqrt(stats.chi2.ppf([0.025, 0.975], 50) / 50))
    assert np.isnan(band[1]).all()


def test_a_consistent_filter_is_inside_the_band_and_a_wrong_one_is_not():
    """One forecast per track: each of 5 horizons is outside its band in 5 % of all runs.

    The seed is fixed; a tenfold variance is 15 standard deviations of the mean square away.
    """
    scenario = eb.load_scenario("paper-single", {"radio.power": 1e3, "truth.process_noise": True})
    result = eb.simulate(scenario, ["omni"], trials=200, seed=3)
    panel = figure_of("forecast", result).panels[0]
    rmse, (low, high) = series_of(panel, "omni").y, series_of(panel, "stated, omni").band.T
    assert ((low < rmse) & (rmse < high)).all()
    wrong = result.copy(deep=True)
    wrong["estimated_cov"] = wrong["estimated_cov"] * 10
    panel = figure_of("forecast", wrong).panels[0]
    assert (series_of(panel, "omni").y < series_of(panel, "stated, omni").band[:, 0]).all()


@pytest.mark.parametrize(
    ("slots", "per_frame", "expected"),
    [
        (10, 10, range(5, 6)),
        (30, 10, range(10, 11)),
        (100, 10, range(10, 51)),
        (2, 10, range(1, 2)),
        (50, 50, range(25, 26)),
    ],
)
def test_forecasts_begin_when_velocities_are_known_and_leave_room(slots, per_frame, expected):
    assert origins(Source(build_result(slots=slots, per_frame=per_frame, trials=1))) == expected


def test_who_makes_no_forecast_is_named(result):
    assert {"pilot-needle (none)", "genie (none)", "omni"} <= set(
        named(figure_of("forecast", result))
    )


def test_the_setting_says_where_the_forecasts_were_made(result):
    assert "forecasts made in slot 10" in figure_of("forecast", result).setting


@pytest.mark.parametrize(
    ("result", "why"),
    [
        (build_result(slots=1, trials=1), "one slot: nothing lies ahead"),
        (build_result(angles=(), velocities=(), trials=1), "no objects to forecast"),
    ],
)
def test_why_there_is_nothing_to_see(result, why):
    assert written(figure_of("forecast", result)) == [why]


def test_a_result_without_estimates_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no estimated"):
        figure_of("forecast", build_result().drop_vars(["estimated"]))
