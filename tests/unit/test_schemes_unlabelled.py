"""Schemes on unlabelled detections: against labelled runs, causality, and what they cannot know."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import chi2

import echobeam as eb
from echobeam.physics import transmission
from echobeam.scenario.model import Scenario
from echobeam.schemes.base import Decision, SchemeError, no_tracks
from echobeam.schemes.configure import configure
from echobeam.schemes.registry import available
from echobeam.simulation.loop import run_slots
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.testing.conformance import Bent, bent_world
from echobeam.values import NOBODY, Mode, Status, Tracks

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

ONE = [{"angle": 1.1, "velocity": 10.0}]
THREE = [
    {"angle": 1.1, "velocity": 10.0},
    {"angle": 0.8, "velocity": -5.0, "appears": 0.03},
    {"angle": 2.6, "velocity": 0.0, "appears": 0.06, "leaves": 0.12},
]
CONFIRMED = (Status.CONFIRMED, Status.COASTING)


def scenario_of(objects, **changes) -> Scenario:
    table = {
        "name": "unlabelled",
        "array": {"n_tx": 8},
        "radio": {"power": 1e4},
        "radar": {"detections": "unlabelled", "crb": "exact", "clutter": 1.0},
        "uav": {"height": 100.0, "speed": 10.0, "heading": 0.0},
        "objects": objects,
        "frame": {"slots_per_frame": 5, "frames": 4},
        "filter": {"velocity_prior": 30.0, "evolution": "exact"},
        "coverage": {"ripple": 0.8, "resolution": 0.02},
    }
    return Scenario.model_validate(table).replace(changes)


CLEAR = {
    "radio.power": 1e6,
    "radar.clutter": 0.0,
    "radar.false_alarm": 1e-12,
    "truth.process_noise": True,
}
"""One strong echo and nothing else."""


@dataclass
class Watched:
    """A scheme that keeps what it was shown and what it answered."""

    scheme: object

    def __post_init__(self):
        self.decisions, self.views, self.detections, self.priors = [], [], [], []

    def __getattr__(self, name):
        return getattr(self.scheme, name)

    def transmit(self, prior, view):
        decision = self.scheme.transmit(prior, view)
        self.decisions.append(decision)
        self.priors.append(prior.tracks)
        self.views.append(view)
        return decision

    def update(self, prior, detections, view):
        self.detections.append(detections)
        return self.scheme.update(prior, detections, view)


def watched(scenario, scheme, world=None, trials=3):
    """Return the records of a run, and the scheme with what it saw."""
    found = configure(scenario, scheme)
    mine = Watched(found.scheme)
    world = begin(scene_of(scenario), 5, range(trials)) if world is None else world
    return list(run_slots(world, replace(found, scheme=mine))), mine


@pytest.mark.parametrize("detections", ["labelled", "unlabelled"])
def test_every_scheme_runs_with_nobody_there(detections):
    scenario = scenario_of([], **{"radar.detections": detections})
    result = eb.simulate(scenario, available(), trials=2)
    assert result.sizes["slot"] == 20
    assert result["rate"].size == 0
    found = eb.summary(result)["value"]
    for name in available():
        assert found[name, "frame_rate_mean"] == 0.0
        if detections == "unlabelled":
            assert found[name, "frame_gospa"] >= 0.0


@pytest.mark.parametrize("variance", ["predicted", "known"])
def test_every_scheme_runs_while_objects_come_and_go(variance):
    scenario = scenario_of(THREE, **{"radar.variance": variance})
    result = eb.simulate(scenario, available(), trials=3, seed=1)
    present = result["present"].values.astype(bool)
    for index, name in enumerate(available()):
        rate = result["rate"].values[index]
        assert np.isfinite(rate[present]).all()
        assert (rate[present] >= 0.0).all()
        assert (rate[:, 5:, 0] > 0.0).mean() > 0.3
        if name != "genie":
            tracked = np.isin(result["track_status"].values[index], CONFIRMED)
            assert tracked.any(axis=-1)[:, 6:].mean() > 0.5


@pytest.mark.parametrize(
    ("axis", "association"),
    [("vertical", "nearest"), ("vertical", "jpda"), ("vertical", "mht"), ("horizontal", "jpda")],
)
def test_one_object_alone_is_tracked_consistently_and_served_as_if_labelled(axis, association):
    changes = {**CLEAR, "array.axis": axis, "tracks.association": association}
    trials = 60
    one, labelled = (
        eb.simulate(
            scenario_of(ONE, **changes, **{"radar.detections": detections}),
            ["water-filling"], trials=trials, seed=4,
        )
        for detections in ("unlabelled", "labelled")
    )  # fmt: skip
    error = (
        (one["estimated"] - one["truth"]).isel(scheme=0, object=0).transpose("trial", "slot", ...)
    )
    cov = one["estimated_cov"].values[0, :, :, 0]
    nees = np.einsum("tni,tnij,tnj->tn", error.values, np.linalg.inv(cov), error.values)
    assert np.isfinite(nees).all()
    low, high = chi2.ppf([5e-6, 1.0 - 5e-6], 3 * trials) / trials  # 1e-5 for each of 20 slots
    assert (low < nees.mean(axis=0)).all()
    assert (nees.mean(axis=0) < high).all()
    rates = [each["rate"].values[0, :, 5:, 0] for each in (one, labelled)]
    np.testing.assert_allclose(*rates, rtol=0.01)
    assert (one["track_object"].values[0].max(axis=-1) == 0).all()
    assert (one["track_id"].values[0].max(axis=-1) == 0).all()


BENDS = {
    "states": {},
    "others": {"state": False, "identity": "others"},
    "gone": {"state": False, "identity": "gone"},
}


@pytest.mark.parametrize(
    "name",
    [
        "water-filling",
        pytest.param("temporal", marks=pytest.mark.slow),
        pytest.param("pilot-predict:association=mht", marks=pytest.mark.slow),
    ],
)
def test_nothing_that_comes_later_moves_an_earlier_beam(name):
    scenario = scenario_of(THREE, **{"frame.frames": 3})
    records, mine = watched(scenario, name)
    for slot in (1, 5, 7) if name == "temporal" else (2, 7):
        for bend in BENDS.values():
            world = begin(scene_of(scenario), 5, range(3))
            world = bent_world(world, Bent(world.scene.mover, slot, **bend))
            other_records, other = watched(scenario, name, world)
            for before, after in zip(mine.decisions[:slot], other.decisions[:slot], strict=True):
                np.testing.assert_array_equal(before.mode, after.mode)
                np.testing.assert_array_equal(before.sent.beams, after.sent.beams)
                np.testing.assert_array_equal(before.addressee, after.addressee)
                np.testing.assert_array_equal(before.carrier, after.carrier)
            if slot == 7:  # and the bend is felt
                later = zip(records[slot + 2 :], other_records[slot + 2 :], strict=True)
                assert any(not np.array_equal(a.track_state, b.track_state, equal_nan=True)
                           for a, b in later)  # fmt: skip


def test_an_object_that_appears_moves_no_beam_before_it_is_detected():
    """The detections of others, and of nobody, are the same with it and without it."""
    _, with_it = watched(scenario_of(THREE[:2]), "temporal")
    _, without = watched(scenario_of(THREE[:1]), "temporal")
    appears = 4  # 0.03 s in slots of 0.01 s: the fourth is its first
    for slot in range(appears):  # the beams of a slot are sent before its echoes
        one, other = with_it.decisions[slot], without.decisions[slot]
        np.testing.assert_allclose(one.sent.beams, other.sent.beams, rtol=1e-6, atol=1e-9)
        np.testing.assert_array_equal(one.sent.antenna_power, other.sent.antenna_power)
    for slot in range(appears - 1):  # but for the rounding of sines of arrays of another length
        one, other = with_it.detections[slot].value, without.detections[slot].value
        np.testing.assert_allclose(one, other, rtol=1e-12)


@pytest.mark.parametrize("name", ["temporal", "pilot", "omni"])
def test_no_scheme_is_told_who_is_there(name):
    _, mine = watched(scenario_of(THREE), name)
    for view in mine.views:
        assert view.roster.shape == (3, 0)
        assert view.truth is None
    for found in mine.detections:
        assert (found.label == NOBODY).all()
        assert found.value.flags.writeable is False
    assert not any(decision.addressee.shape[-1] != 16 for decision in mine.decisions)


def test_a_trial_is_the_same_whichever_run_beside_it():
    scenario = scenario_of(THREE, **{"frame.frames": 3})
    for name in ("pilot-needle", "water-filling:association=mht"):
        whole, parts = watched(scenario, name, trials=4)[0], []
        for split in (range(2), range(2, 4)):
            parts.append(watched(scenario, name, begin(scene_of(scenario), 5, split))[0])
        for slot, record in enumerate(whole):
            for field in ("rate", "estimated", "track_state", "track_id", "track_object"):
                both = np.concatenate([getattr(part[slot], field) for part in parts])
                np.testing.assert_allclose(
                    getattr(record, field), both, rtol=1e-4, atol=1e-6, err_msg=field
                )


def test_a_trial_without_tracks_looks_around_until_it_has_one():
    scenario = scenario_of([{"angle": 1.1, "appears": 0.075}], **CLEAR)
    for name, looks in (("temporal", Mode.OMNI), ("pilot", Mode.PILOT)):
        records, mine = watched(scenario, name)
        first = 9  # 0.075 s lies between slots 8 and 9
        assert all((record.mode == looks).all() for record in records[:first])
        assert (records[first].mode == Mode.DIRECTIONAL).all()
        for decision in mine.decisions[:first]:
            power = transmission.radiated_power(decision.sent)
            np.testing.assert_allclose(power, 1e6)
            np.testing.assert_array_equal(decision.sent.beams, 0.0)


@pytest.mark.parametrize("name", ["pilot", "pilot-needle", "pilot-predict"])
def test_a_pilot_that_finds_somebody_within_a_frame_serves_it_from_the_next_slot_on(name):
    """The mutant that held beams for nobody until the frame's end; and each trial for itself."""
    late = [{"angle": 1.1, "velocity": 10.0, "appears": 0.025}]
    own = {"radar.fluctuation": "swerling1", "radar.clutter": 0.0, "radio.power": 1700.0}
    scenario = scenario_of(late, **own, **{"frame.slots_per_frame": 10, "frame.frames": 1})
    records, mine = watched(scenario, name, trials=8)
    found = [int((record.mode == Mode.PILOT).sum()) for record in records]
    assert found[:4] == [8] * 4
    assert 0 < found[4] < 8  # in some trials the first echo is missed
    for record, decision in zip(records[4:], mine.decisions[4:], strict=True):
        beams = record.mode == Mode.DIRECTIONAL
        np.testing.assert_array_equal(record.rate[:, 0] > 0.0, beams)
        power = transmission.radiated_power(decision.sent)
        np.testing.assert_allclose(power, 1700.0, rtol=1e-6)
    for trial in range(8):
        alone, _ = watched(scenario, name, begin(scene_of(scenario), 5, range(trial, trial + 1)))
        for one, other in zip(records, alone, strict=True):
            np.testing.assert_allclose(one.rate[trial], other.rate[0], rtol=1e-4)


