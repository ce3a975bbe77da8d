"""Series behind the curves, against sums written out and against scipy."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.plots import series

from .plot_dataset import build_result


def plain_rmse(result, component, scheme, slot):
    """Root mean square error by a loop over trials and objects that are there."""
    squares = []
    for trial in range(result.sizes["trial"]):
        for k in range(result.sizes["object"]):
            at = {"trial": trial, "slot": slot, "object": k}
            if not bool(result["present"][at]):
                continue
            true = float(result["truth"][at].sel(state=component))
            estimate = float(result["estimated"][{"scheme": scheme, **at}].sel(state=component))
            error = estimate - true
            if component == "angle":
                error = np.arctan2(np.sin(error), np.cos(error))
            if np.isfinite(error):
                squares.append(error**2)
    return np.sqrt(np.mean(squares)) if squares else np.nan


def test_sum_rate_adds_the_objects_and_skips_absent_ones():
    result = build_result(trials=3, coming_and_going=True)
    rates = series.sum_rates(result)
    expected = result["rate"].fillna(0.0).sum("object").transpose("scheme", "trial", "slot")
    np.testing.assert_allclose(rates, expected, rtol=1e-14)
    assert np.isfinite(rates).all()


def test_a_scheme_without_any_rate_is_told_apart_from_one_with_rate_zero():
    result = build_result(schemes=("temporal", "pilot", "omni"))
    result["rate"][0] = np.nan
    result["rate"][1] = 0.0
    assert series.has_rate(result).tolist() == [False, True, True]


@pytest.mark.parametrize("component", ["angle", "distance", "velocity"])
@pytest.mark.parametrize("coming_and_going", [False, True])
def test_rmse_is_the_root_mean_square_over_trials_and_objects_present(component, coming_and_going):
    result = build_result(trials=4, slots=6, coming_and_going=coming_and_going)
    errors = series.estimation_errors(result, component)
    for scheme in range(2):
        for slot in range(6):
            expected = plain_rmse(result, component, scheme, slot)
            np.testing.assert_allclose(errors.rmse[scheme, slot], expected, rtol=1e-9)


def test_angles_a_turn_apart_are_the_same_angle():
    result = build_result(trials=2)
    result["estimated"].loc[{"state": "angle"}] = result["truth"].sel(state="angle") + 2 * np.pi
    assert (series.estimation_errors(result, "angle").rmse < 1e-12).all()


def test_chunks_of_trials_change_nothing(monkeypatch):
    result = build_result(trials=11)
    whole = series.estimation_errors(result, "distance")
    monkeypatch.setattr(series, "CHUNK", 3)
    parts = series.estimation_errors(result, "distance")
    np.testing.assert_allclose(parts.rmse, whole.rmse, rtol=1e-13)
    np.testing.assert_array_equal(parts.trials, whole.trials)


def test_where_nothing_is_estimated_the_error_is_nan_without_a_warning():
    result = build_result()
    result["estimated"][:, :, 3] = np.nan
    errors = series.estimation_errors(result, "angle")
    assert np.isnan(errors.rmse[:, 3]).all()
    assert (errors.trials[:, 3] == 0).all()


def test_a_result_without_a_bound_has_none():
    assert series.pooled_bound(build_result(), "angle", np.ones((2, 10, 2))) is None


def test_the_bound_of_one_object_is_passed_on_unchanged():
    result = build_result(
        ("temporal", "genie"), angles=(60.0,), velocities=(30.0,), with_bound=True
    )
    trials = series.estimation_errors(result, "angle").trials
    bound = series.pooled_bound(result, "angle", trials)
    expected = result["bound"].sel(state="angle").isel(object=0)
    np.testing.assert_allclose(bound, expected, rtol=1e-12)


def test_the_pooled_bound_weighs_objects_as_the_error_does():
    """If every error has exactly the bound's size, pooled error and pooled bound agree."""
    result = build_result(
        ("temporal", "water-filling"), trials=4, coming_and_going=True, with_bound=True
    )
    result["bound"].loc[{"object": 1}] *= 7.0
    sign = np.array([1.0, -1.0, 1.0, -1.0])[:, None, None, None]
    truth = result["truth"].transpose("trial", "slot", "object", "state").values
    result["estimated"].values[:] = truth + sign * result["bound"].values[:, None]
    errors = series.estimation_errors(result, "distance")
    bound = series.pooled_bound(result, "distance", errors.trials)
    np.testing.assert_allclose(bound, errors.rmse, rtol=1e-9)


def test_a_held_estimate_has_no_bound():
    result = build_result(("temporal", "pilot", "pilot-predict"), with_bound=True)
    trials = series.estimation_errors(result, "angle").trials
    bound = series.pooled_bound(result, "angle", trials)
    assert np.isfinite(bound).all(axis=1).tolist() == [True, False, True]
    assert np.isnan(bound[1]).all()
