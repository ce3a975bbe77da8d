import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.estimation.bound import posterior_bound
from echobeam.estimation.intervals import mean_interval, ratio_of_means
from echobeam.simulation.bound import BOUND_NEEDS, bound_of, bound_terms, with_bound
from echobeam.simulation.summary import improvement, summarise
from echobeam.tracking.evolution import evolution_jacobian
from echobeam.tracking.measurement import measurement_jacobian

SCENARIO = eb.load_scenario("paper-multi")
MATCHED = {
    "radio.power": 1000.0,
    "radar.variance": "known",
    "objects.0.acceleration": 0.0,
    "filter.angle_std": 0.0,
    "filter.distance_std": 0.0,
    "filter.velocity_std": 0.0,
    "filter.evolution": "exact",
}
"""A filter that believes in nature's own motion: constant velocity, no noise."""


@pytest.fixture(scope="module")
def result():
    return eb.simulate(
        "paper-multi",
        ["water-filling", "omni", "pilot-needle", "pilot-predict"],
        trials=30,
        seed=11,
    )


@pytest.mark.slow
def test_means_and_intervals_are_students(result):
    figures = summarise(result, SCENARIO)["water-filling"]
    total = result["rate"].sel(scheme="water-filling").sum("object").values
    np.testing.assert_allclose(figures.rate_mean, total.mean(axis=0))
    for slot in (1, 5):
        known = stats.t.interval(0.95, 29, total[:, slot].mean(), stats.sem(total[:, slot]))
        np.testing.assert_allclose(figures.rate_interval[slot], known)
    assert figures.frame_rate_q05 == pytest.approx(np.quantile(total.mean(axis=1), 0.05))


def test_intervals_of_rates_are_cut_at_zero(result):
    """One of two trials has no rate: Student's interval would reach far below."""
    two = result.isel(trial=[0, 1]).copy(deep=True)
    two["rate"].loc[{"trial": two["trial"][1]}] = 0.0
    figures = summarise(two, SCENARIO)["water-filling"]
    assert figures.rate_interval[:, 0].tolist() == [0.0] * 10
    assert figures.intervals["frame_rate_mean"][0] == 0.0
    assert (figures.rate_interval[:, 1] > figures.rate_mean).all()


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


@pytest.mark.slow
def test_a_prediction_has_no_bound():
    """Dead reckoning measures in the first slot of a frame; what follows is no measurement's."""
    scenario = eb.load_scenario("paper-multi", {"frame.frames": 2, "coverage.min_rate": 0.0})
    run = eb.simulate(scenario, ["pilot-predict", "omni"], trials=4, seed=4)
    bound = with_bound(run, scenario)["bound"]
    found = np.isfinite(bound.sel(scheme="pilot-predict").values).all(axis=(1, 2))
    assert (np.flatnonzero(found) == [0, 10]).all()
    assert np.isfinite(bound.sel(scheme="omni").values).all()
    ratio = summarise(run, scenario)["pilot-predict"].angle_over_bound
    np.testing.assert_array_equal(np.isfinite(ratio), found)


def test_the_bound_of_unlabelled_detections_is_that_of_the_trials_with_a_track():
    """The second object is found in two of six trials: its bound is that of these alone."""
    scenario = eb.load_scenario("paper-multi", {"filter.velocity_prior": 0.0})
    run = eb.simulate(scenario, ["omni"], trials=6, seed=3)
    run["true_var"].values[:, 2:, :, 1] = np.inf
    run["estimated"].values[:, 2:, :, 1] = np.nan
    bound = with_bound(run, scenario.replace({"radar.detections": "unlabelled"}))["bound"]
    expected = with_bound(run.isel(trial=[0, 1]), scenario)["bound"]
    np.testing.assert_allclose(bound[..., 1, :], expected[..., 1, :], rtol=1e-9)
    all_trials = with_bound(run, scenario)["bound"]
    np.testing.assert_allclose(bound[..., 0, :], all_trials[..., 0, :], rtol=1e-12)
    run["estimated"].values[..., 1, :] = np.nan
    found = with_bound(run, scenario.replace({"radar.detections": "unlabelled"}))["bound"]
    assert np.isnan(found[..., 1, :]).all()


