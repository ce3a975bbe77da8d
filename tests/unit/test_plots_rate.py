"""The rate figure: its lines and bands are the numbers, and it says what it shows."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from echobeam.plots import PlotError
from echobeam.plots.drawing import draw
from echobeam.plots.looks import VERMILION

from .plot_dataset import build_result
from .plot_figures import figure_of, named, series_of, spans, written


def sum_rates(result, scheme):
    return result["rate"].sel(scheme=scheme).fillna(0.0).sum("object").transpose("trial", "slot")


def panel_of(result, **choice):
    return figure_of("rate", result, **choice).panels[0]


def test_lines_are_means_over_trials_of_the_sum_over_objects():
    result = build_result(schemes=("temporal", "pilot", "genie"))
    panel = panel_of(result)
    for scheme in ("temporal", "pilot", "genie"):
        one = series_of(panel, scheme)
        np.testing.assert_array_equal(one.x, np.arange(1, 11))
        np.testing.assert_allclose(one.y, sum_rates(result, scheme).mean("trial"), rtol=1e-12)


def test_bands_are_student_intervals_of_the_mean():
    result = build_result(schemes=("water-filling",), trials=12)
    samples = sum_rates(result, "water-filling").values
    low, high = stats.t.interval(0.95, 11, samples.mean(axis=0), stats.sem(samples, axis=0))
    band = series_of(panel_of(result), "water-filling").band
    np.testing.assert_allclose(band[1:], np.stack([low, high], axis=-1)[1:], rtol=1e-9)


def test_one_trial_has_no_interval():
    assert "95 % interval" not in named(figure_of("rate", build_result(trials=1)))


def test_a_picture_writes_small_rates_in_thousandths_and_says_so():
    axes = draw(figure_of("rate", build_result())).axes[0]
    assert axes.get_xlabel() == "Slot (10 ms each)"
    assert axes.get_ylabel() == "Sum rate ($10^{-3}$ bit/s/Hz)"
    axes.figure.draw_without_rendering()
    ticks = [text.get_text().replace("\N{MINUS SIGN}", "-") for text in axes.get_yticklabels()]
    np.testing.assert_allclose([float(t) * 1e-3 for t in ticks], axes.get_yticks(), atol=1e-12)
    assert len({len(t.partition(".")[2]) for t in ticks}) == 1, "as many decimals everywhere"


def test_rates_of_order_one_need_no_power_of_ten():
    axes = draw(figure_of("rate", build_result(power=1e4))).axes[0]
    assert axes.get_ylabel() == "Sum rate (bit/s/Hz)"


def test_the_title_states_the_setting_and_can_be_chosen():
    data = figure_of("rate", build_result())
    assert (data.title, data.setting) == ("paper-multi", "$N_t$ = 30, $h$ = 100 m, 30 trials")
    assert figure_of("rate", build_result(), title="Mine").title == "Mine"


def test_the_gain_over_the_pilot_scheme_in_slot_6_is_written_into_the_picture():
    result = build_result()
    means = {name: sum_rates(result, name).mean("trial")[5] for name in ("temporal", "pilot")}
    gain = f"{float(100 * (means['temporal'] / means['pilot'] - 1)):+.0f} %"
    assert gain in written(figure_of("rate", result))


@pytest.mark.parametrize(
    ("scheme", "factor"), [("temporal", 0.0), ("temporal", 1e-3), ("pilot", 0)]
)
def test_no_gain_is_claimed_where_there_is_none(scheme, factor):
    result = build_result()
    result["rate"].loc[{"scheme": scheme}] *= factor
    assert not panel_of(result).notes


def test_slots_without_directional_beams_are_shaded():
    shaded = spans(panel_of(build_result(slots=30)))
    np.testing.assert_allclose(shaded, [[0.5, 1.5], [10.5, 11.5], [20.5, 21.5]])


def test_a_slot_in_which_trials_differ_is_not_shaded():
    result = build_result(schemes=("temporal",))
    result["phase"].values[:, 1:] = "mixed"
    np.testing.assert_allclose(spans(panel_of(result)), [[0.5, 1.5]])


@pytest.mark.parametrize(
    ("schemes", "said"),
    [
        (("temporal", "pilot"), "omni or pilot slot"),
        (("temporal",), "omni slot"),
        (("pilot",), "pilot slot"),
    ],
)
def test_the_legend_says_which_slots_are_shaded(schemes, said):
    assert said in named(figure_of("rate", build_result(schemes=schemes)))


def test_a_run_without_directional_slots_is_not_shaded():
    data = figure_of("rate", build_result(schemes=("omni",)))
    assert not data.panels[0].guides
    assert named(data) == ["omni", "95 % interval"]


def test_a_scheme_keeps_its_colour_whatever_stands_beside_it():
    alone = series_of(panel_of(build_result(schemes=("pilot",))), "pilot")
    among = series_of(panel_of(build_result(schemes=("mine", "temporal", "pilot"))), "pilot")
    assert alone.look == among.look
    assert alone.look.colour == VERMILION


def test_schemes_can_be_chosen():
    result = build_result(schemes=("temporal", "pilot", "genie"))
    panel = panel_of(result, schemes=("genie", "pilot"))
    assert [one.name for one in panel.series] == ["genie", "pilot"]


def test_slots_can_be_chosen():
    assert panel_of(build_result(), slots=(3, 7)).x.limits == (2.5, 7.5)


def test_a_scheme_without_rates_is_named_in_the_legend():
    result = build_result()
    result["rate"].loc[{"scheme": "pilot"}] = np.nan
    assert "pilot (none)" in named(figure_of("rate", result))


def test_a_long_run_is_shown_by_frames_and_what_hides_each_other_once_more():
    result = build_result(("temporal", "pilot", "omni"), slots=80, trials=3)
    result["rate"].loc[{"scheme": "pilot"}] = 1.1 * result["rate"].sel(scheme="temporal")
    result["rate"].loc[{"scheme": "omni"}] *= 1e-3
    data = figure_of("rate", result)
    frames = sum_rates(result, "temporal").mean("trial").values.reshape(8, 10).mean(axis=1)
    one = series_of(data.panels[0], "temporal")
    np.testing.assert_allclose(one.x, 5.5 + 10 * np.arange(8))
    np.testing.assert_allclose(one.y, frames)
    assert [one.name for one in data.panels[1].series] == ["temporal", "pilot"]


def test_a_result_without_rates_is_refused_by_name():
    with pytest.raises(PlotError, match="holds no rate"):
        figure_of("rate", build_result().drop_vars("rate"))


def test_a_result_without_a_scenario_is_refused():
    with pytest.raises(PlotError, match="does not contain its scenario"):
        figure_of("rate", build_result().assign_attrs(scenario="not = = toml"))


@pytest.mark.parametrize("dimension", ["scheme", "trial", "slot", "object"])
def test_a_result_without_a_dimension_is_refused_by_name(dimension):
    with pytest.raises(PlotError, match=f"no dimension {dimension}"):
        figure_of("rate", build_result().isel({dimension: 0}))
