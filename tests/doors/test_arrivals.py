"""The built-in unlabelled scenarios show what they are for: arrivals, crossing, many vehicles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import poisson

import echobeam as eb
from echobeam.physics import transmission
from echobeam.schemes.configure import system_of
from echobeam.values import NOBODY, Mode, Status

LEVEL = 1e-3
"""Probability of so few false tracks if there were one in 100 slots."""


def confirmed_for(result, identity):
    """Whether an object has a confirmed track, ``(trial, slot)``."""
    about = (result["track_object"].values == identity) & (
        result["track_status"].values >= Status.CONFIRMED
    )
    return about.any(axis=-1)[0]


@pytest.mark.slow
def test_arrivals_are_confirmed_within_two_omnidirectional_slots():
    scenario = eb.load_scenario("arrivals")
    result = eb.simulate(scenario, ["temporal"], trials=30)
    system = system_of(scenario)
    omni = transmission.omni(np.zeros((1, 1), bool), scenario.radio.power, scenario.array.n_tx)
    looks = (result["mode"].values[0] == Mode.OMNI).cumsum(axis=-1)
    late = asked = 0
    for identity in range(scenario.n_objects):
        there = (result["identity"].values[0] == identity).any(axis=-1)
        states = result["truth"].values[0, there, identity]
        probability = system.detection.probability(system.law.snr(omni, states[:, None])[:, 0])
        assert probability.min() > 0.9, "every object of this scenario is within reach"
        first = int(np.argmax(there))
        confirmed = confirmed_for(result, identity)
        slot = np.where(confirmed.any(axis=-1), confirmed.argmax(axis=-1), scenario.n_slots - 1)
        before = looks[:, first - 1] if first else 0
        used = np.take_along_axis(looks, slot[:, None], axis=-1)[:, 0] - before
        # The second one is over when the beam after it has confirmed what it found.
        late += int(((used > 2) | ~confirmed.any(axis=-1)).sum())
        asked += len(slot)
    assert late <= 0.05 * asked
    false = eb.summary(result)["value"]["temporal", "false_tracks"]
    slots = len(result["trial"]) * scenario.n_slots
    assert scenario.radar.false_alarm == 1e-4
    assert false * slots / 100.0 <= poisson.ppf(LEVEL, slots / 100.0), "far below one in 100 slots"


@pytest.mark.slow
def test_crossing_tracks_keep_their_objects_if_association_waits():
    """Shares of trials in which the tracks of the two vehicles are exchanged at the end."""
    schemes = [f"water-filling:association={name}" for name in ("nearest", "jpda", "mht")]
    result = eb.simulate("crossing", schemes, trials=40)
    identity = np.where(result["track_status"] >= Status.CONFIRMED, result["track_id"], NOBODY)
    about = result["track_object"].values
    switched = []
    for scheme in range(3):
        ends = []
        for slot in (40, -1):  # before they meet, and long after
            own = about[scheme, :, slot, :, None] == np.arange(2)
            ends.append(np.where(own, identity[scheme, :, slot, :, None], NOBODY).max(axis=1))
        kept = (ends[0] == ends[1]).all(axis=-1)
        switched.append(1.0 - kept.mean())
    nearest, jpda, mht = switched
    assert min(jpda, mht) < 0.1
    assert min(jpda, mht) <= 0.5 * nearest
    assert nearest > 0.0
    for scheme in schemes[1:]:
        switches = eb.summary(result)["value"][scheme, "identity_switches"]
        assert switches < 0.2  # two for each exchange
    shared = result["shared"].values.mean(axis=(0, 1, 3))
    assert shared[1:10].mean() < 0.1, "apart at first: a beam for each"
    assert shared[91:100].min() > 0.9, "side by side: one beam for both"
    assert shared[-9:].mean() < 0.1, "apart again"


@pytest.mark.slow
def test_thirty_objects_are_served_to_the_end():
    """500 slots, no design that fails."""
    x = np.linspace(-140.0, 140.0, 30)
    objects = [
        {"angle": float(np.arctan2(100.0, place)), "velocity": 10.0 + 0.3 * number}
        for number, place in enumerate(x)
    ]
    scenario = eb.load_scenario("arrivals").replace(
        {"objects": objects, "radio.power": 2e4, "tracks.capacity": 40, "frame.frames": 50}
    )
    result = eb.simulate(scenario, ["water-filling"], trials=1)
    assert not result["fallback"].values.any()
    assert np.isfinite(result["rate"].values).all()
    figures = eb.summary(result)["value"]["water-filling"]
    assert figures["tracked"] > 0.95
    assert figures["false_tracks"] < 1.0


@pytest.mark.slow
def test_twenty_vehicles_at_an_intersection_are_tracked_without_labels():
    """Three frames of the shipped trace: all but those that just came have tracks."""
    scenario = eb.load_scenario("ground-traffic", {"frame.frames": 3})
    result = eb.simulate(scenario, ["water-filling"], trials=2, seed=3, progress=False)
    assert int(result["present"].isel(trial=0, slot=0).sum()) >= 19
    found = eb.summary(result).xs("water-filling", level="scheme")["value"]
    assert found["tracked"] > 0.95
    assert found["false_tracks"] < 5.0
    assert found["identity_switches"] <= 1.0
    assert found["frame_gospa"] < 8.0