def test_errors_over_the_bound_are_errors_over_the_bound(result):
    """Against the two curves of the tracking picture, which share the weights of the objects."""
    figures = summarise(result, SCENARIO)
    bound = with_bound(result, SCENARIO)["bound"]
    error = result["estimated"] - result["truth"]
    for name, state in (("angle_over_bound", "angle"), ("distance_over_bound", "distance")):
        square = (error.sel(state=state, scheme="omni") ** 2).mean(("trial", "object"))
        least = (bound.sel(state=state, scheme="omni") ** 2).mean("object")
        known = np.sqrt(square / least)
        np.testing.assert_allclose(getattr(figures["omni"], name), known, rtol=1e-9)
        assert np.isnan(getattr(figures["pilot-needle"], name)).all()


def _some(arrays, cut):
    """Some trials of a bound's arrays."""
    trial = {"truth": 0, "true_var": 1, "predicted_cov": 1, "estimated": 1}
    return {
        name: values[(slice(None),) * trial[name] + (cut,)] if name in trial else values
        for name, values in arrays.items()
    }


def road_noise(scenario):
    """Q of noise along the road, from the objects' motion without noise, (slot, object, 3, 3)."""
    s1, s2, s3 = scenario.truth_stds
    noise = np.zeros((scenario.n_slots - 1, 2, 3, 3))
    for slot in range(scenario.n_slots - 1):
        time, height = 0.01 * slot, 100.0 - 0.15 * slot
        for k, item in enumerate(scenario.objects):
            x = 100.0 / np.tan(item.angle) + item.velocity * time + item.acceleration * time**2 / 2
            d2 = x**2 + height**2
            gradient = np.array([-height / d2, x / np.sqrt(d2), 0.0])  # of angle and distance by x
            information = gradient[0] ** 2 / s1**2 + gradient[1] ** 2 / s2**2
            noise[slot, k] = np.outer(gradient, gradient) / information
            noise[slot, k, 2, 2] = s3**2
    return noise


def test_a_bound_is_the_same_from_sums_over_blocks_as_from_all_trials_at_once():
    """Sums of two blocks, with scattered truths, against the centred recursion on all of them."""
    scenario = eb.load_scenario(
        "paper-multi", {"radio.power": 1000.0, "truth.process_noise": True, "frame.frames": 2}
    )
    result = eb.simulate(scenario, ["omni"], trials=9, seed=2)
    arrays = {name: result[name].values for name in BOUND_NEEDS}
    halves = [bound_terms(_some(arrays, cut), scenario) for cut in (slice(0, 4), slice(4, 9))]
    from_sums = bound_of(
        {name: (halves[0][name] + halves[1][name])[0] for name in halves[0]}, scenario
    )
    flown = np.full((20, 1), 15.0), np.full((20, 1), -np.pi / 2)
    G = evolution_jacobian(
        arrays["truth"][:, :-1], flown[0][:-1], flown[1][:-1], scenario.frame.slot, "exact"
    )
    H = measurement_jacobian(arrays["truth"], *flown, scenario.radio.carrier)
    at_once = posterior_bound(G, road_noise(scenario), H, arrays["true_var"][0])
    expected = np.sqrt(np.diagonal(at_once, axis1=-2, axis2=-1))
    np.testing.assert_allclose(from_sums, expected, rtol=1e-6)
    np.testing.assert_allclose(with_bound(result, scenario)["bound"].values[0], from_sums)


def test_rates_over_the_genies_are_ratios_of_means():
    result = eb.simulate("paper-single", ["genie", "omni", "water-filling"], trials=12, seed=5)
    figures = summarise(result, eb.load_scenario("paper-single"))
    rate = result["rate"].sum("object").mean("trial")
    for name in ("omni", "water-filling"):
        expected = rate.sel(scheme=name) / rate.sel(scheme="genie")
        np.testing.assert_allclose(figures[name].rate_over_genie, expected)
        assert figures[name].frame_rate_over_genie == pytest.approx(
            float(rate.sel(scheme=name).mean() / rate.sel(scheme="genie").mean())
        )
        assert figures[name].frame_rate_over_genie < 1
    np.testing.assert_allclose(figures["genie"].rate_over_genie, 1.0)
    assert np.isnan(figures["genie"].angle_over_bound).all()  # it needs no measurement


def test_without_a_genie_nothing_is_over_it(result):
    figures = summarise(result, SCENARIO)["omni"]
    assert np.isnan(figures.rate_over_genie).all()
    assert np.isnan(figures.frame_rate_over_genie)


