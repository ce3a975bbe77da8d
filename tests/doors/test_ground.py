"""The ground's geometry through the doors: commands, pictures, and messages of what is left out."""

from __future__ import annotations

import json

import numpy as np
import pytest

import echobeam as eb
from echobeam.plots import KINDS, OF_TRACKS, ON_GROUND, PlotError, figures
from echobeam.simulation.forecast import forecast_errors

from .test_cli import echobeam


@pytest.fixture(scope="module")
def result():
    return eb.simulate("ground", ["water-filling", "genie"], trials=3, seed=0)


@pytest.mark.slow
def test_the_json_summary_has_the_errors_of_the_geometry(tmp_path):
    done = echobeam(
        "run", "ground", "--scheme", "omni", "--trials", "2", "--json", "--quiet",
        "--out", str(tmp_path / "g.nc"),
    )  # fmt: skip
    (scheme,) = json.loads(done.stdout)["schemes"].values()
    assert len(scheme["position_rmse"]) == 10
    assert {"velocity_rmse", "frame_position_rmse", "position_over_bound"} <= set(scheme)
    assert "angle_rmse" not in scheme


def test_pictures_are_drawn_or_refused_by_name(result):
    made = figures(result)
    assert set(made) == ({*KINDS, *ON_GROUND} - {*OF_TRACKS})
    position, velocity = made["tracking"].panels
    assert (position.y.name, velocity.y.unit) == ("Position RMSE", "m/s")
    error = result["estimated"] - result["truth"]
    squares = (error.sel(state=["x", "y"]) ** 2).sum("state").mean(["trial", "object"])
    expected = np.sqrt(squares.sel(scheme="water-filling").values)
    (drawn,) = [one.y for one in position.series if one.name == "water-filling"]
    np.testing.assert_allclose(drawn, expected)
    road = eb.simulate("paper-single", ["omni"], trials=1)
    with pytest.raises(PlotError, match='no picture of map with geometry = "road"'):
        figures(road, ["map"])


def test_forecasts_are_straight_paths_and_their_covariances_grow_as_told(result):
    """Ten slots, forecasts from slot 5 on: x + h DT v, and the covariance of that by hand."""
    one = result.sel(scheme="water-filling").transpose("trial", "slot", "object", ...)
    found = forecast_errors(result, eb.load_scenario("ground"), range(5, 6))
    mean, truth = one["estimated"].values[:, 4], one["truth"].values
    cov, h, dt, std = one["estimated_cov"].values[:, 4], 3, 0.01, 0.5
    ahead = mean[..., :2] + h * dt * mean[..., 2:]
    off = np.sum((ahead - truth[:, 4 + h, :, :2]) ** 2, axis=-1)
    part = found.sel(scheme="water-filling", horizon=h, quantity="position")
    assert part["rmse"] == pytest.approx(np.sqrt(off.mean()), rel=1e-9)
    path = np.eye(4)
    path[0, 2] = path[1, 3] = dt
    noise = np.kron(std**2 * np.outer([0.5 * dt, 1.0], [0.5 * dt, 1.0]), np.eye(2))
    for _ in range(h):
        cov = path @ cov @ path.T + noise
    stated = np.sqrt(np.mean(cov[..., 0, 0] + cov[..., 1, 1]))
    assert part["promised"] == pytest.approx(stated, rel=1e-9)
    assert list(found["quantity"].values) == ["position", "velocity"]
    (picture,) = figures(result, ["forecast"]).values()
    assert [panel.y.unit for panel in picture.panels] == ["m", "m/s", "%"]


SMALL = {
    "array.rows": 4,
    "array.columns": 4,
    "radar.subcarriers": 32,
    "radar.symbols": 4,
    "radar.bandwidth": "20 MHz",
}
"""An array and a waveform that are quick to simulate."""


@pytest.mark.slow
def test_the_estimators_of_both_cosines_are_checked_against_their_bounds(tmp_path):
    """48 trials: RMSE over the bound within four standard errors, 1 / sqrt(2 * 48), of 1; 0.2 more
    for what is left of the estimators' own loss."""
    check = eb.sense("ground", trials=48, set=SMALL, out=tmp_path / "s.png", quiet=True)
    assert check.directions == ("u", "v")
    assert set(check.rmse) == set(check.bound["exact"]) == {"u", "v", "delay", "doppler"}
    high = check.total >= 24.0
    for quantity, estimators in check.rmse.items():
        for name, rmse in estimators.items():
            ratio = rmse[high] / check.bound["exact"][quantity][high]
            assert np.all(np.abs(ratio - 1.0) < 4.0 / np.sqrt(96.0) + 0.2), (quantity, name)
    for share in check.resolved.values():
        assert share[-1] == 1.0
        assert share[0] < 1.0
    np.testing.assert_allclose(check.separation[-1], 3.0 / (4 * 0.5), rtol=1e-12)


@pytest.mark.slow
def test_the_check_of_a_planar_receiver_is_printed_and_written(tmp_path):
    given = [f"{key}={value}" for key, value in SMALL.items()]
    settings = [part for text in given for part in ("--set", text)]
    done = echobeam("sense", "ground", "--trials", 2, *settings, "--quiet", "--json", cwd=tmp_path)
    found = json.loads(done.stdout)
    assert set(found["rmse"]) == {"u", "v", "delay", "doppler"}
    assert len(found["rmse"]["v"]["capon"]) == len(found["snr_db"])
    done = echobeam("sense", "ground", "--trials", 2, *settings, "--out", "x.png", cwd=tmp_path)
    assert "u capon" in done.stdout
    assert "apart (cosine)" in done.stdout
    line = ("--set", "array={kind='linear', n_tx=8, axis='horizontal'}")
    more = (*line, *settings[4:], "--json", "--quiet")
    alone = echobeam("sense", "ground", "--trials", 2, *more, cwd=tmp_path)
    found = json.loads(alone.stdout)["rmse"]
    assert {name: None in found[name]["glrt"] for name in "uv"} == {"u": False, "v": True}


def test_an_object_behind_the_array_has_no_check_of_estimators():
    with pytest.raises(eb.ScenarioError, match="the first object is behind the array"):
        eb.sense("ground", trials=2, set={"array.facing": [0, 0, 1]}, quiet=True)


def test_two_polarisations_have_no_check_of_estimators():
    with pytest.raises(eb.ScenarioError, match=r"array\.polarisations: 2 is not"):
        eb.sense("ground", trials=2, set={"array.polarisations": 2}, quiet=True)


@pytest.mark.slow
def test_a_sweep_has_the_errors_of_the_geometry(tmp_path):
    grid = eb.sweep(
        "ground", {"array.rows": [4, 8]}, schemes=["water-filling"], trials=2, quiet=True,
        out=tmp_path / "s.nc",
    )  # fmt: skip
    rmse = eb.summary(grid)["value"].xs("frame_position_rmse", level="quantity")
    assert rmse.size == 2
    assert rmse.iloc[0] > rmse.iloc[1] > 0.0
