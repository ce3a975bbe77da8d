"""Intervals of the summary: against scipy, a bootstrap and the law they are made for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.simulation.quantities import scalars
from echobeam.simulation.summary import summarise

from .plot_dataset import build_result

TRIALS = 60


@pytest.fixture(scope="module")
def result():
    return eb.simulate("paper-multi", ["temporal", "genie"], trials=TRIALS, seed=2)


@pytest.fixture(scope="module")
def figures(result):
    return summarise(result, eb.load_scenario("paper-multi"))


def resampled(result, statistic, count=2000):
    """Return the 95 % interval of a statistic by a bootstrap over trials."""
    rng = np.random.default_rng(1)
    values = [
        statistic(rng.integers(0, result.sizes["trial"], result.sizes["trial"]))
        for _ in range(count)
    ]
    return np.quantile(values, [0.025, 0.975])


@pytest.mark.slow
def test_every_figure_of_the_whole_run_has_an_interval_around_it(figures):
    for figure in figures.values():
        assert set(figure.intervals) == set(scalars(unlabelled=False))
        for name, (low, high) in figure.intervals.items():
            value = getattr(figure, name)
            assert np.isnan(value) or low <= value <= high, name


def test_the_mean_rate_has_students_interval(result, figures):
    rate = result["rate"].sel(scheme="temporal").sum("object").mean("slot").values
    expected = stats.t.interval(0.95, TRIALS - 1, rate.mean(), stats.sem(rate))
    np.testing.assert_allclose(figures["temporal"].intervals["frame_rate_mean"], expected)


@pytest.mark.parametrize(
    ("name", "component"), [("frame_angle_rmse", "angle"), ("frame_distance_rmse", "distance")]
)
def test_errors_over_all_slots_have_the_interval_of_a_bootstrap(result, figures, name, component):
    off = (result["estimated"].sel(scheme="temporal") - result["truth"]).sel(state=component)
    off = off.transpose("trial", "slot", "object").values
    figure = figures["temporal"]
    assert getattr(figure, name) == pytest.approx(np.sqrt(np.nanmean(off**2)))
    expected = resampled(result, lambda drawn: np.sqrt(np.nanmean(off[drawn] ** 2)))
    # a bootstrap of 60 skewed samples and the delta method agree within a fifth of the width
    width = expected[1] - expected[0]
    np.testing.assert_allclose(figure.intervals[name], expected, atol=0.2 * width)


def test_outage_has_the_interval_of_a_bootstrap(result, figures):
    floor = eb.load_scenario("paper-multi").coverage.min_rate
    rate = result["rate"].sel(scheme="temporal").transpose("trial", "slot", "object").values
    below = rate[:, 1:] < floor
    figure = figures["temporal"]
    assert figure.outage == pytest.approx(below.mean())
    expected = resampled(result, lambda drawn: below[drawn].mean())
    width = expected[1] - expected[0]
    np.testing.assert_allclose(figure.intervals["outage"], expected, atol=0.15 * width)


def test_a_share_of_none_or_all_has_clopper_and_pearsons_bound():
    result = build_result(("temporal",), trials=20)
    figure = summarise(result, eb.load_scenario("paper-multi"))["temporal"]
    exact = stats.binomtest(0, 20).proportion_ci(0.95, method="exact").high
    assert figure.lost == 0.0
    assert figure.intervals["lost"] == pytest.approx((0.0, exact))


@pytest.mark.slow
def test_the_quantiles_interval_holds_the_true_quantile_in_95_per_cent():
    """Binomial: 19 of 20 intervals on average; the limits are met in 99.9 % of all seeds."""
    scenario = eb.load_scenario("paper-multi")
    base = build_result(("genie",), trials=200)
    rng = np.random.default_rng(3)
    hits = 0
    for _ in range(60):
        own = base.copy(deep=True)
        own["rate"].values[:] = 0.5 * rng.exponential(size=(1, 200, 1, 1))
        low, high = summarise(own, scenario)["genie"].intervals["frame_rate_q05"]
        hits += low <= -np.log(0.95) <= high
    assert stats.binom.ppf(0.0005, 60, 0.93) <= hits <= 60


def test_one_trial_has_no_intervals():
    figure = summarise(build_result(("temporal",), trials=1), eb.load_scenario("paper-multi"))
    for name, ends in figure["temporal"].intervals.items():
        assert np.isnan(ends).all() or name in ("lost", "outage", "coverage"), name


@pytest.mark.parametrize(("hit", "trials"), [(0, 20), (1, 20), (20, 20)])
def test_a_number_of_fallbacks_has_an_interval_of_possible_numbers(hit, trials):
    """Of trials that fall back in all their slots or in none, as a binomial share."""
    result = build_result(("temporal",), trials=trials)
    slots = result.sizes["slot"]
    result["fallback"].values[:] = False
    result["fallback"].values[:, :hit] = True
    figure = summarise(result, eb.load_scenario("paper-multi"))["temporal"]
    low, high = figure.intervals["fallbacks"]
    assert figure.fallbacks == hit * slots
    assert 0 <= low <= figure.fallbacks <= high <= trials * slots
    if hit in (0, trials):
        exact = stats.binomtest(hit, trials).proportion_ci(0.95, method="exact")
        assert (low, high) == pytest.approx(
            (exact.low * trials * slots, exact.high * trials * slots)
        )
    else:
        share = np.r_[np.ones(hit), np.zeros(trials - hit)] * slots
        upper = stats.t.interval(0.95, trials - 1, share.mean(), stats.sem(share))[1]
        assert high == pytest.approx(upper * trials)
