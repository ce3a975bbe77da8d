"""The tracking figure: errors in degrees and metres on a logarithmic axis, with their bound."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb
from echobeam.plots import PlotError
from echobeam.plots.drawing import draw
from echobeam.plots.tracking import BOUND
from echobeam.simulation.bound import with_bound

from .plot_dataset import build_result
from .plot_figures import figure_of, named, series_of


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
            squares.append(error**2)
    return np.sqrt(np.mean(squares)) if squares else np.nan


@pytest.mark.parametrize("coming_and_going", [False, True])
def test_lines_are_root_mean_square_errors_in_degrees_and_metres(coming_and_going):
    result = build_result(trials=4, slots=6, coming_and_going=coming_and_going)
    panels = figure_of("tracking", result).panels
    for panel, state, factor in zip(panels, ("angle", "distance"), (180 / np.pi, 1.0), strict=True):
        for number, scheme in enumerate(("temporal", "pilot")):
            expected = [factor * plain_rmse(result, state, number, slot) for slot in range(6)]
            np.testing.assert_allclose(series_of(panel, scheme).y, expected, rtol=1e-9)


def test_angles_a_turn_apart_are_the_same_angle():
    result = build_result(trials=2)
    result["estimated"].loc[{"state": "angle"}] = result["truth"].sel(state="angle") + 2 * np.pi
    assert series_of(figure_of("tracking", result).panels[0], "temporal").empty


def test_axes_name_their_units_and_ticks_are_plain_numbers():
    figure = draw(figure_of("tracking", build_result()))
    assert [axes.get_ylabel() for axes in figure.axes] == ["Angle RMSE (deg)", "Distance RMSE (m)"]
    assert figure.axes[1].get_xlabel() == "Slot (10 ms each)"
    figure.draw_without_rendering()
    for axes in figure.axes:
        assert axes.get_yscale() == "log"
        low, high = axes.get_ylim()
        assert len([y for y in axes.get_yticks() if low <= y <= high]) >= 2
        labels = [text.get_text() for text in axes.get_yticklabels()]
        np.testing.assert_allclose([float(text) for text in labels], axes.get_yticks(), rtol=1e-9)


def test_the_bound_is_the_pooled_one_in_the_schemes_colour():
    scenario = eb.load_scenario("paper-multi", {"radar.variance": "known"})
    result = eb.simulate(scenario, ["temporal", "pilot", "genie"], trials=8, seed=1)
    data = figure_of("tracking", result)
    own = with_bound(result, scenario)["bound"].sel(scheme="temporal")
    for panel, state, factor in zip(
        data.panels, ("angle", "distance"), (180 / np.pi, 1.0), strict=True
    ):
        expected = factor * np.sqrt((own.sel(state=state) ** 2).mean("object"))
        one = series_of(panel, f"{BOUND}, temporal")
        np.testing.assert_allclose(one.y, expected, rtol=1e-9)
        assert one.look.colour == series_of(panel, "temporal").look.colour
        # a held estimate is biased, a genie measures nothing: no bound for them
        assert series_of(panel, f"{BOUND}, pilot") is None
    assert BOUND in named(data)


def test_a_scheme_that_knows_the_truth_or_estimates_nothing_is_named():
    result = build_result(schemes=("temporal", "genie", "pilot"))
    result["estimated"].loc[{"scheme": "pilot"}] = np.nan
    assert {"genie (none)", "pilot (none)"} <= set(named(figure_of("tracking", result)))


def test_a_result_without_estimates_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no estimated"):
        figure_of("tracking", build_result().drop_vars(["estimated"]))
