"""Pictures of runs on the ground, against the definitions of what they show."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics.link import stream_gains
from echobeam.physics.planar import PlanarArray
from echobeam.plots import PlotError, figures
from echobeam.plots.drawing import draw
from echobeam.plots.ground_run import read_ground
from echobeam.plots.source import Choice, Source
from echobeam.values import Transmission

from .plot_figures import figure_of, series_of


@pytest.fixture(scope="module")
def result():
    return eb.simulate("ground", schemes=["water-filling", "pilot"], trials=1, seed=3)


@pytest.fixture(scope="module")
def alone():
    scenario = eb.load_scenario("ground").replace(
        {"objects": [{"position": [40.0, 30.0], "velocity": [0.0, 0.0]}]}
    )
    return eb.simulate(scenario, schemes=["water-filling"], trials=1, seed=3)


def test_the_footprint_at_an_object_is_its_sinr_without_interference(alone):
    """The simulation's own link: one object, so that all that is sent is meant for it."""
    run = read_ground(Source(alone))
    from echobeam.plots.ground_map import footprint

    for slot in (2, 10):
        shown = footprint(run, slot - 1, np.array([40.0]), np.array([30.0]), 1.0, 1.0)
        sinr = alone["sinr"].sel(slot=slot, scheme="water-filling").item()
        assert 10.0 ** (shown.item() / 10.0) == pytest.approx(sinr, rel=1e-9)


def test_the_footprint_is_the_power_of_all_beams_over_the_squared_distance(result):
    data = figure_of("map", result, schemes=("water-filling",), slots=(5,))
    field = data.panels[0].field
    i, j = 37, 81
    x, y, h = field.x[j], field.y[i], 100.0
    d = np.sqrt(x * x + y * y + h * h)
    beam = result["beam"].sel(scheme="water-filling", slot=5).isel(trial=0)
    w = beam.sel(part="re").values + 1j * beam.sel(part="im").values
    row, column = np.divmod(np.arange(64), 8)
    a = np.exp(1j * np.pi * (row * x / d + column * y / d))
    snr = np.sum(np.abs(w @ a.conj()) ** 2) / d**2
    assert field.values[i, j] == pytest.approx(10.0 * np.log10(snr), abs=1e-9)


def test_regions_and_covers_are_the_ellipses_of_their_matrices(result):
    data = figure_of("map", result, schemes=("pilot",), slots=(4,))
    one = result.sel(scheme="pilot", slot=4).isel(trial=0, object=1)
    ring = series_of(data.panels[0], "object 2, 95 % region")
    off = np.stack([ring.x, ring.y]) - one["estimated"].values[:2, None]
    inverse = np.linalg.inv(one["estimated_cov"].values[:2, :2])
    # 5.991: the 95 % quantile of chi square with two degrees of freedom
    np.testing.assert_allclose(np.einsum("in,ij,jn->n", off, inverse, off), 5.99146, rtol=1e-5)
    cover = series_of(data.panels[0], "object 2, cover")
    points = np.stack([cover.x, cover.y, np.full(cover.x.size, -100.0)])
    cosines = (points / np.linalg.norm(points, axis=0))[:2]
    place = np.append(one["estimated"].values[:2], -100.0)
    off = cosines - (place / np.linalg.norm(place))[:2, None]
    inverse = np.linalg.inv(one["cover"].values)
    np.testing.assert_allclose(np.einsum("in,ij,jn->n", off, inverse, off), 1.0, rtol=1e-6)


def test_the_map_and_the_patterns_are_to_scale_and_their_fields_are_in_the_table(result):
    for kind in ("map", "patterns"):
        data = figure_of(kind, result, slots=(2, 6))
        axes = draw(data).axes
        assert [one.get_aspect() for one in axes[:2]] == [1.0, 1.0]
        assert axes[-1].get_ylabel() == str(data.panels[0].field)
        rows = list(csv.DictReader(io.StringIO(data.csv())))
        field = data.panels[0].field
        finite = [row for row in rows if row["panel"] == "slot 2" and row["value"]]
        assert len(finite) == np.isfinite(field.values).sum()


