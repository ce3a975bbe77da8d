"""Statistics of unlabelled tracks against loops over a run, and on a record made by hand."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

import echobeam as eb
from echobeam.scenario.model import Scenario
from echobeam.simulation.statistics import join
from echobeam.simulation.summary import summarise
from echobeam.simulation.track_statistics import NEEDED_OF_TRACKS, track_statistics
from echobeam.values import NOBODY, Mode, Status

C = 10.0
ARRAYS = (*NEEDED_OF_TRACKS, "truth", "present", "rate", "sinr", "beam", "mode")
HEIGHT, TRIALS = 100.0, 4


@cache
def run(axis="horizontal"):
    """Objects that come and go, with clutter, so that every figure is of something."""
    scenario = Scenario.model_validate(
        {
            "name": "coming",
            "array": {"n_tx": 8, "axis": axis},
            "radio": {"power": 5e3},
            "radar": {"detections": "unlabelled", "crb": "exact", "clutter": 6.0},
            "objects": [
                {"angle": 1.0, "velocity": 20.0},
                {"angle": 1.08, "velocity": 0.0, "appears": 0.03},
                {"angle": 2.0, "velocity": -10.0, "appears": 0.05, "leaves": 0.2},
            ],
            "frame": {"slots_per_frame": 5, "frames": 6},
            "filter": {"velocity_prior": 30.0},
            "tracks": {"confirm": 2, "window": 4, "coast": 2},
        }
    )
    return scenario, eb.simulate(scenario, ["water-filling", "omni"], trials=TRIALS, seed=2)


def arrays_of(result):
    return {name: result[name].values for name in ARRAYS}


def spot(state, axis):
    along, down = state[1] * np.cos(state[0]), state[1] * np.sin(state[0])
    return np.array([abs(along) if axis == "vertical" else along, down])


def by_loops(a, scheme, axis):
    """Every statistic of a scheme by loops over trials, slots, objects and tracks."""
    trials, slots, columns = a["identity"].shape
    sums = {name: np.zeros(slots) for name in ("gospa", "localisation", "missed", "false", "ospa")}
    each = {name: np.zeros(trials) for name in (
        "gospa", "delay", "detected", "switches", "false", "gap", "with_gaps", "present", "tracked",
        "before", "lost", "shared", "rate_tracked", "rate_false")}  # fmt: skip
    for t in range(trials):
        first, last, gaps, open_gap, detected = {}, {}, [], {}, set()
        confirmed_slots, alone_slots = {}, {}
        for n in range(slots):
            status, about = a["track_status"][scheme, t, n], a["track_object"][scheme, t, n]
            held = [c for c in range(len(status)) if status[c] in (2, 3)]
            here = [k for k in range(columns) if a["present"][t, n, k]]
            # Set distances: the best assignment of squares capped at c.
            m, o = len(held), len(here)
            square = np.full((m, o), C**2)
            for i, c in enumerate(held):
                for j, k in enumerate(here):
                    one = spot(a["track_state"][scheme, t, n, c], axis)
                    other = spot(a["truth"][t, n, k], axis)
                    square[i, j] = min(C**2, float(np.sum((one - other) ** 2)))
            rows, cols = linear_sum_assignment(square)
            pairs = [square[i, j] for i, j in zip(rows, cols, strict=True) if square[i, j] < C**2]
            missed, extra = 0.5 * C**2 * (o - len(pairs)), 0.5 * C**2 * (m - len(pairs))
            total = np.sqrt(sum(pairs) + missed + extra)
            sums["gospa"][n] += total
            sums["localisation"][n] += sum(pairs)
            sums["missed"][n] += missed
            sums["false"][n] += extra
            if max(m, o):
                capped = square[rows, cols].sum() + C**2 * abs(m - o)
                sums["ospa"][n] += np.sqrt(capped / max(m, o))
            each["gospa"][t] += total
            # Continuity, object by object.
            owner = {}
            for c in held:
                track = int(a["track_id"][scheme, t, n, c])
                confirmed_slots[track] = confirmed_slots.get(track, 0) + 1
                alone_slots[track] = alone_slots.get(track, 0) + (about[c] == NOBODY)
                if about[c] != NOBODY:
                    owner[int(about[c])] = track
            for k in here:
                who, rate = int(a["identity"][t, n, k]), a["rate"][scheme, t, n, k]
                each["present"][t] += 1
                each["shared"][t] += a["shared"][scheme, t, n, k]
                first.setdefault(who, n)
                if who in owner:
                    each["tracked"][t] += 1
                    each["rate_tracked"][t] += np.nan_to_num(rate)
                    if who not in detected:
                        each["delay"][t] += n - first[who]
                        each["detected"][t] += 1
                        detected.add(who)
                    each["switches"][t] += who in last and last[who] != owner[who]
                    last[who] = owner[who]
                    if open_gap.get(who):
                        gaps.append(open_gap[who])
                    open_gap[who] = 0
                elif who in detected:
                    each["lost"][t] += not rate > 0.0
                    open_gap[who] = open_gap.get(who, 0) + 1
                else:
                    each["before"][t] += not rate > 0.0
            if a["mode"][scheme, t, n] == Mode.DIRECTIONAL:
                sent = []
                for k in range(columns):
                    beam = a["beam"][scheme, t, n, k]
                    if not any(np.array_equal(beam, other) for other in sent):
                        sent.append(beam)
                useful = sum(float(np.sum(beam**2)) for beam in sent) / 5e3
                if useful > 0:
                    for k in range(columns):
                        sinr, beam = a["sinr"][scheme, t, n, k], a["beam"][scheme, t, n, k]
                        others = a["beam"][scheme, t, n]
                        turns = sum(np.array_equal(beam, other) for other in others)
                        if sinr > 0.0:
                            more = np.log2(1.0 + sinr / min(useful, 1.0)) - np.log2(1.0 + sinr)
                            each["rate_false"][t] += more / turns
        each["false"][t] = sum(2 * alone_slots[i] > confirmed_slots[i] for i in confirmed_slots)
        each["gap"][t] = np.mean(gaps) if gaps else 0.0
        each["with_gaps"][t] = bool(gaps)
    return sums, each


@pytest.mark.parametrize("axis", ["horizontal", "vertical"])
@pytest.mark.slow
def test_every_statistic_is_that_of_loops_over_the_run(axis):
    scenario, result = run(axis)
    arrays = arrays_of(result)
    found = track_statistics(arrays, scenario)
    for scheme in range(2):
        sums, each = by_loops(arrays, scheme, axis)
        for name, expected in sums.items():
            key = name if name in ("gospa", "ospa") else f"gospa_{name}"
            np.testing.assert_allclose(found[key][scheme], expected, atol=1e-8, err_msg=name)
        for name, expected in each.items():
            np.testing.assert_allclose(
                found[f"trial_{name}"][scheme], expected, rtol=1e-6, atol=1e-8, err_msg=name
            )
    water = {name: found[f"trial_{name}"][0].sum() for name in ("before", "tracked", "delay")}
    assert min(water.values()) > 0.0


@pytest.mark.slow
def test_blocks_of_trials_join_to_the_whole():
    scenario, result = run()
    whole = track_statistics(arrays_of(result), scenario)
    parts = [
        track_statistics(arrays_of(result.isel(trial=part)), scenario)
        for part in (slice(0, 1), slice(1, 4))
    ]
    for name, values in join(parts).items():
        np.testing.assert_allclose(values, whole[name], rtol=1e-12, err_msg=name)


def test_the_summary_is_made_of_these_sums():
    scenario, result = run()
    one = summarise(result, scenario)["water-filling"]
    sums, each = by_loops(arrays_of(result), 0, "horizontal")
    slots = scenario.n_slots
    np.testing.assert_allclose(one.gospa, sums["gospa"] / TRIALS)
    np.testing.assert_allclose(one.gospa_false, sums["false"] / TRIALS, atol=1e-9)
    assert one.frame_gospa == pytest.approx(each["gospa"].mean() / slots)
    assert one.detection_delay == pytest.approx(each["delay"].sum() / each["detected"].sum())
    assert one.false_tracks == pytest.approx(100.0 * each["false"].mean() / slots)
    assert one.identity_switches == pytest.approx(each["switches"].mean())
    assert one.tracked == pytest.approx(each["tracked"].sum() / each["present"].sum())
    assert one.shared == pytest.approx(each["shared"].sum() / each["present"].sum())
    mean_rate = each["rate_tracked"].sum() / each["tracked"].sum()
    lost = mean_rate * each["before"].sum() / (TRIALS * slots)
    assert one.rate_lost_to_delay == pytest.approx(lost, rel=1e-6)


def record(about, identities, status=None, present=None):
    """A record of one scheme, one trial and two objects; rows of slots, columns of tracks."""
    about, identities = np.array(about), np.array(identities)
    slots = len(about)
    there = np.ones((slots, 2), bool) if present is None else np.array(present, bool)
    x = np.array([0.0, 50.0])
    truth = np.stack([np.arctan2(HEIGHT, x), np.hypot(HEIGHT, x), 0.0 * x], axis=-1)
    truth = np.where(there[..., None], truth, np.nan)
    held = identities != NOBODY
    if status is None:
        status = np.where(held, Status.CONFIRMED, Status.NONE)
    away = np.array([np.arctan2(HEIGHT, -70.0), np.hypot(HEIGHT, 70.0), 0.0])
    state = np.where(
        (about == NOBODY)[..., None], away, truth[np.arange(slots)[:, None], np.maximum(about, 0)]
    )
    return {
        "identity": np.where(there, np.arange(2), NOBODY)[None],
        "present": there[None],
        "truth": truth[None],
        "track_id": identities[None, None],
        "track_status": np.array(status)[None, None],
        "track_object": about[None, None],
        "track_state": np.where(held[..., None], state, np.nan)[None, None],
        "shared": np.zeros((1, 1, slots, 2), bool),
        "rate": np.zeros((1, 1, slots, 2)),
        "sinr": np.zeros((1, 1, slots, 2)),
        "beam": np.zeros((1, 1, slots, 2, 4, 2)),
        "mode": np.zeros((1, 1, slots)),
    }


def figures(*arguments, **changes):
    scenario, _ = run()
    found = track_statistics(record(*arguments, **changes), scenario)
    return {name.removeprefix("trial_"): float(v[0, 0]) for name, v in found.items()
            if name.startswith("trial_")}  # fmt: skip


def test_a_record_with_a_delay_a_gap_and_a_switch():
    """Object 0 has track 3 from slot 2, loses it for two slots, then has track 4."""
    one = figures([[-1], [-1], [0], [0], [-1], [-1], [0]], [[-1], [-1], [3], [3], [-1], [-1], [4]])
    assert (one["delay"], one["detected"]) == (2.0, 1.0)
    assert (one["gap"], one["with_gaps"]) == (2.0, 1.0)
    assert one["switches"] == 1.0
    assert one["false"] == 0.0
    assert (one["present"], one["tracked"], one["lost"]) == (14.0, 3.0, 2.0)
    assert one["before"] == 2.0 + 7.0
    # Of 7 slots: c^2 / 2 for each object that is missed.
    assert one["gospa"] == pytest.approx(4 * np.sqrt(100.0) + 3 * np.sqrt(50.0))


def test_a_track_of_nobody_is_false_and_one_that_was_once_right_is_not():
    one = figures([[-1, 0], [-1, 0], [0, 1], [-1, 1]], [[5, 6], [5, 6], [5, 6], [5, 6]])
    assert one["false"] == 1.0  # track 5: three of its four slots
    assert one["switches"] == 1.0  # object 0: from track 6 to track 5
    assert (one["gap"], one["with_gaps"]) == (0.0, 0.0)  # lost for good is no gap
    assert one["lost"] == 1.0


def test_tentative_tracks_count_for_nothing():
    status = [[Status.TENTATIVE]] * 3
    one = figures([[0]] * 3, [[1]] * 3, status)
    assert (one["detected"], one["tracked"], one["before"]) == (0.0, 0.0, 6.0)
    assert one["gospa"] == pytest.approx(3 * np.sqrt(100.0))


def test_an_object_that_is_away_is_not_lost():
    """Object 0 is absent in slots 2 and 3: no gap, and its delay counts from its appearance."""
    present = [[0, 1], [1, 1], [0, 1], [0, 1], [1, 1]]
    one = figures([[-1], [0], [-1], [-1], [0]], [[-1], [1], [-1], [-1], [1]], present=present)
    assert (one["delay"], one["detected"]) == (0.0, 1.0)
    assert (one["with_gaps"], one["lost"], one["switches"]) == (0.0, 0.0, 0.0)
    assert (one["present"], one["before"]) == (7.0, 5.0)


def test_a_shared_beam_is_sent_once_and_the_rest_of_the_power_is_wasted():
    arrays = record([[0, 1]], [[0, 1]])
    scenario, _ = run()
    beam = np.zeros((2, 4, 2))
    beam[:, 0, 0] = np.sqrt(0.8 * 5e3)
    arrays["beam"], arrays["mode"] = beam[None, None, None], np.full((1, 1, 1), Mode.DIRECTIONAL)
    arrays["sinr"] = np.array([[[[1.0, 3.0]]]])
    found = track_statistics(arrays, scenario)["trial_rate_false"]
    with_all_power = np.log2(1.0 + 1.0 / 0.8) + np.log2(1.0 + 3.0 / 0.8)
    assert found[0, 0] == pytest.approx(0.5 * (with_all_power - 3.0))  # 20 % are for nobody
