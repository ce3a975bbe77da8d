"""Pictures of sweeps: labels fit and say what they show, lines differ, categories are points."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
import xarray as xr

from echobeam.plots import PlotError
from echobeam.plots.drawing import draw
from echobeam.plots.looks import MOST_LINES, parameter_look

from .plot_figures import figure_of, named

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

WORDS = {
    "nees": ("1", "normalised squared error of the posterior; 3 if honest"),
    "nis": ("1", "normalised squared innovation per component; 1 if honest"),
    "distance_over_bound": ("1", "distance RMSE over the posterior Cramer-Rao bound"),
    "angle_rmse": ("rad", "RMSE of the posterior angle"),
    "mine": ("m", "RMSE of a quantity that someone added, in many words"),
}


def build_sweep(keys, schemes=("temporal", "genie"), trials=3):
    """Return a sweep's dataset with numbers of no meaning."""
    rng = np.random.default_rng(0)
    shape = (*(len(values) for values in keys.values()), len(schemes))
    dims = (*keys, "scheme")
    rate = rng.uniform(1, 2, shape)
    ends = np.stack([rate - 0.1, rate + 0.1], axis=-1) * (1.0 if trials > 1 else np.nan)
    data = {
        "frame_rate_mean": (dims, rate, {"units": "bit/s/Hz"}),
        "frame_rate_interval": ((*dims, "end"), ends),
    }
    for name, (units, words) in WORDS.items():
        values = rng.uniform(1, 2, (*shape, 5))
        data[name] = ((*dims, "slot"), values, {"units": units, "long_name": words})
    coords = {**keys, "scheme": list(schemes), "slot": np.arange(1, 6), "end": ["low", "high"]}
    vary = json.dumps({key: [str(one) for one in values] for key, values in keys.items()})
    return xr.Dataset(data, coords, {"vary": vary, "trials": trials, "scenario": 'name = "s"'})


GRID = {"uav.height": [80.0, 90.0, 100.0], "array.n_tx": [8, 12, 16], "radio.power": [1.0, 2.0, 3]}
CATEGORIES = {"array.axis": ["vertical", "horizontal", "[1.0, 2.0, 3.0]", "[2.0, 4.0, 6.0]"]}


def boxes_of(artists):
    return [one.get_window_extent() for one in artists if one.get_visible() and one.get_text()]


@pytest.mark.parametrize("quantity", WORDS)
def test_labels_and_titles_of_many_panels_neither_overlap_nor_are_cut(quantity):
    figure = draw(figure_of("sweep", build_sweep(GRID), quantity=quantity))
    figure.draw_without_rendering()
    labels = boxes_of(axes.yaxis.label for axes in figure.axes)
    titles = boxes_of(axes.title for axes in figure.axes)
    assert len(labels) == len(titles) == 9
    for group in (labels, titles):
        assert not any(one.overlaps(other) for one, other in itertools.combinations(group, 2))
    tops = [axes.get_window_extent() for axes in figure.axes]
    assert all(box.height <= 1.25 * top.height for box, top in zip(labels, tops, strict=True))
    box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert max(-box.x0, -box.y0, box.x1 - width, box.y1 - height) < 0.02


def test_the_first_letter_of_a_label_is_upper_case_and_the_others_stay():
    label = figure_of("sweep", build_sweep(GRID), quantity="mine").panels[0].y.name
    assert label == "RMSE of a quantity that someone added, in many words, mean over slots"
    label = figure_of("sweep", build_sweep(GRID), quantity="angle_rmse").panels[0].y.name
    assert label == "Angle RMSE, mean over slots"


def test_a_quantity_of_slots_names_its_slot():
    sweep = build_sweep(GRID)
    data = figure_of("sweep", sweep, quantity="nees", slots=(3,))
    assert str(data.panels[0].y) == "NEES, slot 3"
    assert "NEES, slot 3" in data.csv()
    assert figure_of("sweep", sweep).panels[0].y.name == "Mean sum rate"


def test_the_most_lines_of_one_scheme_all_differ_and_more_are_refused():
    looks = [parameter_look(number) for number in range(MOST_LINES)]
    assert len({(look.colour, look.line) for look in looks}) == MOST_LINES
    assert len({(look.colour, look.marker) for look in looks}) == MOST_LINES
    keys = {"uav.height": [80, 90], "array.n_tx": list(range(8, 58)), "radio.power": [1, 2]}
    with pytest.raises(PlotError, match=r"100 lines, of which 49 .* x, or fewer values: sweep"):
        figure_of("sweep", build_sweep(keys), schemes=("genie",))
    (panel,) = figure_of("sweep", build_sweep(keys), schemes=("genie",), x="array.n_tx").panels
    assert len(panel.series) == 4


@pytest.mark.parametrize("schemes", [("temporal", "genie"), ("genie",)])
def test_categories_are_points_that_no_line_joins(schemes):
    data = figure_of("sweep", build_sweep(CATEGORIES | {"radio.power": [1, 2]}), schemes=schemes)
    figure = draw(data)
    assert all(one.kind == "points" and one.look.line == "" for one in data.panels[0].series)
    lines = [line for axes in figure.axes for line in axes.lines if len(line.get_xdata()) > 1]
    assert lines
    assert all(line.get_linestyle() in ("None", "") for line in lines)
    figure.draw_without_rendering()
    ticks = boxes_of(figure.axes[0].get_xticklabels())
    corners = [box.x1 for box in ticks]
    assert len(ticks) == 4
    assert min(np.diff(corners)) > 10


@pytest.mark.parametrize(("trials", "quantity"), [(3, "nees"), (1, None)])
@pytest.mark.parametrize("keys", [GRID, CATEGORIES], ids=["numbers", "categories"])
def test_an_interval_is_in_the_legend_only_where_one_is_drawn(keys, trials, quantity):
    sweep = build_sweep(keys, trials=trials)
    assert "95 % interval" not in named(figure_of("sweep", sweep, quantity=quantity))
    assert "95 % interval" in named(figure_of("sweep", build_sweep(keys)))


def test_values_near_the_top_are_within_the_axes():
    panel = figure_of("sweep", build_sweep(CATEGORIES)).panels[0]
    assert panel.y.limits[1] > max(one.band.max() for one in panel.series)
