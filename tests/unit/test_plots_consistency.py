"""The consistency figure: it draws the summary, its bands are the laws, gaps are said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.estimation.intervals import ratio_of_means
from echobeam.plots import PlotError
from echobeam.simulation.summary import summarise

from .plot_dataset import build_result
from .plot_figures import figure_of, series_of

SCHEMES = ("omni", "water-filling", "pilot-needle", "genie", "temporal")


@pytest.fixture(scope="module")
def scenario():
    # with the known variance no track is lost, and the numbers of errors are round
    return eb.load_scenario("paper-multi", {"frame.frames": 2, "radar.variance": "known"})


@pytest.fixture(scope="module")
def result(scenario):
    return eb.simulate(scenario, SCHEMES, trials=20, seed=5)


def panels_of(result):
    return {panel.y.name: panel for panel in figure_of("consistency", result).panels}


def band_of(panel):
    ends = series_of(panel, "95 % band").band
    return np.nanmin(ends), np.nanmax(ends)


def test_curves_are_the_figures_of_the_summary(result, scenario):
    panels = panels_of(result)
    for name, figures in summarise(result, scenario).items():
        for panel, values in (
            ("NEES", figures.nees),
            ("NIS per component", figures.nis),
            ("Angle RMSE / bound", figures.angle_over_bound),
            ("Distance RMSE / bound", figures.distance_over_bound),
            ("Sum rate / genie's", figures.rate_over_genie if name != "genie" else np.nan),
        ):
            drawn = series_of(panels[panel], name)
            if np.isfinite(values).any():
                np.testing.assert_allclose(drawn.y, values, rtol=1e-12)
            else:
                assert drawn is None


def test_bands_are_those_of_chi_square_means_over_trials_and_objects(result):
    """20 trials, 2 objects: 40 errors of 3 components, 120 measured components."""
    panels = panels_of(result)
    expected = stats.chi2.ppf([0.025, 0.975], 120)
    np.testing.assert_allclose(band_of(panels["NEES"]), expected / 40)
    np.testing.assert_allclose(band_of(panels["NIS per component"]), expected / 120)


def test_the_share_inside_is_held_against_that_of_three_sigma(result):
    panel = panels_of(result)["Inside ±3σ"]
    assert panel.guides[-1].at == pytest.approx(99.73002, abs=1e-5)
    low, high = stats.binom.ppf([0.025, 0.975], 40, 0.9973002) / 40
    np.testing.assert_allclose(band_of(panel), (100 * low, 100 * high))
    drawn = series_of(panel, "temporal").y
    assert np.isnan(drawn[[0, 10]]).all()  # omnidirectional slots cover everything
    assert series_of(panel, "water-filling") is None  # it covers nothing


def test_variants_of_other_widths_are_each_held_against_their_own_share():
    names = ["temporal", "temporal:width=1", "temporal:width=2"]
    result = build_result(names, trials=10)
    panel = panels_of(result)["Inside the cover"]
    expected = 100 * (2 * stats.norm.cdf([3, 1, 2]) - 1)
    own = [guide for guide in panel.guides if guide.to is None]
    np.testing.assert_allclose([guide.at for guide in own], expected)
    colours = [series_of(panel, name).look.colour for name in names]
    assert [guide.look.colour for guide in own] == colours
    assert panel.y.limits[0] < expected.min()
    assert "Inside ±2σ" in panels_of(result.sel(scheme=["temporal:width=2"]))


def test_innovations_have_gaps_where_known_objects_are_not_measured(result):
    drawn = series_of(panels_of(result)["NIS per component"], "water-filling").y
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(drawn)), [0, 10])


def test_the_rates_interval_is_that_of_paired_ratios(result):
    rate = result["rate"].sum("object")
    value, interval = ratio_of_means(
        rate.sel(scheme="water-filling", slot=4).values, rate.sel(scheme="genie", slot=4).values
    )
    drawn = series_of(panels_of(result)["Sum rate / genie's"], "water-filling")
    assert drawn.y[3] == pytest.approx(value)
    np.testing.assert_allclose(drawn.band[3], interval)


def test_what_is_not_there_has_no_panel_and_is_said(result):
    data = figure_of("consistency", result.sel(scheme=["pilot-needle"]))
    assert [panel.y.name for panel in data.panels] == ["NEES"]
    assert data.caption == (
        "not shown: NIS per component: no prediction was measured; Inside ±3σ: no beam has a "
        "cover; Angle RMSE / bound: nothing is predicted; Distance RMSE / bound: nothing is "
        "predicted; Sum rate / genie's: no genie among the schemes"
    )


def test_traces_have_no_bound():
    result = eb.simulate(eb.load_scenario("traffic", {"frame.frames": 2}), ["omni"], trials=2)
    data = figure_of("consistency", result)
    assert "Angle RMSE / bound: the objects of a trace come and go" in data.caption


def test_a_long_run_is_shown_by_frames():
    """NEES by frame is the mean over the frame's errors; its band that of one slot."""
    result = build_result(("temporal", "omni"), slots=80, trials=6, per_frame=10)
    panel = panels_of(result)["NEES"]
    drawn = series_of(panel, "temporal")
    np.testing.assert_allclose(drawn.x, 5.5 + 10 * np.arange(8))
    error = (result["estimated"] - result["truth"]).sel(scheme="temporal")
    cov = result["estimated_cov"].sel(scheme="temporal").values
    square = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)
    expected = square.mean(axis=(0, 2)).reshape(8, 10).mean(axis=1)
    np.testing.assert_allclose(drawn.y, expected, rtol=1e-6)
    np.testing.assert_allclose(band_of(panel), stats.chi2.ppf([0.025, 0.975], 36) / 12)


def test_a_filter_with_too_small_a_covariance_is_seen_outside_its_band(result):
    """The same errors with a quarter of the covariance: four times the NEES."""
    wrong = result.copy(deep=True)
    wrong["estimated_cov"] = wrong["estimated_cov"] / 4
    panel = panels_of(wrong)["NEES"]
    right = series_of(panels_of(result)["NEES"], "omni").y
    drawn = series_of(panel, "omni").y
    np.testing.assert_allclose(drawn, 4 * right)
    assert (drawn > band_of(panel)[1]).all()


def test_an_incomplete_result_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no measured_var, fallback"):
        figure_of("consistency", build_result().drop_vars(["measured_var", "fallback"]))
