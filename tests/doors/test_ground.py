"""The ground's geometry through the doors: commands, pictures, and messages of what is left out."""

from __future__ import annotations

import json

import numpy as np
import pytest

import echobeam as eb
from echobeam.plots import KINDS, OF_TRACKS, ON_GROUND, ON_ROAD, PlotError, figures

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
    assert set(made) == ({*KINDS, *ON_GROUND} - {*ON_ROAD, *OF_TRACKS})
    position, velocity = made["tracking"].panels
    assert (position.y.name, velocity.y.unit) == ("Position RMSE", "m/s")
    error = result["estimated"] - result["truth"]
    squares = (error.sel(state=["x", "y"]) ** 2).sum("state").mean(["trial", "object"])
    expected = np.sqrt(squares.sel(scheme="water-filling").values)
    (drawn,) = [one.y for one in position.series if one.name == "water-filling"]
    np.testing.assert_allclose(drawn, expected)
    with pytest.raises(PlotError, match='no picture of forecast with geometry = "ground"'):
        figures(result, ["forecast"])


@pytest.mark.parametrize("command", [eb.describe, eb.sense])
def test_what_is_left_out_says_so(command):
    with pytest.raises(eb.ScenarioError, match='geometry = "ground"'):
        command("ground")


@pytest.mark.slow
def test_a_sweep_has_the_errors_of_the_geometry(tmp_path):
    grid = eb.sweep(
        "ground", {"array.rows": [4, 8]}, schemes=["water-filling"], trials=2, quiet=True,
        out=tmp_path / "s.nc",
    )  # fmt: skip
    rmse = eb.summary(grid)["value"].xs("frame_position_rmse", level="quantity")
    assert rmse.size == 2
    assert rmse.iloc[0] > rmse.iloc[1] > 0.0