def test_the_track_of_an_object_that_left_coasts_and_ends():
    objects = [{"angle": 1.1, "velocity": 10.0, "leaves": 0.08}]
    records, _ = watched(scenario_of(objects, **CLEAR, **{"tracks.coast": 4}), "temporal")
    status = np.array([record.track_status.max(axis=-1) for record in records])[:, 0]
    held = np.flatnonzero(status == Status.COASTING)
    assert held.tolist() == [8, 9, 10]  # three slots of four; after the fourth it is gone
    assert (status[11:] == Status.NONE).all()
    assert all((record.mode == Mode.OMNI).all() for record in records[12:])
    assert all((record.track_object == NOBODY).all() for record in records[8:])


@pytest.mark.parametrize("name", ["omni", "water-filling"])
def test_tracks_that_share_a_beam_have_streams_of_their_own_in_an_omnidirectional_slot(name):
    """The mutant that sends the leader's alone: the others had no rate there."""
    objects = [{"angle": 1.1, "velocity": 10.0}, {"angle": 1.16, "velocity": -5.0}]
    records, mine = watched(scenario_of(objects, **CLEAR), name)
    shared = 0
    for record, decision in zip(records[5:], mine.decisions[5:], strict=True):
        both = (np.sort(record.track_object, axis=-1)[:, -2:] == [0, 1]).all()
        assert both
        if (record.mode == Mode.OMNI).all():
            share = 1e6 / (2 * record.truth[..., 1] ** 2)
            np.testing.assert_allclose(record.sinr, share / (share + 1.0), rtol=1e-9)  # Eq. (7)
            assert not record.shared.any()
        else:
            shared += record.shared.all()
            assert (record.rate > 0.0).all()
        np.testing.assert_allclose(transmission.radiated_power(decision.sent), 1e6, rtol=1e-6)
    assert (shared > 0) == (name != "omni")


