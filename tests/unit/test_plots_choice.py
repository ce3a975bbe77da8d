"""What a picture of a run shows is what was chosen: slots, trials; what is missing is named."""

from __future__ import annotations

import contextlib
import csv
import io
import json

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from echobeam.plots import KINDS, PlotError
from echobeam.plots.drawing import draw

from .plot_dataset import build_result
from .plot_figures import figure_of, named, series_of


@pytest.fixture(scope="module")
def result():
    return build_result(("temporal", "pilot", "genie"), trials=6)


def places(data):
    """Return the positions along x of all numbers in a record's table and document."""
    document = json.loads(data.json())
    found = {
        x for panel in document["panels"] for one in panel["series"] for x in one["x"] if one["y"]
    }
    rows = list(csv.reader(io.StringIO(data.csv())))[1:]
    return found | {float(row[3]) for row in rows if row[3] and row[5]}


@pytest.mark.parametrize("kind", ["rate", "tracking"])
def test_numbers_are_those_of_the_chosen_slots_only(kind, result):
    data, whole = figure_of(kind, result, slots=(2, 4, 10)), figure_of(kind, result)
    assert places(data) == {2.0, 4.0, 10.0}
    assert data.setting.endswith("slots 2, 4, 10")
    chosen, every = (series_of(one.panels[0], "temporal").y for one in (data, whole))
    np.testing.assert_allclose(chosen, every[[1, 3, 9]])


def test_consistency_is_that_of_the_chosen_slots(result):
    data, whole = (figure_of("consistency", result, slots=slots) for slots in ((5, 6), ()))
    assert places(data) <= {4.5, 5.0, 5.5, 6.0, 6.5}
    for panel, every in zip(data.panels, whole.panels, strict=True):
        one, other = series_of(panel, "temporal"), series_of(every, "temporal")
        np.testing.assert_allclose(one.y, other.y[4:6])


def test_distributions_are_of_the_chosen_slots(result):
    rate, error, outage = figure_of("distribution", result, slots=(3, 5)).panels
    part = result.sel(slot=[3, 5], scheme="pilot")
    sums = part["rate"].sum("object").mean("slot").values
    np.testing.assert_allclose(series_of(rate, "pilot").x, np.sort(sums))
    assert rate.title == "Rate (2 slots)"
    assert series_of(outage, "pilot").x.size == part["rate"].size
    assert series_of(error, "pilot").x.size == part["rate"].size


@pytest.mark.parametrize("going", [False, True])
def test_trajectories_and_forecasts_are_of_the_range_of_the_chosen_slots(going):
    angles = (75.0, 135.0) if not going else np.linspace(30, 150, 6)
    result = build_result(slots=20, trials=2, angles=angles, velocities=np.linspace(-9, 9, 6))
    data = figure_of("trajectories", result, slots=(4, 9))
    x = [one.x for one in data.panels[-1].series]
    low, high = (0.03, 0.08) if going else (4, 9)
    assert (min(map(np.min, x)), max(map(np.max, x))) == pytest.approx((low, high))
    names = {one.name for panel in data.panels for one in panel.series}
    assert going or "forecast from slot 7" in names
    forecast = figure_of("forecast", result, slots=(4, 9))
    assert "forecasts made in slot 6" in forecast.setting
    assert forecast.panels[0].series[0].x.tolist() == [1, 2, 3]


def test_frames_are_pooled_only_if_they_are_complete():
    result = build_result(slots=200, trials=2)
    whole = figure_of("rate", result, slots=tuple(range(101, 181))).panels[0]
    np.testing.assert_allclose(whole.series[0].x, 105.5 + 10 * np.arange(8))
    shifted = figure_of("rate", result, slots=tuple(range(5, 85))).panels[0]
    np.testing.assert_allclose(shifted.series[0].x, np.arange(5, 85))


@pytest.mark.parametrize(("slots", "gain"), [((5, 6, 7), True), ((1, 2), False)])
def test_the_gain_is_written_at_its_slot_if_that_is_shown(result, slots, gain):
    panel = figure_of("rate", result, slots=slots).panels[0]
    assert bool(panel.notes) == gain
    assert all(note.between[1] == series_of(panel, "temporal").y[1] for note in panel.notes)


def test_the_interval_of_a_single_slot_is_a_bar(result):
    data = figure_of("rate", result, slots=(3,))
    figure = draw(data)
    (axes,) = figure.axes
    bars = [one for one in axes.collections if isinstance(one, LineCollection)]
    ends = np.array([bar.get_segments()[0][:, 1] for bar in bars])
    np.testing.assert_allclose(ends, [one.band[0] for one in data.panels[0].series])
    assert "95 % interval" in named(data)
    assert [tick for tick in axes.get_xticks() if 2.5 < tick < 3.5] == [3]


@pytest.mark.parametrize("kind", ["patterns", "trajectories"])
def test_a_trial_is_named_by_its_own_number(kind, result):
    own = result.assign_coords(trial=np.arange(6))
    for cut, trial, words in (
        (own.isel(trial=[5, 3]), 0, "trial 5, one of 2 chosen"),
        (own.isel(trial=[5, 3]), 1, "trial 3, one of 2 chosen"),
        (own.isel(trial=slice(2, 5)), 1, "trial 3 of 2 to 4"),
        (result, 1, "trial 1 of 0 to 5"),
    ):
        assert figure_of(kind, cut, trial=trial).setting.endswith(words)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_a_variable_that_is_missing_is_named(kind, result):
    for name in (*result.data_vars, "phase"):
        with contextlib.suppress(PlotError):  # any other error would be one without its name
            figure_of(kind, result.drop_vars(name))
    with pytest.raises(PlotError, match=r"the result holds no .*estimated"):
        figure_of(kind, result[["rate", "present"]])
