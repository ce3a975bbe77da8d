"""Link of objects that are served in turns by one stream: SINR and rates worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from echobeam.physics import transmission
from echobeam.schemes.base import Decision
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.testing.conformance import small_scenario
from echobeam.values import NOBODY, Mode

N, POWER = 8, 1e4


def world_of(trials=2):
    scenario = small_scenario(3).replace({"radio.power": POWER})
    return begin(scene_of(scenario), 0, range(trials))


def decision_of(beams, addressee, carrier) -> Decision:
    """The same beams ``(C, N)`` in two trials."""
    trials, streams = 2, len(beams)
    nobody = transmission.omni(np.zeros((trials, streams), bool), POWER, N)
    sent = replace(
        nobody,
        beams=np.broadcast_to(beams, (trials, streams, N)),
        antenna_power=np.zeros((trials, streams, N)),
        probing=np.zeros((trials, N)),
    )
    return Decision(
        sent=sent,
        addressee=np.broadcast_to(addressee, (trials, streams)),
        sensed=np.ones((trials, streams), bool),
        mode=np.full(trials, Mode.DIRECTIONAL, dtype=np.int8),
        covered=np.full((trials, streams), np.nan),
        fallback=np.zeros(trials, bool),
        carrier=None if carrier is None else np.broadcast_to(carrier, (trials, streams)),
    )


def beams_to(*angles):
    """Beams matched to some angles with equal power; None sends nothing."""
    power = POWER / max(1, sum(angle is not None for angle in angles))
    none = np.zeros(N, dtype=complex)
    return np.stack(
        [
            none if angle is None
            else np.exp(1j * np.pi * np.arange(N) * np.sin(angle)) * np.sqrt(power / N)
            for angle in angles
        ]
    )  # fmt: skip


def by_hand(world, beams, serves, turns):
    """Return SINR and rate of each object; ``serves[k]`` is its stream or None."""
    sinr, rate = [], []
    for k, stream in enumerate(serves):
        angle, distance = world.state[0, k, :2]
        steering = np.exp(1j * np.pi * np.arange(N) * np.sin(angle))
        gain = np.abs(beams @ steering.conj()) ** 2
        own = gain[stream] if stream is not None else 0.0
        ratio = own / (gain.sum() - own + distance**2)
        sinr.append(ratio)
        rate.append(np.log2(1.0 + ratio) / (turns[stream] if stream is not None else 1.0))
    return np.array(sinr), np.array(rate)


@pytest.mark.parametrize(
    ("aims", "addressee", "carrier", "owner", "serves", "turns"),
    [
        # All have streams of their own.
        ((0.8, 1.5, 2.2), [5, 6, 7], [0, 1, 2], [0, 1, 2], [0, 1, 2], {0: 1, 1: 1, 2: 1}),
        # The first two share the first stream.
        ((0.8, None, 2.2), [5, 6, 7], [0, 0, 2], [0, 1, 2], [0, 0, 2], {0: 2, 2: 1}),
        # All three share the last one.
        ((None, None, 1.5), [5, 6, 7], [2, 2, 2], [0, 1, 2], [2, 2, 2], {2: 3}),
        # A track of nobody takes its turns all the same: the UAV does not know.
        ((0.8, None, 2.2), [5, 6, 7], [0, 0, 2], [0, NOBODY, 2], [0, None, 2], {0: 2, 2: 1}),
        # An empty column takes none.
        ((0.8, None, 2.2), [5, NOBODY, 7], [0, 0, 2], [0, NOBODY, 2], [0, None, 2], {0: 1, 2: 1}),
        # Tracks in another order than their objects.
        ((2.2, None, 0.8), [5, 6, 7], [0, 0, 2], [2, 1, 0], [2, 0, 0], {0: 2, 2: 1}),
    ],
)
def test_objects_of_one_stream_take_turns(aims, addressee, carrier, owner, serves, turns):
    world, beams = world_of(), beams_to(*aims)
    decision = decision_of(beams, addressee, carrier)
    link = world.link(decision, np.broadcast_to(owner, (2, 3)))
    sinr, rate = by_hand(world, beams, serves, turns)
    for trial in range(2):
        np.testing.assert_allclose(link.sinr[trial], sinr, rtol=1e-9)
        np.testing.assert_allclose(link.rate[trial], rate, rtol=1e-9)


def test_trials_may_share_differently():
    world, beams = world_of(), beams_to(0.8, 1.5, 2.2)
    decision = decision_of(beams, [5, 6, 7], [0, 1, 2])
    decision = replace(decision, carrier=np.array([[0, 1, 2], [0, 0, 2]]))
    link = world.link(decision, np.broadcast_to([0, 1, 2], (2, 3)))
    for trial, (serves, turns) in enumerate(
        [([0, 1, 2], {0: 1, 1: 1, 2: 1}), ([0, 0, 2], {0: 2, 2: 1})]
    ):
        sinr, rate = by_hand(world, beams, serves, turns)
        np.testing.assert_allclose(link.sinr[trial], sinr, rtol=1e-9)
        np.testing.assert_allclose(link.rate[trial], rate, rtol=1e-9)


def test_streams_of_their_own_are_the_labelled_link_in_every_bit():
    world, beams = world_of(), beams_to(0.8, 1.5, 2.2)
    owner = np.broadcast_to([0, 1, 2], (2, 3))
    labelled = world.link(decision_of(beams, [0, 1, 2], None), owner)
    turns = world.link(decision_of(beams, [0, 1, 2], [0, 1, 2]), owner)
    np.testing.assert_array_equal(labelled.sinr, turns.sinr)
    np.testing.assert_array_equal(labelled.rate, turns.rate)


@pytest.mark.parametrize("geometry", ["road", "ground"])
def test_aspects_of_trials_with_their_own_altitudes_are_those_of_each_alone(geometry):
    changes = {"radar.target": "3gpp-vehicle", "truth.altitude_errors": True}
    scene = scene_of(small_scenario(3, geometry).replace(changes))
    together = begin(scene, 0, range(3)).place
    assert together.shape[0] == 3
    for trial in range(3):
        alone = begin(scene, 0, range(trial, trial + 1)).place
        np.testing.assert_array_equal(together[trial], alone[0])
