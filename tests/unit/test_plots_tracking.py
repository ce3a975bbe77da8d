"""The tracking picture: errors in degrees and metres on a logarithmic axis, with their bound."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.plots import PlotError, style, tracking

from .plot_dataset import build_result


def line_of(axes, label):
    (line,) = [line for line in axes.get_lines() if line.get_label() == label]
    return line


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def bounds_of(axes):
    return [line for line in axes.get_lines() if line.get_label().startswith("_")]


def test_lines_are_root_mean_square_errors_in_degrees_and_metres():
    result = build_result()
    panels = tracking.draw(result).axes
    for axes, state, factor in zip(panels, ("angle", "distance"), (180 / np.pi, 1.0), strict=True):
        error = (result["estimated"] - result["truth"]).sel(state=state)
        expected = np.sqrt((error**2).mean(("trial", "object"))) * factor
        for scheme in ("temporal", "pilot"):
            x, y = line_of(axes, scheme).get_data()
            np.testing.assert_array_equal(x, result["slot"])
            np.testing.assert_allclose(y, expected.sel(scheme=scheme), rtol=1e-9)


def test_axes_name_their_units():
    panels = tracking.draw(build_result()).axes
    assert [axes.get_ylabel() for axes in panels] == ["Angle RMSE (deg)", "Distance RMSE (m)"]
    assert panels[1].get_xlabel() == "Slot (10 ms each)"
    assert all(axes.get_yscale() == "log" for axes in panels)


def test_ticks_are_plain_numbers_and_there_are_some():
    figure = tracking.draw(build_result())
    figure.draw_without_rendering()
    for axes in figure.axes:
        low, high = axes.get_ylim()
        inside = [y for y in axes.get_yticks() if low <= y <= high]
        assert len(inside) >= 2
        labels = [text.get_text() for text in axes.get_yticklabels()]
        np.testing.assert_allclose([float(text) for text in labels], axes.get_yticks(), rtol=1e-9)


def test_the_bound_is_drawn_in_the_schemes_colour():
    result = build_result(
        ("temporal", "water-filling", "pilot"), angles=(60.0,), velocities=(30.0,), with_bound=True
    )
    figure = tracking.draw(result)
    assert "posterior Cramér–Rao bound" in legend_of(figure)
    first, second = bounds_of(figure.axes[0])
    assert [first.get_color(), second.get_color()] == [style.BLUE, style.GREEN]
    expected = result["bound"].sel(scheme="temporal", state="angle").isel(object=0)
    np.testing.assert_allclose(first.get_ydata(), np.rad2deg(expected), rtol=1e-9)


def test_without_a_bound_none_is_promised():
    figure = tracking.draw(build_result())
    assert not any("bound" in text for text in legend_of(figure))
    assert not bounds_of(figure.axes[0])


def test_a_scheme_that_knows_the_truth_is_named_as_without_error():
    figure = tracking.draw(build_result(schemes=("temporal", "genie"), with_bound=True))
    assert "genie (no error)" in legend_of(figure)
    assert len(bounds_of(figure.axes[0])) == 1


def test_a_scheme_without_estimates_is_named():
    result = build_result()
    result["estimated"].loc[{"scheme": "pilot"}] = np.nan
    assert "pilot (no estimate)" in legend_of(tracking.draw(result))


def test_slots_without_any_object_are_gaps():
    result = build_result(angles=(60.0,), velocities=(3.0,), coming_and_going=True)
    y = line_of(tracking.draw(result).axes[0], "temporal").get_ydata()
    np.testing.assert_array_equal(np.isfinite(y), result["present"].any(("trial", "object")))


def test_a_result_without_estimates_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no estimated, phase"):
        tracking.draw(build_result().drop_vars(["estimated", "phase"]))