def test_patterns_are_nan_beyond_the_visible_region_and_no_object_is_drawn_behind():
    scenario = eb.load_scenario("ground").replace({"array.facing": "ahead"})
    result = eb.simulate(scenario, schemes=["water-filling"], trials=1, seed=3)
    data = figure_of("patterns", result, slots=(1,))
    field = data.panels[0].field
    u, v = np.meshgrid(field.x, field.y)
    np.testing.assert_array_equal(np.isnan(field.values), u**2 + v**2 > 1.0)
    # in front of the array, towards +x, is the first object alone
    names = [one.name for one in data.panels[0].series if "true direction" in one.name]
    assert names == ["object 1, true direction"]
    seen = figure_of("map", result, slots=(1,)).panels[0].field
    assert np.isnan(seen.values[:, seen.x <= 0.0]).all()


def test_every_kind_of_the_ground_is_drawn_and_another_named(result):
    found = figures(result)
    assert set(found) == {
        "map", "rate", "tracking", "patterns", "trajectories", "consistency", "distribution",
        "forecast",
    }  # fmt: skip
    for data in found.values():
        draw(data)
    with pytest.raises(PlotError, match=r'no picture of weather with geometry = "ground"|weather'):
        figures(result, ["weather"])


def test_errors_are_distances_on_the_ground(result):
    data = figure_of("tracking", result, schemes=("water-filling",))
    error = result["estimated"] - result["truth"]
    error = error.sel(scheme="water-filling").isel(trial=0)
    for panel, names in zip(data.panels, (["x", "y"], ["v_x", "v_y"]), strict=True):
        square = (error.sel(state=names) ** 2).sum("state").mean("object")
        shown = series_of(panel, "water-filling")
        np.testing.assert_allclose(shown.y, np.sqrt(square), rtol=1e-12)


def test_tracks_are_drawn_from_above_and_over_slots():
    scenario = eb.load_scenario("ground").replace(
        {"radar.detections": "unlabelled", "radar.rcs": [120.0, 120.0]}
    )
    result = eb.simulate(scenario, schemes=["water-filling"], trials=1, seed=3)
    data = figures(result, ["tracks"], Choice())["tracks"]
    draw(data)
    above, x, y = data.panels
    assert above.equal
    for name in (one.name for one in x.series if one.name.endswith(", confirmed")):
        np.testing.assert_array_equal(series_of(above, name).x, series_of(x, name).y)
        np.testing.assert_array_equal(series_of(above, name).y, series_of(y, name).y)
    assert any(one.name.endswith(", confirmed") for one in above.series)


def test_two_polarisations_have_gains_without_objects():
    array = PlanarArray(2, 2, polarisations=2)
    nothing = np.zeros((3, 0, 8), dtype=complex)
    sent = Transmission(nothing, np.zeros((3, 0, 8)), np.zeros((3, 8, 8), dtype=complex))
    assert stream_gains(sent, np.zeros((3, 0, 2)), array).shape == (3, 0, 0)


@pytest.mark.slow
def test_many_objects_are_all_drawn_alike():
    scenario = eb.load_scenario("ground-traffic", {"frame.frames": 1})
    result = eb.simulate(scenario, schemes=["water-filling"], trials=1, seed=1)
    one = result.sel(slot=5).isel(trial=0, scheme=0)
    present = one["present"].values
    assert present.sum() > 8
    panel = figure_of("map", result, slots=(5,)).panels[0]
    marks = series_of(panel, "true positions")
    np.testing.assert_array_equal(marks.x[np.isfinite(marks.x)], one["truth"].values[present, 0])
    estimates = series_of(panel, "estimated positions")
    assert np.isfinite(estimates.y).sum() == np.isfinite(one["estimated"].values[:, 1]).sum()
    panel = figure_of("patterns", result, slots=(5,)).panels[0]
    true = [series for series in panel.series if series.name.endswith("true direction")]
    assert len(true) == present.sum()
    assert not panel.notes
