"""Beam patterns: closed forms, the curves and bands, and which slots are chosen."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.array import LinearArray
from echobeam.plots import PlotError
from echobeam.plots.patterns import beam_gain

from .plot_dataset import build_result
from .plot_figures import figure_of, named, series_of, spans, written


def panels_of(result, **choice):
    return {panel.title: panel for panel in figure_of("patterns", result, **choice).panels}


def test_a_matched_beam_has_the_dirichlet_kernel_for_its_pattern():
    n, aim = 12, np.deg2rad(35.0)
    theta = np.deg2rad(np.linspace(1.0, 179.0, 358))
    w = np.exp(1j * np.pi * np.arange(n) * np.sin(aim)) / np.sqrt(n)
    half = np.pi * (np.sin(theta) - np.sin(aim)) / 2
    kernel = np.ones_like(half) * n
    far = np.abs(np.sin(half)) > 1e-9
    kernel[far] = np.sin(n * half[far]) ** 2 / np.sin(half[far]) ** 2 / n
    np.testing.assert_allclose(
        beam_gain(w, theta, LinearArray(w.size, axis="vertical")), kernel, atol=1e-9
    )


def test_a_vertical_array_has_a_mirror_lobe_and_a_horizontal_one_has_not():
    rng = np.random.default_rng(1)
    w = rng.standard_normal(8) + 1j * rng.standard_normal(8)
    theta = np.deg2rad(np.array([20.0, 160.0]))
    here, mirrored = beam_gain(w, theta, LinearArray(w.size, axis="vertical"))
    assert here == pytest.approx(mirrored, rel=1e-12)
    here, mirrored = beam_gain(w, theta, LinearArray(w.size, axis="horizontal"))
    assert here != pytest.approx(mirrored, rel=1e-3)


def test_the_mean_gain_over_all_directions_is_the_beams_power():
    """Parseval: at half a wavelength the pattern's mean over u in (-1, 1) is |w|^2."""
    rng = np.random.default_rng(2)
    w = rng.standard_normal(9) + 1j * rng.standard_normal(9)
    u = -1 + 2 * np.arange(64) / 64
    gain = beam_gain(w, np.arccos(u), LinearArray(w.size, axis="horizontal"))
    assert gain.mean() == pytest.approx(np.sum(np.abs(w) ** 2), rel=1e-12)


def test_curves_are_the_stored_beams_patterns_in_decibels():
    result = build_result(trials=2)
    panel = panels_of(result, trial=1)["slot 4"]
    m = np.arange(30)
    for k in range(2):
        stored = result["beam"].sel(scheme="temporal", slot=4).isel(trial=1, object=k)
        w = stored.sel(part="re").values + 1j * stored.sel(part="im").values
        one = series_of(panel, f"object {k + 1}")
        assert one.x[[0, -1]] == pytest.approx([0.0, 180.0])
        for i in (0, 400, 755, 1350):
            a = np.exp(1j * np.pi * m * np.sin(np.deg2rad(one.x[i])))
            assert one.y[i] == pytest.approx(20 * np.log10(abs(np.vdot(a, w))), abs=1e-6)


@pytest.mark.parametrize(("scheme", "phase"), [("temporal", "omni"), ("pilot", "pilot")])
def test_the_first_slot_is_a_flat_line_at_the_total_power(scheme, phase):
    panel = panels_of(build_result(power=100.0), schemes=(scheme,))[f"slot 1 ({phase})"]
    (flat,) = panel.series
    np.testing.assert_allclose(flat.y, 20.0)


def test_vertical_lines_are_at_the_true_and_the_predicted_angle():
    result = build_result()
    panel = panels_of(result)["slot 6"]
    one = result.sel(slot=6, state="angle").isel(trial=0)
    expected = np.rad2deg([one["truth"], one["predicted"].sel(scheme="temporal")]).T.ravel()
    lines = [guide.at for guide in panel.guides if guide.to is None]
    np.testing.assert_allclose(lines, expected)


@pytest.mark.parametrize(("centre", "slot"), [("predicted", 6), ("previous", 5)])
def test_the_band_is_what_the_beam_was_designed_to_cover(centre, slot):
    result = build_result()
    result.attrs["scenario"] += f'centre = "{centre}"\n'
    result["covered"].loc[{"scheme": "temporal", "slot": 6}] = np.deg2rad(6.0)
    variable = "predicted" if centre == "predicted" else "estimated"
    at = {"scheme": "temporal", "slot": slot, "state": "angle"}
    around = np.rad2deg(result[variable].sel(at).isel(trial=0)).values
    expected = around[:, None] + np.array([-6.0, 6.0])
    np.testing.assert_allclose(spans(panels_of(result)["slot 6"]), expected)


