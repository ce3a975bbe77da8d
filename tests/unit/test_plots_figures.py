"""The reproduced figures: within one a mark, a colour and a line have one meaning each."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex

from echobeam.plots import style
from echobeam.reproduction.figures import (
    angles,
    height_rates,
    long_run,
    patterns_antennas,
    patterns_slots,
)
from echobeam.reproduction.results import Outcome, Results
from echobeam.sweeps.points import run_study, study_in

TRIALS = 4


@pytest.fixture
def drawn(tmp_path):
    """Return what draws a figure from a few trials of its own setups."""

    def draw(figure):
        points = [setup.point(TRIALS) for setup in figure.points]
        study = study_in(tmp_path / "b", points, 0)
        run_study(study)
        outcomes = [
            Outcome(point, study.statistics_of(i), study.kept(i) if point.keep else {})
            for i, point in enumerate(points)
        ]
        results = Results(outcomes, TRIALS, 0)
        return results, figure.draw(results).drawing

    return draw


def lines_with_labels(axes):
    return [line for line in axes.get_lines() if not line.get_label().startswith("_")]


def test_a_marker_means_a_scheme_in_every_panel_of_the_angles(drawn):
    _, drawing = drawn(angles.FIGURE)
    looks = [style.SCHEME_LOOKS[name] for name in angles.SCHEMES]
    expected = {look.colour: look.marker for look in looks}
    for axes in drawing.axes:
        marked = [line for line in axes.get_lines() if line.get_marker() in "osv^D"]
        assert {line.get_color(): line.get_marker() for line in marked} == expected
    beside = [text.get_text() for text in drawing.axes[-1].texts]
    assert beside == ["20", "20", "30", "30", "40", "40"]


def test_colours_mean_either_antennas_or_objects(drawn):
    _, drawing = drawn(patterns_antennas.FIGURE)
    left, right = drawing.axes
    antennas = {to_hex(line.get_color()) for line in lines_with_labels(left)}
    gains = {to_hex(container.lines[0].get_color()) for container in right.containers}
    assert len(antennas) == 3
    assert gains == {to_hex(style.object_look(k).colour) for k in range(2)}
    assert not antennas & gains
    assert [to_hex(text.get_color()) for text in left.texts] == [
        to_hex(style.object_look(k).colour) for k in range(2)
    ]


def test_widths_of_beams_say_that_they_are_at_half_power(drawn):
    _, drawing = drawn(patterns_slots.FIGURE)
    for axes in drawing.axes[1:]:
        assert len(axes.texts) == 2
        assert all(text.get_text().startswith("half-power width ") for text in axes.texts)


@pytest.mark.slow
def test_every_omni_slot_of_the_long_run_is_marked(drawn):
    _, drawing = drawn(long_run.FIGURE)
    schemes = lines_with_labels(drawing.axes[0])
    assert len(schemes) == 2
    for line in schemes:
        marked = line.get_markevery()
        assert set(range(0, 50, 10)) <= set(marked)
        assert {slot % 10 for slot in marked} == {0, 3, 6, 9}  # the same of every frame


@pytest.mark.slow
def test_every_panel_of_the_heights_has_thin_quantiles_with_bands(drawn):
    results, drawing = drawn(height_rates.FIGURE)
    for axes in drawing.axes:
        thin = [line for line in axes.get_lines() if line.get_linewidth() < 1]
        assert len(thin) == 2
        assert len([one for one in axes.collections if isinstance(one, PolyCollection)]) == 4
        thick = lines_with_labels(axes)
        looks = [(line.get_color(), line.get_linestyle()) for line in (*thick, *thin)]
        assert looks[:2] == looks[2:]
    rate = 1e3 * height_rates.frame_rate(results, 100, "temporal")
    by_height = next(line for line in drawing.axes[-1].get_lines() if line.get_linewidth() < 1)
    at = list(by_height.get_xdata()).index(100)
    assert by_height.get_ydata()[at] == pytest.approx(np.quantile(rate, 0.05))
