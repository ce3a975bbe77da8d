"""The rate picture: its lines and bands are the numbers, and it says what it shows."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from echobeam.plots import PlotError, rate, style

from .plot_dataset import build_result


def lines_of(figure):
    return {line.get_label(): line for line in figure.axes[0].get_lines()}


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def sum_rates(result, scheme):
    return result["rate"].sel(scheme=scheme).fillna(0.0).sum("object").transpose("trial", "slot")


def test_lines_are_means_over_trials_of_the_sum_over_objects():
    result = build_result(schemes=("temporal", "pilot", "genie"))
    lines = lines_of(rate.draw(result))
    for scheme in ("temporal", "pilot", "genie"):
        x, y = lines[scheme].get_data()
        np.testing.assert_array_equal(x, np.arange(1, 11))
        np.testing.assert_allclose(y, sum_rates(result, scheme).mean("trial"), rtol=1e-12)


def test_bands_are_student_intervals_of_the_mean():
    result = build_result(schemes=("water-filling",), trials=12)
    (band,) = rate.draw(result).axes[0].collections
    corners = band.get_paths()[0].vertices
    samples = sum_rates(result, "water-filling").values
    low, high = stats.t.interval(0.95, 11, samples.mean(axis=0), stats.sem(samples, axis=0))
    for slot in range(2, 10):
        heights = corners[corners[:, 0] == slot + 1, 1]
        np.testing.assert_allclose(
            [heights.min(), heights.max()], [low[slot], high[slot]], rtol=1e-9
        )


def test_one_trial_has_no_interval():
    figure = rate.draw(build_result(trials=1))
    assert not figure.axes[0].collections
    assert "95 % interval" not in legend_of(figure)


def test_axes_name_their_units_and_thousandths_are_written_into_the_label():
    axes = rate.draw(build_result()).axes[0]
    assert axes.get_xlabel() == "Slot (10 ms each)"
    assert axes.get_ylabel() == "Sum rate ($10^{-3}$ bit/s/Hz)"
    axes.figure.draw_without_rendering()
    ticks = [text.get_text().replace("\N{MINUS SIGN}", "-") for text in axes.get_yticklabels()]
    np.testing.assert_allclose([float(t) * 1e-3 for t in ticks], axes.get_yticks(), atol=1e-12)
    assert len({len(t.partition(".")[2]) for t in ticks}) == 1, "as many decimals everywhere"


def test_rates_of_order_one_need_no_power_of_ten():
    axes = rate.draw(build_result(power=1e4)).axes[0]
    assert axes.get_ylabel() == "Sum rate (bit/s/Hz)"


def test_the_title_states_the_setting():
    title = rate.draw(build_result()).get_suptitle()
    assert title == "paper-multi: $N_t$ = 30, $h$ = 100 m, 30 trials"


def test_the_gain_over_the_pilot_scheme_in_slot_6_is_written_into_the_picture():
    result = build_result()
    means = {name: sum_rates(result, name).mean("trial")[5] for name in ("temporal", "pilot")}
    texts = [text.get_text() for text in rate.draw(result).axes[0].texts]
    assert f"{float(100 * (means['temporal'] / means['pilot'] - 1)):+.0f} %" in texts


@pytest.mark.parametrize("factor", [0.0, 1e-3])
def test_no_gain_is_claimed_where_there_is_none(factor):
    result = build_result()
    result["rate"].loc[{"scheme": "temporal"}] *= factor
    assert not rate.draw(result).axes[0].texts


def test_no_gain_is_claimed_over_a_pilot_scheme_without_rate():
    result = build_result()
    result["rate"].loc[{"scheme": "pilot"}] = 0.0
    assert not rate.draw(result).axes[0].texts


def test_slots_without_directional_beams_are_shaded():
    result = build_result(slots=30)
    spans = [patch.get_extents() for patch in rate.draw(result).axes[0].patches]
    inverse = rate.draw(result).axes[0].transData.inverted()
    middles = [inverse.transform(((s.x0 + s.x1) / 2, s.y0))[0] for s in spans]
    np.testing.assert_allclose(middles, [1, 11, 21], atol=1e-6)


def test_a_slot_in_which_trials_differ_is_not_shaded():
    result = build_result(schemes=("temporal",))
    result["phase"].values[:, 1:] = "mixed"
    figure = rate.draw(result)
    (shade,) = figure.axes[0].patches
    assert (shade.get_x(), shade.get_width()) == (0.5, 1.0)
    assert "omni slot" in legend_of(figure)


def test_the_legend_says_which_slots_are_shaded():
    assert "omni or pilot slot" in legend_of(rate.draw(build_result()))
    assert "omni slot" in legend_of(rate.draw(build_result(schemes=("temporal",))))
    assert "pilot slot" in legend_of(rate.draw(build_result(schemes=("pilot",))))


def test_a_run_without_directional_slots_is_not_shaded():
    figure = rate.draw(build_result(schemes=("omni",)))
    assert not figure.axes[0].patches
    assert legend_of(figure) == ["omni", "95 % interval"]


def test_a_scheme_keeps_its_colour_whatever_stands_beside_it():
    alone = lines_of(rate.draw(build_result(schemes=("pilot",))))["pilot"]
    among = lines_of(rate.draw(build_result(schemes=("mine", "temporal", "pilot"))))["pilot"]
    assert alone.get_color() == among.get_color() == style.VERMILION


def test_markers_are_thinned_in_long_runs():
    line = lines_of(rate.draw(build_result(slots=300, trials=2)))["temporal"]
    assert len(range(0, 300, line.get_markevery())) <= style.MAX_MARKERS


def test_a_scheme_without_rates_is_named_in_the_legend():
    result = build_result()
    result["rate"].loc[{"scheme": "pilot"}] = np.nan
    figure = rate.draw(result)
    assert set(lines_of(figure)) == {"temporal"}
    assert "pilot (no rate)" in legend_of(figure)


def test_a_result_without_rates_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no rate"):
        rate.draw(build_result().drop_vars("rate"))