def test_a_band_stays_between_0_and_180_degrees():
    result = build_result(angles=(12.0,), velocities=(0.0,), slots=2)
    result["covered"].values[...] = np.deg2rad(90.0)
    ((low, _),) = spans(panels_of(result)["slot 2"])
    assert low == 0.0


def test_a_beam_without_a_design_covers_nothing():
    data = figure_of("patterns", build_result(schemes=("water-filling",)), slots=(6,))
    assert not spans(data.panels[0]).size
    assert not any(text.startswith("covered") for text in named(data))
    assert any(text.startswith("covered") for text in named(figure_of("patterns", build_result())))


def test_the_pilots_beam_is_drawn_with_its_held_estimate():
    result = build_result()
    panel = panels_of(result, schemes=("pilot",), slots=(8,))["slot 8"]
    held = np.rad2deg(result["estimated"].sel(scheme="pilot", slot=7, state="angle")[0])
    lines = [guide.at for guide in panel.guides if guide.to is None]
    np.testing.assert_allclose(lines[1::2], held)


def test_default_slots_are_those_of_the_papers_figure():
    titles = list(panels_of(build_result()))
    assert titles == ["slot 1 (omni)", "slot 2", "slot 4", "slot 6", "slot 10"]


def test_default_slots_follow_the_frame_with_most_beams():
    result = build_result(slots=30)
    result["beam"][:, :, :20] = np.nan
    titles = list(panels_of(result))
    assert titles == ["slot 21 (omni)", "slot 22", "slot 24", "slot 26", "slot 30"]


def test_slots_can_be_chosen():
    assert list(panels_of(build_result(), slots=(3, 9))) == ["slot 3", "slot 9"]


def test_a_directional_slot_without_beams_says_so():
    result = build_result()
    result["beam"].loc[{"slot": 4}] = np.nan
    data = figure_of("patterns", result, slots=(4,))
    assert written(data) == ["no beams"]
    assert not spans(data.panels[0]).size


def test_a_beam_of_zeros_is_no_beam():
    result = build_result()
    result["beam"].loc[{"slot": 4, "object": 0}] = 0.0
    assert len(panels_of(result)["slot 4"].series) == 1


def test_more_objects_than_can_be_told_apart_are_counted():
    angles = np.linspace(20.0, 160.0, 11)
    data = figure_of("patterns", build_result(angles=angles, velocities=np.zeros(11), trials=1))
    assert data.caption == "3 more objects are not drawn"
    assert sum(text.startswith("beam for object") for text in named(data)) == 8


@pytest.mark.parametrize(
    ("schemes", "shown"),
    [
        (("omni", "genie", "pilot"), "genie"),
        (("omni",), "omni"),
        (("pilot", "temporal:ripple=5", "temporal:ripple=1"), "temporal:ripple=5"),
    ],
)
def test_the_scheme_of_one_picture_is_temporal_or_a_variant_or_the_first_directional(
    schemes, shown
):
    assert figure_of("patterns", build_result(schemes=schemes)).setting.startswith(shown)


def test_the_mode_of_the_trial_decides_and_not_that_of_the_others():
    result = build_result(trials=2)
    result["mode"].loc[{"scheme": "temporal", "slot": 4, "trial": 1}] = 0
    result["beam"].loc[{"scheme": "temporal", "slot": 4, "trial": 1}] = np.nan
    result["phase"].loc[{"scheme": "temporal", "slot": 4}] = "mixed"
    assert "slot 4" in panels_of(result, trial=0, slots=(4,))
    assert "slot 4 (omni)" in panels_of(result, trial=1, slots=(4,))


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"schemes": ("magic",)}, "no scheme 'magic'; it holds temporal, pilot"),
        ({"trial": 30}, "no trial 30; it holds 0 to 29"),
        ({"trial": -1}, "no trial -1"),
        ({"slots": (2, 11, 99)}, "no slot 11, 99; it holds 1 to 10"),
    ],
)
def test_what_a_result_does_not_hold_is_named(choice, message):
    with pytest.raises(PlotError, match=message):
        figure_of("patterns", build_result(), **choice)
