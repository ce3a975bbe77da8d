"""The forecast picture: errors and promises of `forecast_errors`, from slots that all can use."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.plots import PlotError, forecast
from echobeam.simulation.forecast import forecast_errors

from .plot_dataset import build_result


@pytest.fixture(scope="module")
def scenario():
    return eb.load_scenario("paper-single", {"frame.frames": 3})


@pytest.fixture(scope="module")
def result(scenario):
    return eb.simulate(scenario, ["omni", "pilot-needle", "genie"], trials=25, seed=5)


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_lines_are_errors_and_promises_in_degrees_and_metres(result, scenario):
    axes = forecast.draw(result).axes
    found = forecast_errors(result, scenario, range(10, 11)).sel(scheme="omni")
    for one, quantity, factor in (
        (axes[0], "angle", 180 / np.pi),
        (axes[1], "position", 1.0),
    ):
        promised, errors = one.get_lines()
        np.testing.assert_array_equal(errors.get_xdata(), np.arange(1, 21))
        part = found.sel(quantity=quantity)
        np.testing.assert_allclose(errors.get_ydata(), factor * part["rmse"])
        np.testing.assert_allclose(promised.get_ydata(), factor * part["promised"])


def test_the_band_is_that_of_a_mean_square_of_so_many_degrees():
    band = forecast.promise_band(np.array([2.0, 3.0]), np.array([50.0, np.nan]))
    np.testing.assert_allclose(band[0], 2 * np.sqrt(stats.chi2.ppf([0.025, 0.975], 50) / 50))
    assert np.isnan(band[1]).all()


def test_an_honest_filter_is_inside_the_band_and_a_liar_is_not():
    """One forecast per track: each of 5 horizons is outside its band in 5 % of all runs.

    The seed is fixed; a tenfold variance is 15 standard deviations of the mean square away.
    """
    scenario = eb.load_scenario("paper-single", {"radio.power": 1e3, "truth.process_noise": True})
    result = eb.simulate(scenario, ["omni"], trials=200, seed=3)
    found = forecast_errors(result, scenario, range(5, 6)).sel(scheme="omni", quantity="angle")
    low, high = forecast.promise_band(found["promised"].values, found["degrees"].values).T
    rmse = found["rmse"].values
    assert ((low < rmse) & (rmse < high)).all()
    liar = result.copy(deep=True)
    liar["estimated_cov"] = liar["estimated_cov"] * 10
    lied = forecast_errors(liar, scenario, range(5, 6)).sel(scheme="omni", quantity="angle")
    low, _ = forecast.promise_band(lied["promised"].values, lied["degrees"].values).T
    assert (lied["rmse"].values < low).all()


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
    result = build_result(slots=slots, per_frame=per_frame, trials=1)
    scenario = eb.load_scenario("paper-multi", {"frame.slots_per_frame": per_frame})
    assert forecast.origins(result, scenario) == expected


def test_who_makes_no_forecast_is_named(result):
    legend = legend_of(forecast.draw(result))
    assert {"pilot-needle (no forecast)", "genie (no forecast)", "omni"} <= set(legend)


def test_the_title_says_where_the_forecasts_were_made(result):
    assert "forecasts made in slot 10" in forecast.draw(result).get_suptitle()


@pytest.mark.parametrize(
    ("result", "why"),
    [
        (build_result(slots=1, trials=1), "one slot: nothing lies ahead"),
        (build_result(angles=(), velocities=(), trials=1), "no objects to forecast"),
        (build_result(trials=1).assign_attrs(scenario="?"), "the result does not say its scenario"),
    ],
)
def test_why_there_is_nothing_to_see(result, why):
    assert [t.get_text() for axes in forecast.draw(result).axes for t in axes.texts] == [why]


def test_a_result_without_estimates_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no estimated"):
        forecast.draw(build_result().drop_vars(["estimated"]))
