import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.simulation.bound import with_bound
from echobeam.simulation.summary import improvement, mean_interval, ratio_of_means, summarise

SCENARIO = eb.load_scenario("paper-multi")


@pytest.fixture(scope="module")
def result():
    return eb.simulate("paper-multi", ["water-filling", "omni", "pilot-needle"], trials=60, seed=11)


def test_means_and_intervals_are_students(result):
    figures = summarise(result, SCENARIO)["water-filling"]
    total = result["rate"].sel(scheme="water-filling").sum("object").values
    np.testing.assert_allclose(figures.rate_mean, total.mean(axis=0))
    for slot in (1, 5):
        known = stats.t.interval(0.95, 59, total[:, slot].mean(), stats.sem(total[:, slot]))
        np.testing.assert_allclose(figures.rate_interval[slot], known)
    assert figures.frame_rate_q05 == pytest.approx(np.quantile(total.mean(axis=1), 0.05))


def test_chunks_do_not_change_a_summary(result, monkeypatch):
    whole = summarise(result, SCENARIO)
    monkeypatch.setattr("echobeam.simulation.summary.CHUNK", 7)
    parts = summarise(result, SCENARIO)
    for name, figures in whole.items():
        np.testing.assert_allclose(parts[name].angle_rmse, figures.angle_rmse, rtol=1e-12)
        np.testing.assert_equal(parts[name].outage, figures.outage)
        np.testing.assert_allclose(parts[name].nis, figures.nis, rtol=1e-12)


def test_outage_counts_objects_below_their_floor(result):
    rate = result["rate"].sel(scheme="water-filling").isel(slot=slice(1, None)).values
    assert summarise(result, SCENARIO)["water-filling"].outage == pytest.approx(
        (rate < 4e-4).mean()
    )


def test_the_interval_of_a_ratio_covers_it():
    """Of 400 intervals at 95 % the true ratio is in 380 on average; 5 sigma is 22."""
    generator = np.random.default_rng(3)
    hits = 0
    for _ in range(400):
        common = generator.normal(10, 1, 100)
        above, below = 2 * common + generator.normal(0, 2, 100), common
        low, high = ratio_of_means(above, below)[1]
        hits += low <= 2.0 <= high
    assert abs(hits - 380) < 22


def test_the_mean_of_one_sample_has_no_interval():
    mean, interval = mean_interval(np.array([[1.0, 2.0]]))
    np.testing.assert_array_equal(mean, [1, 2])
    assert np.isnan(interval).all()


def test_improvement_needs_both_schemes(result):
    assert improvement(result) is None
    found = improvement(result, "water-filling", "pilot-needle")
    assert found is not None
    rates = result["rate"].sum("object").mean("trial").sel(slot=6)
    ratio = rates.sel(scheme="water-filling") / rates.sel(scheme="pilot-needle")
    assert found.ratio == pytest.approx(float(ratio))
    assert found.interval[0] < found.ratio < found.interval[1]


def test_no_filter_beats_the_posterior_bound():
    """An RMSE over 200 errors is within 5 sigma, 5 / sqrt(400), of what it estimates."""
    scenario = eb.load_scenario("paper-single")
    result = eb.simulate(scenario, ["omni", "pilot-needle"], trials=200, seed=4)
    bound = with_bound(result, scenario)["bound"]
    error = (result["estimated"] - result["truth"]).sel(scheme="omni", state=["angle", "distance"])
    rmse = np.sqrt((error**2).mean("trial")).values
    limit = bound.sel(scheme="omni", state=["angle", "distance"]).values
    assert (rmse > limit * (1 - 5 / np.sqrt(400))).all()
    assert (rmse < limit * 1.5).all()
    assert np.isnan(bound.sel(scheme="pilot-needle").values).all()


def test_an_honest_filter_is_found_honest():
    """On a matched model NEES and NIS meet their laws.

    One slot's NEES is the mean of 600 independent chi-squares of 3 (5 sigma: 0.5), its NIS of
    1800 of 1 (5 sigma: 0.17).
    """
    honest = eb.load_scenario("paper-single", {"radio.power": 1000.0, "truth.process_noise": True})
    result = eb.simulate(honest, ["omni"], trials=600, seed=8)
    figures = summarise(result, honest)["omni"]
    assert (np.abs(figures.nees[1:] - 3) < 5 * np.sqrt(6 / 600)).all()
    assert (np.abs(figures.nis[1:] - 1) < 5 * np.sqrt(2 / 1800)).all()


def test_the_coverage_counts_true_angles_inside_the_covered_interval(result):
    """Counted once more, trial by trial and slot by slot."""
    found = result.sel(scheme="water-filling")
    inside = asked = 0
    for trial in range(60):
        for k in range(2):
            for slot in range(1, 10):
                spread = np.sqrt(found["measured_var"].values[trial, :slot, k, 0])
                seen = spread[np.isfinite(spread)]
                prior = found["predicted"].values[trial, slot, k, 0]
                if seen.size == 0 or not np.isfinite(prior):
                    continue
                half = min(3 * seen[-1], np.pi / 4)
                asked += 1
                inside += abs(prior - result["truth"].values[trial, slot, k, 0]) <= half
    assert summarise(result, SCENARIO)["water-filling"].coverage == pytest.approx(inside / asked)