def test_more_objects_than_tracks_are_no_fault():
    scenario = scenario_of(THREE, **{"tracks.capacity": 1, "radar.clutter": 20.0})
    for name in ("temporal", "pilot", "omni"):
        result = eb.simulate(scenario, [name], trials=3)
        assert result.sizes["track"] == 1


def test_a_genie_has_a_track_of_every_object_whatever_the_capacity_of_others():
    scenario = scenario_of(THREE, **{"tracks.capacity": 1})
    result = eb.simulate(scenario, ["genie", "water-filling"], trials=2)
    assert result.sizes["track"] == 3
    assert (result["track_id"].values[0] != NOBODY).sum(axis=-1)[0, 8] == 3
    assert (result["track_id"].values[1, ..., 1:] == NOBODY).all()


def test_an_object_behind_is_served_by_a_track_ahead():
    """A vertical array has its mirror image; beams, rates and the record are the object's."""
    behind = scenario_of([{"angle": np.pi - 1.1, "velocity": 5.0}], **CLEAR)
    result = eb.simulate(behind, ["temporal"], trials=5)
    assert (result["track_state"].values[0, ..., 0, 0] < 0.5 * np.pi).all()
    error = (result["estimated"] - result["truth"]).values[0, :, 2:, 0]
    assert np.abs(error[..., 0]).max() < 0.02
    assert np.abs(error[..., 2]).max() < 10.0
    assert (result["rate"].values[0, :, 1:, 0] > 0.0).all()


