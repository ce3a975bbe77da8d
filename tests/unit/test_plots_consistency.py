"""The consistency picture: what it draws is the summary, its bands are the laws, gaps are said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.plots import PlotError, consistency
from echobeam.simulation.summary import ratio_of_means, summarise

from .plot_dataset import build_result

SCHEMES = ("omni", "water-filling", "pilot-needle", "genie", "temporal")
NEES, NIS, INSIDE, ANGLE, DISTANCE, RATE = range(6)


@pytest.fixture(scope="module")
def scenario():
    # with the known variance no track is lost, and the numbers of errors are round
    return eb.load_scenario("paper-multi", {"frame.frames": 2, "radar.variance": "known"})


@pytest.fixture(scope="module")
def result(scenario):
    return eb.simulate(scenario, SCHEMES, trials=20, seed=5)


def line_of(axes, name):
    found = [line for line in axes.get_lines() if line.get_label() == name]
    return found[0].get_ydata() if found else None


def line_colour(axes, name):
    return next(line.get_color() for line in axes.get_lines() if line.get_label() == name)


def band_of(axes):
    """Return the limits of a panel's grey band at each slot's centre."""
    (grey,) = [c for c in axes.collections if np.allclose(c.get_facecolor()[0][:3], 0.78)]
    path = grey.get_paths()[0].vertices
    return path[:, 1].min(), path[:, 1].max()


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_curves_are_the_figures_of_the_summary(result, scenario):
    axes = consistency.draw(result).axes
    for name, figures in summarise(result, scenario).items():
        for panel, values in (
            (NEES, figures.nees),
            (NIS, figures.nis),
            (ANGLE, figures.angle_over_bound),
            (DISTANCE, figures.distance_over_bound),
        ):
            drawn = line_of(axes[panel], name)
            if np.isfinite(values).any():
                np.testing.assert_allclose(drawn, values, rtol=1e-12)
            else:
                assert drawn is None
                assert name in axes[panel].get_title()
        if name != "genie":
            np.testing.assert_allclose(line_of(axes[RATE], name), figures.rate_over_genie)


def test_bands_are_those_of_chi_square_means_over_trials_and_objects(result):
    """20 trials, 2 objects: 40 errors of 3 components, 120 measured components."""
    figure = consistency.draw(result)
    expected = stats.chi2.ppf([0.025, 0.975], 120)
    np.testing.assert_allclose(band_of(figure.axes[NEES]), expected / 40)
    np.testing.assert_allclose(band_of(figure.axes[NIS]), expected / 120)
    assert any("NEES 120, NIS 120 degrees of freedom" in text for text in legend_of(figure))


def test_the_share_inside_is_held_against_what_three_sigma_promise(result):
    axes = consistency.draw(result).axes[INSIDE]
    (line,) = [line for line in axes.get_lines() if line.get_label().startswith("_")]
    assert line.get_ydata()[0] == pytest.approx(99.73002, abs=1e-5)
    low, high = stats.binom.ppf([0.025, 0.975], 40, 0.9973002) / 40
    np.testing.assert_allclose(band_of(axes), (100 * low, 100 * high))
    drawn = line_of(axes, "temporal")
    assert np.isnan(drawn[[0, 10]]).all()  # omnidirectional slots cover everything
    assert line_of(axes, "water-filling") is None  # it covers nothing


def test_variants_of_other_widths_are_each_held_against_their_own_promise():
    names = ["temporal", "temporal:width=1", "temporal:width=2"]
    result = build_result(names, trials=10)
    axes = consistency.draw(result).axes[INSIDE]
    assert axes.get_title() == "Inside the cover (%)"
    promised = [line for line in axes.get_lines() if line.get_label().startswith("_")]
    expected = 100 * (2 * stats.norm.cdf([3, 1, 2]) - 1)
    np.testing.assert_allclose([line.get_ydata()[0] for line in promised], expected)
    colours = [line_colour(axes, name) for name in names]
    assert [line.get_color() for line in promised] == colours
    assert axes.get_ylim()[0] < expected.min()
    alone = consistency.draw(result.sel(scheme=["temporal:width=2"])).axes[INSIDE]
    assert alone.get_title() == "Inside ±2σ (%)"


def test_innovations_have_gaps_where_known_objects_are_not_measured(result):
    drawn = line_of(consistency.draw(result).axes[NIS], "water-filling")
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(drawn)), [0, 10])


def test_the_rates_interval_is_that_of_paired_ratios(result):
    rate = result["rate"].sum("object")
    value, interval = ratio_of_means(
        rate.sel(scheme="water-filling", slot=4).values, rate.sel(scheme="genie", slot=4).values
    )
    axes = consistency.draw(result).axes[RATE]
    assert line_of(axes, "water-filling")[3] == pytest.approx(value)
    heights = axes.collections[1].get_paths()[0].vertices
    at = np.unique(np.round(heights[heights[:, 0] == 4.0][:, 1], 12))
    np.testing.assert_allclose(at, interval, atol=1e-11)


def test_what_is_not_there_is_said(result):
    without = result.sel(scheme=["pilot-needle"])
    figure = consistency.draw(without)
    notes = [[text.get_text() for text in axes.texts] for axes in figure.axes]
    assert notes[NEES] == []
    assert notes[NIS] == ["no prediction was measured"]
    assert notes[INSIDE] == ["nothing covered"]
    assert notes[ANGLE] == ["no bound: \nnothing is predicted"]
    assert notes[RATE] == ["no genie among\nthe schemes"]


def test_traces_have_no_bound():
    result = eb.simulate(eb.load_scenario("traffic", {"frame.frames": 2}), ["omni"], trials=2)
    axes = consistency.draw(result).axes
    assert axes[ANGLE].texts[0].get_text() == "no bound: the objects of\na trace come and go"


def test_a_long_run_is_shown_by_frames():
    """NEES by frame is the mean over the frame's errors; its band that of one slot."""
    result = build_result(("temporal", "omni"), slots=80, trials=6, per_frame=10)
    figure = consistency.draw(result)
    x = next(line for line in figure.axes[NEES].get_lines() if line.get_label() == "temporal")
    np.testing.assert_allclose(x.get_xdata(), 5.5 + 10 * np.arange(8))
    error = (result["estimated"] - result["truth"]).sel(scheme="temporal")
    cov = result["estimated_cov"].sel(scheme="temporal").values
    square = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)
    expected = square.mean(axis=(0, 2)).reshape(8, 10).mean(axis=1)
    np.testing.assert_allclose(x.get_ydata(), expected, rtol=1e-6)
    np.testing.assert_allclose(band_of(figure.axes[NEES]), stats.chi2.ppf([0.025, 0.975], 36) / 12)


def test_a_filter_that_lies_is_seen_outside_its_band(result):
    """The same errors with a quarter of the covariance: four times the NEES."""
    liar = result.copy(deep=True)
    liar["estimated_cov"] = liar["estimated_cov"] / 4
    _, high = band_of(consistency.draw(liar).axes[NEES])
    honest = line_of(consistency.draw(result).axes[NEES], "omni")
    drawn = line_of(consistency.draw(liar).axes[NEES], "omni")
    np.testing.assert_allclose(drawn, 4 * honest)
    assert (drawn > high).all()


def test_an_incomplete_result_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no measured_var, fallback"):
        consistency.draw(build_result().drop_vars(["measured_var", "fallback"]))
