import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.configure import system_for
from echobeam.simulation.forecast import forecast_errors, forecasts, plane_sigmas
from echobeam.values import GaussianState

from ..forms import flying, predict

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
def matched():
    scenario = eb.load_scenario("paper-single", MATCHED)
    return scenario, eb.simulate(scenario, ["omni", "pilot-needle"], trials=300, seed=9)


def test_an_honest_filter_keeps_its_promise_at_every_horizon(matched):
    """Errors over what was promised: 300 independent trials each; 5 sigma of a variance's ratio."""
    scenario, result = matched
    found = forecast_errors(result.isel(slot=slice(3, None)), scenario).sel(scheme="omni")
    ratio = (found["rmse"] / found["promised"]).sel(quantity=["angle", "distance"]).values ** 2
    assert np.abs(ratio - 1).max() < 5 * np.sqrt(2 / 300)
    inside = found["inside"].sel(quantity=["angle", "distance"]).values
    assert (inside > 0.9973 - 5 * np.sqrt(0.0027 / 300)).all()


def test_the_longest_forecast_is_the_repeated_prediction(matched):
    """One step ahead is what the run itself predicted."""
    scenario, result = matched
    found = forecast_errors(result, scenario).sel(scheme="omni", horizon=1)
    error = (result["predicted"] - result["truth"]).sel(scheme="omni").isel(slot=slice(1, None))
    rmse = np.sqrt((error**2).mean(("trial", "slot", "object")))
    np.testing.assert_allclose(found["rmse"].values[:3], rmse.values, rtol=1e-9)
    assert found["count"] == 300 * 9


def test_promises_widen_with_the_horizon(matched):
    scenario, result = matched
    promised = forecast_errors(result, scenario)["promised"].sel(scheme="omni").values
    assert (np.diff(promised[:, 1]) > 0).all()


def test_a_forecast_counts_only_while_the_object_stays(matched):
    scenario, result = matched
    gone = result.copy(deep=True)
    gone["present"][:, 5] = False
    gone["identity"][:, 5] = -1
    found = forecast_errors(gone, scenario)["count"].sel(scheme="omni")
    assert found.sel(horizon=9) == 0
    assert found.sel(horizon=1) == 300 * 7


def test_forecasts_are_the_filters_own_repeated_predictions(matched):
    """Against the filter's predictions, state by state."""
    scenario, result = matched
    one = result.sel(scheme="omni").isel(trial=slice(0, 4), slot=[2, 5])
    made = list(
        forecasts(
            one["estimated"].values,
            one["estimated_cov"].values,
            np.array([2, 5]),
            7,
            result["uav_velocity"].values,
            system_for(scenario, "omni"),
        )
    )
    assert [item.mean.shape[1] for item in made] == [2, 2, 2, 2, 1, 1, 1]
    std = np.array(
        [scenario.filter.angle_std, scenario.filter.distance_std, scenario.filter.velocity_std]
    )
    state = GaussianState(
        one["estimated"].values[:, 0], one["estimated_cov"].values[:, 0], np.ones((4, 1), bool)
    )
    for item in made:
        state = predict(state, flying(15.0, -np.pi / 2), 0.01, std, scenario.filter.evolution)
        np.testing.assert_allclose(item.mean[:, 0], state.mean, rtol=1e-12)
        np.testing.assert_allclose(item.cov[:, 0], state.cov, rtol=1e-9, atol=1e-15)


def test_positions_keep_their_promise_as_angles_and_distances_do(matched):
    """Shares of 300 tracks inside: 5 sigma of a binomial; the mean square: see above."""
    scenario, result = matched
    found = forecast_errors(result, scenario, range(5, 6)).sel(scheme="omni", quantity="position")
    ratio = (found["rmse"] / found["promised"]).values ** 2
    assert np.abs(ratio - 1).max() < 5 * np.sqrt(2 / 300)
    assert (found["inside"].values > 0.9973 - 5 * np.sqrt(0.0027 / 300)).all()


def test_the_plane_is_held_as_much_as_the_line():
    assert 1 - np.exp(-(plane_sigmas() ** 2) / 2) == pytest.approx(0.9973002, abs=1e-7)


def test_chosen_slots_give_every_horizon_the_same_forecasts(matched):
    scenario, result = matched
    found = forecast_errors(result, scenario, range(3, 6)).sel(scheme="omni")
    assert found.sizes["horizon"] == 5
    np.testing.assert_array_equal(found["count"].values, 3 * 300)
    alone = [forecast_errors(result, scenario, range(s, s + 1)) for s in (3, 4, 5)]
    squares = [one["rmse"].sel(scheme="omni").isel(horizon=slice(0, 5)) ** 2 for one in alone]
    np.testing.assert_allclose(found["rmse"].values ** 2, sum(squares).values / 3, rtol=1e-12)


def test_degrees_of_freedom_count_tracks_not_forecasts(matched):
    """Tracks of one scenario have nearly the same variances: nearly 300 degrees of freedom."""
    scenario, result = matched
    degrees = forecast_errors(result, scenario, range(3, 6))["degrees"].sel(scheme="omni").values
    assert (degrees <= 300 * (1 + 1e-12)).all()
    assert (degrees > 290).all()


def test_chunks_and_the_order_of_dimensions_do_not_change_errors(matched, monkeypatch):
    scenario, result = matched
    whole = forecast_errors(result, scenario)
    monkeypatch.setattr("echobeam.simulation.forecast.CHUNK", 41)
    parts = forecast_errors(result.transpose(*reversed(list(result.sizes))), scenario)
    for name in whole:
        np.testing.assert_allclose(parts[name].values, whole[name].values, rtol=1e-9)


def test_who_predicts_nothing_or_knows_everything_makes_no_forecast():
    scenario = eb.load_scenario("paper-single")
    result = eb.simulate(scenario, ["pilot-needle", "genie", "omni"], trials=3)
    found = forecast_errors(result, scenario)
    np.testing.assert_array_equal(found["count"].sel(scheme=["pilot-needle", "genie"]).values, 0)
    assert np.isnan(found["rmse"].sel(scheme=["pilot-needle", "genie"]).values).all()
    assert (found["count"].sel(scheme="omni").values > 0).all()


def test_a_column_that_passes_to_another_object_ends_the_forecast(matched):
    """Somebody else takes over in slot 6, without a gap."""
    scenario, result = matched
    other = result.copy(deep=True)
    other["identity"][:, 5:] = 1
    found = forecast_errors(other, scenario)["count"].sel(scheme="omni")
    assert found.sel(horizon=1) == 300 * 8
    assert found.sel(horizon=5) == 0


def test_nobody_to_forecast():
    scenario = eb.load_scenario("paper-single").replace({"objects": []})
    found = forecast_errors(eb.simulate(scenario, ["omni"], trials=2), scenario)
    np.testing.assert_array_equal(found["count"].values, 0)
    assert np.isnan(found["promised"].values).all()
