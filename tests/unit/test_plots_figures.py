"""The reproduced figures: within one a mark, a colour and a line have one meaning each."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.plots import looks
from echobeam.reproduction.figures import (
    angles,
    height_rates,
    long_run,
    patterns_antennas,
    patterns_slots,
)
from echobeam.reproduction.patterns import gains
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
        return results, figure.data(results)

    return draw


def colours(panel, *names):
    return {one.look.colour for one in panel.series if not names or one.name in names}


@pytest.mark.slow
def test_a_marker_means_a_scheme_in_every_panel_of_the_angles(drawn):
    _, data = drawn(angles.FIGURE)
    expected = {looks.SCHEME_LOOKS[name] for name in angles.SCHEMES}
    for panel in data.panels:
        assert {one.look for one in panel.series if one.look.marker} == expected
    assert [panel.title[-2:] for panel in data.panels] == 2 * ["20", "30", "40"]


@pytest.mark.slow
def test_colours_mean_either_antennas_or_objects_and_antennas_the_same_as_elsewhere(drawn):
    _, data = drawn(patterns_antennas.FIGURE)
    *arrays, medians, gains = data.panels
    antennas = colours(medians)
    assert len(antennas) == 3
    assert [colours(panel) for panel in arrays] == [{one.look.colour} for one in medians.series]
    objects = {looks.object_look(k).colour for k in range(2)}
    assert colours(gains) - {"0.5"} == objects
    assert not antennas & objects
    assert {guide.look.colour for guide in medians.guides} == objects
    assert [one.look.colour for one in medians.series] == [
        looks.parameter_look(number).colour for number in range(3)
    ]


@pytest.mark.slow
def test_widths_of_beams_are_those_that_the_picture_shows(drawn):
    """A lobe and its mirror image: twice the lobe's own width where they do not meet."""
    results, data = drawn(patterns_slots.FIGURE)
    (outcome,) = results.outcomes.values()
    for panel, slot in zip(data.panels[1:], patterns_slots.SLOTS, strict=True):
        gain = gains(outcome, slot)
        for k, note in enumerate(panel.notes):
            above = gain[:, k] >= 0.5 * gain[:, k].max(axis=-1, keepdims=True)
            degrees = np.mean(np.sum(above, axis=-1) * 180.0 / gain.shape[-1])
            assert note.text.startswith(f"−3 dB: {degrees:.0f}°")


@pytest.mark.slow
def test_every_omni_slot_of_the_long_run_is_shaded(drawn):
    _, data = drawn(long_run.FIGURE)
    np.testing.assert_allclose(
        [(guide.at + guide.to) / 2 for guide in data.panels[0].guides], [0, 100, 200, 300, 400]
    )
    assert [one.x.size for one in data.panels[0].series] == [50, 50, 50]


@pytest.mark.slow
def test_every_panel_of_the_heights_has_quantiles_with_intervals(drawn):
    results, data = drawn(height_rates.FIGURE)
    for panel in data.panels:
        means, tails = panel.series[:3], panel.series[3:]
        assert [one.look.plain() for one in means] == [one.look for one in tails]
        assert all(one.band is not None for one in panel.series)
    rate = height_rates.frame_rate(results, 100, "temporal")
    by_height = data.panels[-1].series[3]
    at = list(by_height.x).index(100)
    assert by_height.y[at] == pytest.approx(np.quantile(rate, 0.05))