def test_a_users_function_makes_beams_for_tracks():
    shapes = set()

    def mine(prior, view):
        shapes.add(prior.known.shape)
        assert isinstance(prior, Tracks)
        angle = np.where(prior.known, prior.mean[..., 0], 0.0)
        weight = prior.known / np.maximum(prior.known.sum(axis=-1, keepdims=True), 1)
        scale = np.sqrt(weight * view.system.radio.power / view.system.array.n_tx)
        return view.system.transmitter.steering(angle) * scale[..., None]

    result = eb.simulate(scenario_of(ONE, **CLEAR), [mine, "water-filling"], trials=4)
    assert shapes == {(4, 16)}
    rate = result["rate"].values[:, :, :, 0]
    np.testing.assert_allclose(rate[0], rate[1], rtol=1e-6)  # one object: both are matched beams


@dataclass(frozen=True)
class Whole:
    """A user's whole scheme that points at the last detection."""

    name: str = "whole"
    omniscient: bool = False

    def start(self, view):
        assert view.roster.shape[1] == 0
        return Believed(no_tracks(np.full((view.n_trials, 1), NOBODY)))

    def predict(self, belief, view):
        return belief

    def transmit(self, prior, view):
        known, system = prior.tracks.known, view.system
        beams = system.transmitter.steering(np.nan_to_num(prior.tracks.mean[..., 0]))
        beams = beams * np.sqrt(system.radio.power / system.array.n_tx)
        seeing = known.all(axis=-1)
        probing = transmission.omni(~known & False, system.radio.power, system.array.n_tx)
        return Decision(
            sent=transmission.choose(seeing, transmission.directional(beams), probing),
            addressee=prior.tracks.id,
            sensed=np.ones(known.shape, bool),
            mode=np.where(seeing, Mode.DIRECTIONAL, Mode.OMNI).astype(np.int8),
            covered=np.full(known.shape, np.nan),
            fallback=np.zeros(len(known), bool),
        )

    def update(self, prior, detections, view):
        assert (detections.label == NOBODY).all()
        if not detections.valid.any():
            return prior
        new = detections.valid[:, :1]
        state = detections.value[:, :1] * np.array([1.0, 299_792_458.0 / 2.0, 0.0])
        mean = np.where(new[..., None], state, prior.tracks.mean)
        known = new | prior.tracks.known
        return Believed(
            Tracks(
                mean,
                np.where(known[..., None, None], np.eye(3), np.nan),
                np.where(known, Status.CONFIRMED, Status.NONE).astype(np.int8),
                np.where(known, 0, NOBODY),
            )
        )


