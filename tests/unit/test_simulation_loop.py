"""The slot contract: addressees, mixed modes, what is told and when, and what is refused."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics import transmission
from echobeam.schemes.base import Decision, SchemeError
from echobeam.schemes.beamers import Aim, CoverBeamer, HeldBeams, MatchedBeamer
from echobeam.schemes.configure import configure, configure_all
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.trackers import ExtendedKalman
from echobeam.schemes.water_filling import WATER_FILLING
from echobeam.simulation import movers
from echobeam.simulation.blocks import cut, run_block
from echobeam.simulation.loop import run_slots
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.store.recording import Recording, record
from echobeam.testing.conformance import Bent, bent_world, small_scenario
from echobeam.values import Mode, Tracks


def records_of(scheme, n_objects=2, trials=4, bend=None):
    scenario = small_scenario(n_objects)
    world = begin(scene_of(scenario), 3, range(trials))
    if bend is not None:
        world = bent_world(world, Bent(world.scene.mover, **bend))
    return list(run_slots(world, configure(scenario, scheme)))


@dataclass(frozen=True)
class Staggered:
    """Every other trial looks around in other slots."""

    def mode(self, tracks, view):
        turn = (view.slot + np.arange(view.n_trials)) % 2
        return np.where((view.slot == 1) | (turn == 0), Mode.OMNI, Mode.DIRECTIONAL).astype(np.int8)

    def sensed(self, tracks, mode, view):
        return ClockedFrame().sensed(tracks, mode, view)


@pytest.mark.parametrize("beamer", [MatchedBeamer(), CoverBeamer()])
def test_trials_of_one_block_may_differ_in_mode(beamer):
    """Each trial is what it is alone, whatever the others do."""
    scheme = SchemeOfParts("staggered", Staggered(), ExtendedKalman(), beamer)
    together = records_of(scheme)
    assert {one.phase for one in together[1:]} == {"mixed"}
    for one in together:
        omni = one.mode == Mode.OMNI
        assert np.isnan(one.beam[omni]).all()
        assert np.isfinite(one.beam[~omni]).all()
        share = 10.0 / (2 * one.truth[..., 1] ** 2)
        expected = share / (share + 1.0)  # K = 2: half of the power is the other's stream
        np.testing.assert_allclose(one.sinr[omni], expected[omni], rtol=1e-12)
    result = eb.simulate(small_scenario(2), [scheme], trials=4, seed=3)
    assert result["phase"].values[0].tolist() == ["omni", *["mixed"] * 7]
    np.testing.assert_array_equal(result["mode"].values[0], np.stack([r.mode for r in together], 1))


def shuffled(decision):
    """The same decision with its streams in the other order."""
    sent, back = decision.sent, slice(None, None, -1)
    return replace(
        decision,
        sent=replace(sent, beams=sent.beams[:, back], antenna_power=sent.antenna_power[:, back]),
        addressee=decision.addressee[:, back],
        sensed=decision.sensed[:, back],
        covered=decision.covered[:, back],
    )


class Shuffling(SchemeOfParts):
    def transmit(self, prior, view):
        return shuffled(super().transmit(prior, view))


def test_streams_reach_their_addressees_in_whatever_order():
    parts = ClockedFrame(), ExtendedKalman(), CoverBeamer()
    plain = records_of(SchemeOfParts("plain", *parts))
    other = records_of(Shuffling("other", *parts))
    for one, two in zip(plain, other, strict=True):
        for name in ("sinr", "beam", "covered", "measured", "estimated"):
            np.testing.assert_allclose(
                getattr(one, name), getattr(two, name), rtol=1e-9, equal_nan=True
            )


@dataclass(frozen=True)
class Whole:
    """A whole scheme whose decision is made by a function."""

    decide: object
    name: str = "whole"
    omniscient = False

    def start(self, view):
        return WATER_FILLING.start(view)

    def predict(self, belief, view):
        return WATER_FILLING.predict(belief, view)

    def transmit(self, prior, view):
        return self.decide(view)

    def update(self, prior, detections, view):
        return WATER_FILLING.update(prior, detections, view)


def decision(view, **changes):
    """Omnidirectional streams for all on the roster."""
    shape = view.roster.shape
    values = {
        "sent": transmission.omni(np.ones(shape, bool), 10.0, view.system.array.n_tx),
        "addressee": view.roster,
        "sensed": np.ones(shape, bool),
        "mode": np.zeros(shape[0], dtype=np.int8),
        "covered": np.full(shape, np.nan),
        "fallback": np.zeros(shape[0], bool),
    }
    return Decision(**values | changes)


def test_an_object_without_a_stream_has_rate_zero_and_no_measurement():
    def only_the_first(view):
        streams = np.ones((view.n_trials, 1), bool)
        return decision(
            view,
            sent=transmission.omni(streams, 10.0, 8),
            addressee=view.roster[:, :1],
            sensed=streams,
            covered=np.full(streams.shape, np.nan),
        )

    for one in records_of(Whole(only_the_first)):
        assert (one.rate[:, 0] > 0).all()
        np.testing.assert_array_equal(one.rate[:, 1], 0.0)
        assert np.isfinite(one.measured[:, 0]).all()
        assert np.isnan(one.measured[:, 1]).all()


def too_many(view):
    shape = (view.n_trials, 3)
    return decision(
        view,
        sent=transmission.omni(np.ones(shape, bool), 10.0, 8),
        addressee=np.broadcast_to([0, 1, 2], shape),
        sensed=np.ones(shape, bool),
        covered=np.full(shape, np.nan),
    )


@pytest.mark.parametrize(
    ("decide", "word"),
    [
        (too_many, "sends 3 streams in slot 1 where there are 2 tracks"),
        (lambda view: decision(view, addressee=view.roster + 7), "addresses a stream to 7"),
        (lambda view: decision(view, addressee=0 * view.roster), "sends two streams to one track"),
        (
            lambda view: decision(view, mode=np.zeros(1, np.int8)),
            r"decision of slot 1: mode is of shape \(1,\)",
        ),
        (
            lambda view: decision(view, covered=np.zeros(3)),
            r"covered is of shape \(3,\); expected \(4, 2\)",
        ),
        (
            lambda view: decision(view, carrier=np.zeros(2, np.int64)),
            r"carrier is of shape \(2,\); expected \(4, 2\)",
        ),
        (
            lambda view: decision(view, carrier=view.roster + 1),
            "carries data by stream 2 in slot 1; expected one of its 2 streams, 0 to 1",
        ),
        (
            lambda view: decision(view, carrier=view.roster - 1),
            "carries data by stream -1 in slot 1",
        ),
        (lambda view: None, "returned NoneType from transmit of slot 1; expected an echobeam.Dec"),
        (
            lambda view: decision(
                view, sent=transmission.omni(np.ones(view.roster.shape, bool), 11.0, 8)
            ),
            "radiates 11 in slot 1; at most radio.power = 10",
        ),
    ],
)
def test_a_decision_that_breaks_the_contract_is_one_clear_message(decide, word):
    with pytest.raises(SchemeError, match=word):
        records_of(Whole(decide))


def test_tracks_of_a_wrong_shape_are_named():
    @dataclass(frozen=True)
    class Flat:
        tracks: Tracks

    class Strange(ExtendedKalman):
        def predict(self, belief, view):
            tracks = super().predict(belief, view).tracks
            return Flat(replace(tracks, cov=tracks.cov[..., 0]))

    scheme = SchemeOfParts("strange", ClockedFrame(), Strange(), MatchedBeamer())
    with pytest.raises(
        SchemeError,
        match=r"tracks from predict of slot 1: cov is of shape \(4, 2, 3\); expected \(4, 2, 3, 3",
    ):
        records_of(scheme)


def test_a_view_has_the_roster_and_no_presence_before_it_is_announced():
    seen = []

    def looking(view):
        seen.append(view.roster[0].tolist())
        assert view.truth is None
        return decision(view)

    records_of(Whole(looking), bend={"slot": 3, "state": False, "identity": "others"})
    assert seen == [[0, 1]] * 3 + [[2, 3]] * 5


def test_the_pilot_sends_nothing_to_objects_that_left():
    """The mutant that goes on beaming at them."""
    for name in ("pilot", "pilot-needle"):
        records = records_of(name, bend={"slot": 3, "state": False, "identity": "others"})
        assert (np.abs(records[2].beam) > 0).any()
        np.testing.assert_array_equal(records[3].beam, 0.0)
        assert np.isnan(records[3].covered).all()


def test_a_column_with_a_new_occupant_is_unknown_until_it_is_detected():
    """The mutant that never forgets."""
    for name in ("water-filling", "pilot-predict", "omni"):
        records = records_of(name, bend={"slot": 2, "state": False, "identity": "others"})
        assert np.isfinite(records[1].predicted).all()
        assert np.isnan(records[2].predicted).all()


def test_the_beams_are_sought_anew_after_some_slots():
    """The mutant that never starts cold: directional slots 1, 1 + n, 1 + 2 n of a frame."""
    scenario = small_scenario(1).replace({"frame.slots_per_frame": 10, "frame.frames": 1})
    starts = []

    class Watching(CoverBeamer):
        def beams(self, aim, view):
            starts.append(self.problems(aim, view).warm_start is not None)
            return super().beams(aim, view)

    for every in (8, 3, 1):
        starts.clear()
        scheme = SchemeOfParts("w", ClockedFrame(), ExtendedKalman(), Watching(cold_every=every))
        list(run_slots(begin(scene_of(scenario), 0, range(2)), configure(scenario, scheme)))
        assert starts == [index % every > 0 for index in range(9)]


def test_held_beams_are_designed_once_a_frame():
    designed = []

    class Counting(MatchedBeamer):
        def beams(self, aim: Aim, view):
            designed.append(view.slot)
            return super().beams(aim, view)

    pilot = configure(small_scenario(2), "pilot-needle").scheme
    records_of(replace(pilot, beamer=HeldBeams(Counting(aim="last"))))
    assert designed == [2, 6]


@pytest.mark.slow
def test_a_trace_is_read_once_a_run(tmp_path, monkeypatch):
    scenario = eb.load_scenario("traffic", {"frame.frames": 2})
    calls = []
    original = movers.load_motion
    monkeypatch.setattr(movers, "load_motion", lambda *a, **k: calls.append(1) or original(*a, **k))
    monkeypatch.setattr("echobeam.simulation.blocks.MOST_TRIALS", 2)
    movers._traced.cache_clear()
    assert len(cut(scenario, 6)) == 3
    record(Recording(scenario, ("omni",), 6, 0, tmp_path / "r.nc"))
    assert len(calls) == 1
    movers._traced.cache_clear()


def test_a_blocks_record_holds_what_the_run_knew():
    scenario = small_scenario(2).replace({"uav.heading": "-30 deg", "uav.speed": "20 m/s"})
    block = run_block(scene_of(scenario), configure_all(scenario, ["omni"]), 0, range(3))
    time = 0.01 * np.arange(8)
    down, along = 20 * np.sin(np.pi / 6), 20 * np.cos(np.pi / 6)
    flown = np.stack([along * time, 0 * time, 100 - down * time], axis=-1)
    np.testing.assert_allclose(block.arrays["uav_position"], flown, atol=1e-12)
    np.testing.assert_allclose(
        block.arrays["uav_velocity"], np.tile([along, 0, -down], (8, 1)), atol=1e-12
    )
    place, truth = block.arrays["position"], block.arrays["truth"]
    x = truth[..., 1] * np.cos(truth[..., 0]) + along * time[:, None]
    np.testing.assert_allclose(place[..., 0], x, atol=1e-9)
    np.testing.assert_array_equal(place[..., 1:], 0.0)
    np.testing.assert_array_equal(block.arrays["identity"], np.broadcast_to([0, 1], (3, 8, 2)))