def test_no_objects_have_figures_that_are_not_numbers():
    scenario = eb.load_scenario("paper-single").replace({"objects": []})
    result = eb.simulate(scenario, ["omni", "genie"], trials=2)
    figures = summarise(result, scenario)["omni"]
    for name in ("angle_rmse", "angle_over_bound", "distance_over_bound", "nees", "nis"):
        assert np.isnan(getattr(figures, name)).all()
    assert np.isnan(figures.rate_over_genie).all()
    np.testing.assert_array_equal(figures.rate_mean, 0.0)


def test_the_objects_of_a_trace_have_no_bound():
    scenario = eb.load_scenario("traffic", {"frame.frames": 2})
    result = eb.simulate(scenario, ["omni"], trials=2)
    figures = summarise(result, scenario)["omni"]
    assert np.isnan(figures.angle_over_bound).all()
    assert np.isfinite(figures.angle_rmse).all()


def test_the_order_of_dimensions_does_not_change_a_summary(result):
    turned = summarise(result.transpose(*reversed(list(result.sizes))), SCENARIO)
    for name, figures in summarise(result, SCENARIO).items():
        np.testing.assert_array_equal(turned[name].nees, figures.nees)
        np.testing.assert_array_equal(turned[name].angle_over_bound, figures.angle_over_bound)


def test_an_honest_filter_is_found_honest():
    """On a matched model NEES and NIS meet their laws.

    One slot's NEES is the mean of 600 independent chi-squares of 3 (5 sigma: 0.5), its NIS of
    1800 of 1 (5 sigma: 0.17).
    """
    honest = eb.load_scenario("paper-single", MATCHED)
    result = eb.simulate(honest, ["omni"], trials=600, seed=8)
    figures = summarise(result, honest)["omni"]
    assert (np.abs(figures.nees[1:] - 3) < 5 * np.sqrt(6 / 600)).all()
    assert (np.abs(figures.nis[1:] - 1) < 5 * np.sqrt(2 / 1800)).all()


@pytest.mark.parametrize("centre", ["predicted", "previous"])
@pytest.mark.parametrize(
    "spread", ["measurement", pytest.param("posterior", marks=pytest.mark.slow)]
)
def test_the_coverage_counts_true_angles_inside_the_covered_interval(centre, spread):
    """Counted once more, trial by trial, from the priors and the variances that were given."""
    keys = {"coverage.centre": centre, "coverage.spread": spread, "coverage.min_rate": 0.0}
    scenario = eb.load_scenario("paper-multi", keys)
    run = eb.simulate(scenario, ["pilot-predict", "omni"], trials=10, seed=11)
    found = run.sel(scheme="pilot-predict")
    inside = asked = 0
    for trial in range(10):
        for k in range(2):
            for slot in range(1, 10):
                sigma = np.sqrt(found["measured_var"].values[trial, 0, k, 0])
                if spread == "posterior":
                    sigma = np.sqrt(found["predicted_cov"].values[trial, slot, k, 0, 0])
                around = found["predicted"].values[trial, slot, k, 0]
                if not np.isfinite(around + sigma):
                    continue
                if centre == "previous":
                    around = found["estimated"].values[trial, slot - 1, k, 0]
                half = min(3 * sigma, np.pi / 4)
                assert found["covered"].values[trial, slot, k] == pytest.approx(half)
                asked += 1
                inside += abs(around - run["truth"].values[trial, slot, k, 0]) <= half
    figures = summarise(run, scenario)
    assert figures["pilot-predict"].coverage == pytest.approx(inside / asked)
    assert np.isnan(figures["omni"].coverage)


def test_trials_of_one_block_may_differ_in_mode(result):
    """Slots without beams count neither for coverage nor for outage, trial by trial."""
    mixed = result.copy(deep=True)
    mixed["mode"][:, ::2, 1:] = 0
    rate = result["rate"].sel(scheme="water-filling").values[1::2, 1:]
    outage = summarise(mixed, SCENARIO)["water-filling"].outage
    assert outage == pytest.approx((rate < 4e-4).mean())


def test_each_scheme_is_held_to_its_own_floor():
    names = ["water-filling", "pilot-predict:min_rate=0.01"]
    run = eb.simulate("paper-multi", names, trials=4, seed=1)
    figures = summarise(run, SCENARIO)
    rate = run["rate"].sel(scheme=names[1]).values[:, 1:]
    assert figures[names[1]].outage == pytest.approx((rate < 0.01).mean())
    assert figures[names[1]].outage == 1.0