@dataclass(frozen=True)
class Believed:
    tracks: Tracks


def test_a_users_whole_scheme_has_detections_and_tracks_of_its_own():
    result = eb.simulate(scenario_of(ONE, **CLEAR), [Whole(), "water-filling"], trials=4)
    rate = result["rate"].values[:, :, 2:, 0]
    assert (rate[0] > 0.0).all()
    directional = result["mode"].values[1, :, 2:] == Mode.DIRECTIONAL
    np.testing.assert_allclose(rate[0][directional], rate[1][directional], rtol=0.05)
    assert (result["track_object"].values[0, :, 1:, 0] == 0).all()


@dataclass(frozen=True)
class Reporting(Whole):
    """A user's scheme that reports as many tracks as a function of the slot says."""

    ids: object = None

    def transmit(self, prior, view):
        decision = super().transmit(Believed(no_tracks(np.full((view.n_trials, 1), NOBODY))), view)
        return decision

    def update(self, prior, detections, view):
        ids = np.tile(np.array(self.ids(view.slot)), (view.n_trials, 1))
        mean = np.broadcast_to([1.1, 112.0, 0.0], (*ids.shape, 3))
        cov = np.broadcast_to(np.eye(3), (*ids.shape, 3, 3))
        status = np.full(ids.shape, Status.CONFIRMED, dtype=np.int8)
        return Believed(Tracks(mean, cov, status, ids))


def test_a_users_scheme_may_have_more_tracks_in_one_slot_than_in_another():
    growing = Reporting(ids=lambda slot: list(range(min(slot, 9))))
    result = eb.simulate(scenario_of(ONE), [growing, "omni"], trials=2)
    count = (result["track_id"].values[0] != NOBODY).sum(axis=-1)
    assert count.tolist() == [[min(slot, 9) for slot in range(1, 21)]] * 2


