"""Tracks of unlabelled runs: what is drawn is what the result holds, track by track."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.plots import KINDS, OF_TRACKS, PlotError, figures
from echobeam.plots.looks import DASHED, DOTTED, VERMILION

from .plot_dataset import build_result, build_unlabelled
from .plot_figures import figure_of, named, series_of, spans

STAGES = {1: "tentative", 2: "confirmed", 3: "coasting"}
OBJECTS = {"angles": (75.0, 135.0, 50.0), "velocities": (30.0, -3.0, 10.0), "slots": 20}


def places(result, trial=0, scheme=0):
    """Return identity to slot to (stage, object, position along the road from the UAV)."""
    found = {}
    one = result.isel(trial=trial, scheme=scheme)
    for n, slot in enumerate(one["slot"].values):
        for column in range(one.sizes["track"]):
            at = {"slot": n, "track": column}
            id = int(one["track_id"][at])
            if id >= 0:
                angle, distance, _ = one["track_state"][at].values
                stage, about = int(one["track_status"][at]), int(one["track_object"][at])
                found.setdefault(id, {})[int(slot)] = (stage, about, distance * np.cos(angle))
    return found


def drawn(one):
    """Return slot to position of a line."""
    return {int(x): y for x, y in zip(one.x, one.y, strict=True) if np.isfinite(y)}


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_every_track_has_its_stages_where_the_result_has_them(axis):
    """A stage's line holds its slots and ends in the next one, where the next stage begins."""
    result = build_unlabelled(axis=axis, trials=3, **OBJECTS)
    result["uav_position"][:, 0] = 7.0
    panel = figure_of("tracks", result, trial=2, schemes=("pilot",)).panels[0]
    lines = 0
    for id, life in places(result, trial=2, scheme=1).items():
        x = {s: abs(at) if axis == "vertical" else at + 7.0 for s, (_, _, at) in life.items()}
        for stage, name in STAGES.items():
            own = {slot for slot, (found, _, _) in life.items() if found == stage}
            one = series_of(panel, f"track {id}, {name}")
            assert (one is None) == (not own)
            if one is not None:
                expected = own | {slot + 1 for slot in own if slot + 1 in life}
                assert drawn(one) == pytest.approx({slot: x[slot] for slot in expected})
                lines += 1
        birth = series_of(panel, f"track {id}, first slot")
        assert drawn(birth) == pytest.approx({min(x): x[min(x)]})
    assert lines == 3 * 3 + 2
    assert ("both sides" in panel.y.name) == (axis == "vertical")


def test_a_spell_of_coasting_interrupts_the_line_of_a_confirmed_track():
    result = build_unlabelled(trials=1, **OBJECTS)
    result["track_status"].values[:, :, 6][result["track_id"].values[:, :, 6] == 0] = 3
    panel = figure_of("tracks", result).panels[0]
    confirmed = series_of(panel, "track 0, confirmed")
    pieces = np.split(confirmed.x, np.flatnonzero(np.isnan(confirmed.x)))
    ends = [(one[np.isfinite(one)].min(), one[np.isfinite(one)].max()) for one in pieces[:-1]]
    assert ends == [(3, 7), (8, 11)]
    assert sorted(drawn(series_of(panel, "track 0, coasting"))) == [7, 8, 11, 12]


def test_objects_are_where_they_are_and_marked_where_they_appear_and_leave():
    result = build_unlabelled(trials=2, **OBJECTS)
    panel = figure_of("tracks", result, trial=1).panels[0]
    x = np.abs(result["position"].values[1, ..., 0] - result["uav_position"].values[:, None, 0])
    appears, leaves = {}, {}
    for k in range(3):
        there = np.flatnonzero(result["present"].values[1, :, k])
        one = series_of(panel, f"object {k + 1}")
        np.testing.assert_allclose(one.x, there + 1)
        np.testing.assert_allclose(one.y, x[there, k])
        if there[0] > 0:
            appears[there[0] + 1] = x[there[0], k]
        if there[-1] < 19:
            leaves[there[-1] + 1] = x[there[-1], k]
    assert drawn(series_of(panel, "appears")) == pytest.approx(appears)
    assert drawn(series_of(panel, "leaves")) == pytest.approx(leaves)
    assert (len(appears), len(leaves)) == (2, 3)


def test_confirmed_tracks_of_no_object_have_crosses_and_those_never_of_one_their_colour():
    result = build_unlabelled(trials=1, **OBJECTS)
    data = figure_of("tracks", result)
    panel, life = data.panels[0], places(result)
    expected = {
        (slot, round(abs(at), 9))
        for one in life.values()
        for slot, (stage, about, at) in one.items()
        if stage >= 2 and about < 0
    }
    crosses = series_of(panel, "confirmed track of no object")
    assert {(int(x), round(y, 9)) for x, y in zip(crosses.x, crosses.y, strict=True)} == expected
    never = {id for id, one in life.items() if all(about < 0 for _, about, _ in one.values())}
    assert never == {3, 4}
    for one in panel.series:
        if one.name.startswith("track"):
            id = int(one.name.split()[1].rstrip(","))
            assert (one.look.colour == VERMILION) == (id in never)
    styles = {one.name.split()[-1]: one.look.line for one in panel.series if "track 0" in one.name}
    assert styles == {"slot": "-", "tentative": DOTTED, "confirmed": "-", "coasting": DASHED}
    assert {"track never of an object", "confirmed track of no object", "object"} <= set(
        named(data)
    )


def test_a_range_of_slots_leaves_colours_and_first_slots_as_they_are():
    result = build_unlabelled(trials=1, **OBJECTS)
    panel = figure_of("tracks", result, slots=(11, 14)).panels[0]
    assert panel.x.limits == (10.5, 14.5)
    assert series_of(panel, "track 0, first slot") is None  # born before
    assert series_of(panel, "track 3, confirmed") is None  # gone before
    coasting = series_of(panel, "track 0, coasting")  # of no object in any of these slots
    assert sorted(drawn(coasting)) == [11, 12]
    assert coasting.look.colour != VERMILION


def test_the_slots_without_beams_of_the_trial_are_shaded():
    result = build_unlabelled(trials=2, **OBJECTS)
    result["mode"].values[:, 1, 15] = 0
    for trial, expected in (
        (0, [(0.5, 1.5), (10.5, 11.5)]),
        (1, [(0.5, 1.5), (10.5, 11.5), (15.5, 16.5)]),
    ):
        panel = figure_of("tracks", result, trial=trial).panels[0]
        np.testing.assert_allclose(spans(panel), expected)


def test_a_few_tracks_are_numbered_and_many_are_not():
    notes = figure_of("tracks", build_unlabelled(trials=1, **OBJECTS)).panels[0].notes
    assert [note.text for note in notes] == ["0", "1", "2", "3"]
    many = {"angles": np.linspace(20, 160, 30), "velocities": np.zeros(30), "slots": 20}
    assert not figure_of("tracks", build_unlabelled(trials=1, **many)).panels[0].notes


def test_unlabelled_results_have_these_pictures_besides_and_labelled_ones_refuse_them():
    assert list(figures(build_unlabelled(trials=2))) == [*KINDS, *OF_TRACKS]
    labelled = build_result(trials=2)
    assert list(figures(labelled)) == list(KINDS)
    for kind in OF_TRACKS:
        with pytest.raises(
            PlotError, match=rf"no picture of {kind}: .* are labelled, .*unlabelled"
        ):
            figures(labelled, [kind])
        with pytest.raises(PlotError, match=r"holds no .*track_id"):
            figures(build_unlabelled(trials=2).drop_vars("track_id"), [kind])
