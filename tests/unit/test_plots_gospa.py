"""GOSPA over slots: distance, parts and numbers by brute force over all assignments."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from .plot_dataset import build_unlabelled
from .plot_figures import figure_of, named, series_of

CUTOFF = 10.0
OBJECTS = {"angles": (75.0, 135.0, 50.0), "velocities": (30.0, -3.0, 10.0)}


def ground(states):
    """Return the places of states below a vertical array, which sees no side."""
    angle, distance = states[:, 0], states[:, 1]
    return np.stack([np.abs(distance * np.cos(angle)), distance * np.sin(angle)], axis=-1)


def best(tracks, objects):
    """Return the parts of the least squared distance, localisation, missed and false."""
    found = []
    for count in range(min(len(tracks), len(objects)) + 1):
        for some in itertools.combinations(range(len(tracks)), count):
            for those in itertools.permutations(range(len(objects)), count):
                off = sum(
                    float(np.sum((tracks[i] - objects[j]) ** 2))
                    for i, j in zip(some, those, strict=True)
                )
                alone = len(objects) - count, len(tracks) - count
                found.append((off, *(0.5 * CUTOFF**2 * number for number in alone)))
    return min(found, key=sum)


def parts_of(result, scheme):
    """Return the parts ``(trial, slot, 3)`` of one scheme."""
    one = result.isel(scheme=scheme)
    trials, slots = one.sizes["trial"], one.sizes["slot"]
    parts = np.zeros((trials, slots, 3))
    for trial, slot in np.ndindex(trials, slots):
        at = one.isel(trial=trial, slot=slot)
        tracks = at["track_state"].values[at["track_status"].values >= 2]
        objects = at["truth"].values[at["present"].values]
        parts[trial, slot] = best(ground(tracks), ground(objects))
    return parts


@pytest.mark.parametrize(("slots", "pooled"), [(20, 1), (70, 10)])
def test_distance_parts_and_numbers_are_means_over_trials(slots, pooled):
    result = build_unlabelled(trials=2, slots=slots, **OBJECTS)
    rng = np.random.default_rng(1)
    shape = result["track_state"].shape[:-1]
    result["track_state"].values[..., 1] += rng.normal(0.0, 4.0, shape)  # some off by the cutoff
    data = figure_of("gospa", result)
    distance, numbers, *rest = data.panels

    def means(values):
        return values.mean(axis=0).reshape(-1, pooled, *values.shape[2:]).mean(axis=1)

    for index, scheme in enumerate(("temporal", "pilot")):
        parts = parts_of(result, index)
        total = means(np.sqrt(parts.sum(axis=-1)))
        np.testing.assert_allclose(series_of(distance, scheme).y, total, rtol=1e-9)
        for panel, expected in zip(rest, means(parts).T, strict=True):
            shown = np.nan_to_num(series_of(panel, scheme).y)
            np.testing.assert_allclose(shown, expected, rtol=1e-9, atol=1e-12)
        confirmed = (result["track_status"].values[index] >= 2).sum(axis=-1)
        np.testing.assert_allclose(series_of(numbers, scheme).y, means(confirmed))
    present = result["present"].values.sum(axis=-1)
    np.testing.assert_allclose(series_of(numbers, "objects in the scene").y, means(present))


def test_quantities_have_names_units_and_a_legend():
    data = figure_of("gospa", build_unlabelled(trials=1, **OBJECTS))
    assert [str(panel.y) for panel in data.panels] == [
        "GOSPA (m)", "Objects and tracks", "Localisation part (m²)", "Missed part (m²)",
        "False part (m²)",
    ]  # fmt: skip
    assert {"temporal", "pilot", "objects in the scene"} <= set(named(data))


def test_slots_are_chosen():
    panel = figure_of("gospa", build_unlabelled(trials=1, **OBJECTS), slots=(2, 5)).panels[0]
    np.testing.assert_allclose(panel.series[0].x, [2, 5])