@pytest.mark.parametrize(
    ("ids", "words"),
    [
        (lambda slot: [NOBODY, 2], "tracks from update of slot 1: the id of a known track is neg"),
        (lambda slot: [2, 0, 2], "two known tracks have the id 2; expected one of its own"),
        (lambda slot: list(range(20)), "20 columns; expected at most tracks.capacity, 16"),
    ],
)
def test_tracks_that_cannot_be_told_apart_are_one_clear_message(ids, words):
    with pytest.raises(SchemeError, match=words):
        eb.simulate(scenario_of(ONE), [Reporting(ids=ids)], trials=2)


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_a_receiver_that_processes_the_signal_finds_and_tracks(axis):
    changes = {"radar.model": "signal", "radar.clutter": 0.0, "radar.integration": "grid"}
    own = {"radio.power": 1e5, "array.axis": axis, "frame.frames": 2}
    scenario = scenario_of(THREE[:2], **changes, **own)
    result = eb.simulate(scenario, ["water-filling", "pilot-needle"], trials=1)
    tracked = (result["track_object"].values == 0) & np.isin(
        result["track_status"].values, CONFIRMED
    )
    assert tracked.any(axis=-1)[:, :, 6:].mean() > 0.7
    error = (result["estimated"] - result["truth"]).values[0, :, 6:, 0]
    assert np.nanmax(np.abs(error[..., 1])) < 3.0


@pytest.mark.parametrize("angle", ["glrt", "capon"])
def test_a_receiver_hears_nothing_where_there_is_nothing_or_nothing_is_sent(angle):
    own = {"radar.model": "signal", "radar.clutter": 0.0, "radar.angle": angle, "array.n_tx": 2}
    empty = scenario_of([], **own, **{"frame.frames": 1})
    result = eb.simulate(empty, ["temporal"], trials=2)
    assert (result["mode"].values == Mode.OMNI).all()

    def silent(prior, view):
        return np.zeros((*prior.known.shape, view.system.array.n_tx))

    for detections in ("labelled", "unlabelled"):
        scenario = scenario_of(ONE, **own, **{"radar.detections": detections, "frame.frames": 1})
        result = eb.simulate(scenario.replace({"radio.power": 1e6}), [silent], trials=2)
        quiet = result["mode"].values[0] == Mode.DIRECTIONAL
        assert quiet.any()
        assert np.isnan(result["measured"].values[0][quiet]).all()


@pytest.mark.slow
def test_two_processes_give_the_same_numbers():
    scenario = scenario_of(THREE, **{"frame.frames": 2})
    one, two = (eb.simulate(scenario, ["omni", "pilot-needle"], trials=130, jobs=j) for j in (1, 2))
    for name in ("rate", "track_state", "track_id", "track_object", "shared", "mode", "estimated"):
        np.testing.assert_array_equal(one[name].values, two[name].values, err_msg=name)


@pytest.mark.parametrize("detections", ["labelled", "unlabelled"])
def test_an_object_that_comes_after_the_end_of_the_run_is_no_fault(detections):
    late = scenario_of([{"angle": 1.1, "appears": 9.0}], **{"radar.detections": detections})
    result = eb.simulate(late, ["water-filling", "genie"], trials=2)
    assert not result["present"].values.any()
    assert eb.summary(result).loc[("water-filling", "frame_rate_mean"), "value"] == 0.0


@pytest.mark.slow
def test_an_object_that_passes_below_a_vertical_array_keeps_its_track():
    """The array folds the angle at 90 degrees, where it measures none."""
    trials = 20
    scenario = eb.load_scenario("arrivals").replace(
        {
            "array.axis": "vertical",
            "radio.power": 1e4,
            "objects": [{"angle": 1.45, "velocity": -30.0}],
            "frame.frames": 6,
        }
    )
    result = eb.simulate(scenario, ["water-filling"], trials=trials)
    figures = eb.summary(result)["value"]["water-filling"]
    assert figures["identity_switches"] == 0.0
    assert figures["false_tracks"] == 0.0
    assert figures["tracked"] > 0.95
    slots = np.isfinite(result["estimated"].values[0, :, :, 0, 0]).sum()
    # Errors of successive slots depend on each other: the band is that of one in twenty slots.
    assert figures["frame_nees"] < chi2.ppf(0.999, 3 * slots / 20) / (slots / 20)
