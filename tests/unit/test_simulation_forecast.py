import numpy as np
import pytest

import echobeam as eb
from echobeam.simulation.forecast import forecast_errors


@pytest.fixture(scope="module")
def matched():
    scenario = eb.load_scenario(
        "paper-single", {"radio.power": 1000.0, "truth.process_noise": True}
    )
    return scenario, eb.simulate(scenario, ["omni", "pilot-needle"], trials=300, seed=9)


def test_an_honest_filter_keeps_its_promise_at_every_horizon(matched):
    """Errors over what was promised: 300 independent trials each; 5 sigma of a variance's ratio."""
    scenario, result = matched
    found = forecast_errors(result.isel(slot=slice(3, None)), scenario).sel(scheme="omni")
    ratio = (found["rmse"] / found["promised"]).sel(state=["angle", "distance"]).values ** 2
    assert np.abs(ratio - 1).max() < 5 * np.sqrt(2 / 300)
    inside = found["inside"].sel(state=["angle", "distance"]).values
    assert (inside > 0.9973 - 5 * np.sqrt(0.0027 / 300)).all()


def test_the_longest_forecast_is_the_repeated_prediction(matched):
    """One step ahead is what the run itself predicted."""
    scenario, result = matched
    found = forecast_errors(result, scenario).sel(scheme="omni", horizon=1)
    error = (result["predicted"] - result["truth"]).sel(scheme="omni").isel(slot=slice(1, None))
    rmse = np.sqrt((error**2).mean(("trial", "slot", "object")))
    np.testing.assert_allclose(found["rmse"].values, rmse.values, rtol=1e-9)
    assert found["count"] == 300 * 9


def test_promises_widen_with_the_horizon(matched):
    scenario, result = matched
    promised = forecast_errors(result, scenario)["promised"].sel(scheme="omni").values
    assert (np.diff(promised[:, 1]) > 0).all()


def test_a_forecast_counts_only_while_the_object_stays(matched):
    scenario, result = matched
    gone = result.copy(deep=True)
    gone["present"][:, 5] = False
    found = forecast_errors(gone, scenario)["count"].sel(scheme="omni")
    assert found.sel(horizon=9) == 0
    assert found.sel(horizon=1) == 300 * 7
