"""Frames without a clock: looks when they pay, and power that is spread while beams are sent."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import echobeam as eb
from echobeam.physics import transmission
from echobeam.physics.link import channel_loss, sinr
from echobeam.schemes.adaptive_frames import AdaptiveFrame, ProbingFrame
from echobeam.schemes.base import SchemeError
from echobeam.schemes.configure import configure, system_of
from echobeam.values import NOBODY, Mode, Status, Tracks

LABELLED = eb.load_scenario("paper-multi")
UNLABELLED = eb.load_scenario("arrivals")


def tracks(known, id=None, deviation=1e-3):
    """Return tracks at 60 degrees in the columns of a mask ``(T, C)``."""
    known = np.asarray(known)
    mean = np.where(known[..., None], [np.radians(60.0), 115.0, 20.0], np.nan)
    cov = np.where(known[..., None, None], np.diag([deviation**2, 1.0, 1.0]), np.nan)
    status = np.where(known, Status.CONFIRMED, 0).astype(np.int8)
    id = np.where(known, np.arange(known.shape[1]), NOBODY) if id is None else np.asarray(id)
    return Tracks(mean, cov, status, id)


def view(scenario, slot, last_look, roster, unanswered=0):
    """Return a view of a slot, as far as a frame reads it."""
    return eb.View(
        slot=slot,
        uav=None,
        uav_before=None,
        system=system_of(scenario),
        roster=roster,
        memory=None,
        normals=None,
        last_look=np.asarray(last_look),
        unanswered=np.full(roster.shape, unanswered),
    )


@pytest.mark.parametrize("objects", [1, 3])
@pytest.mark.parametrize("rate", [0.3, 2.0])
@pytest.mark.parametrize("frame", ["adaptive", "probing"])
def test_looks_come_at_the_period_of_least_loss(frame, rate, objects):
    """The loss per time is c DT / T + lambda T / (2 n); its minimum is found numerically."""
    made = AdaptiveFrame(arrival_rate=rate) if frame == "adaptive" else ProbingFrame(
        arrival_rate=rate
    )  # fmt: skip
    cost = getattr(made, "share", 1.0)
    duration = UNLABELLED.frame.slot
    best = minimize_scalar(
        lambda period: cost * duration / period + rate * period / (2 * objects),
        bounds=(1e-3, 30.0),
        method="bounded",
        options={"xatol": 1e-9},
    ).x
    belief = tracks([[True] * objects])
    slots = np.arange(2, 500)
    looked = [made.mode(belief, view(UNLABELLED, int(s), [1], belief.id))[0] for s in slots]
    first = slots[np.asarray(looked) != Mode.DIRECTIONAL][0]
    assert (first - 1) * duration == pytest.approx(best, abs=duration)
    assert set(looked) == {
        Mode.DIRECTIONAL,
        Mode.OMNI if frame == "adaptive" else Mode.MIXED,
    }


@pytest.mark.parametrize("frame", [AdaptiveFrame(), ProbingFrame()])
def test_each_trial_looks_for_reasons_of_its_own(frame):
    roster = np.tile([0, 1], (5, 1))
    known = np.array([[1, 1], [1, 0], [1, 1], [1, 1], [1, 1]], dtype=bool)
    belief = tracks(known, roster)
    cov = belief.cov.copy()
    cov[2:4, 1, 0, 0] = np.radians(30.0) ** 2  # known to several beam widths only
    belief = Tracks(belief.mean, cov, belief.status, belief.id)
    last = [5, 5, 5, 9, 0]
    mode = frame.mode(belief, view(LABELLED, 10, last, roster))
    # nothing lacks; one unknown; one lost; one lost, but looked for a slot ago; never looked
    assert mode.tolist() == [Mode.DIRECTIONAL, Mode.OMNI, Mode.OMNI, Mode.DIRECTIONAL, Mode.OMNI]
    assert frame.sensed(belief, mode, view(LABELLED, 10, last, roster)).tolist() == [
        [True, True],
        [True, True],
        [True, True],
        [True, True],
        [True, True],
    ]
    beams = np.zeros(5, dtype=np.int8) + Mode.DIRECTIONAL
    assert not frame.sensed(belief, beams, view(LABELLED, 10, last, roster))[1, 1]


def test_the_roster_announces_so_nobody_is_looked_for():
    belief = tracks([[True, True]])
    for frame in (AdaptiveFrame(arrival_rate=100.0), ProbingFrame(arrival_rate=100.0)):
        assert frame.mode(belief, view(LABELLED, 1000, [1], belief.id))[0] == Mode.DIRECTIONAL


@pytest.mark.parametrize("frame", [AdaptiveFrame(patience=3), ProbingFrame(patience=3)])
def test_an_object_that_never_answers_is_looked_for_once_a_frame(frame):
    """After ``patience`` looks; while nobody else is known every second slot may be one."""
    belief = tracks([[True, False]], [[0, 1]])
    nobody = tracks([[False, False]], [[0, 1]])

    def looks(belief, since, unanswered):
        mode = frame.mode(belief, view(LABELLED, 50, [50 - since], belief.id, unanswered))
        return bool(mode[0] == Mode.OMNI)

    assert looks(belief, since=2, unanswered=2)
    assert not looks(belief, since=9, unanswered=3)
    assert looks(belief, since=LABELLED.frame.slots_per_frame, unanswered=3)
    assert looks(nobody, since=2, unanswered=30)
    assert not looks(tracks([[True, True]]), since=200, unanswered=30)


def test_an_object_behind_the_array_takes_one_slot_of_a_frame_and_is_found_once_it_is_ahead():
    """It comes ahead of the array after 0.2 s, in the middle of the third frame."""
    scenario = eb.load_scenario("ground").replace(
        {
            "array.facing": "ahead",
            "frame.frames": 4,
            "objects": [
                {"position": [60, 20], "velocity": [-3, 3]},
                {"position": [-5, 30], "velocity": [22, 0]},
            ],
        }
    )
    result = eb.simulate(scenario, schemes=["posterior"], trials=2, seed=1)
    looks = result["mode"].values[0] == Mode.OMNI
    assert (looks[:, :10].sum(axis=-1) == 5).all()
    assert (looks[:, 10:23].sum(axis=-1) == 1).all()
    found = np.isfinite(result["estimated"].values[0, :, :, 1, 0])
    assert not found[:, :22].any()
    assert found[:, 33:].all()
    assert not looks[:, 34:].any()


def test_beams_for_the_rest_of_the_power_have_the_sinr_that_they_were_made_for():
    """(1 - s) g / ((1 - s) i + s P + loss) = g / (i + (loss + s P) / (1 - s))."""
    random = np.random.default_rng(5)
    system = system_of(LABELLED.replace({"radio.power": 3.0}))
    array, radio = system.transmitter, system.radio
    beams = random.normal(size=(4, 2, array.n)) + 1j * random.normal(size=(4, 2, array.n))
    beams *= np.sqrt(radio.power / np.sum(np.abs(beams) ** 2, axis=(-2, -1), keepdims=True))
    theta, distance = random.uniform(0.5, 2.5, (4, 2)), random.uniform(80.0, 150.0, (4, 2))
    share = np.array([0.0, 0.05, 0.3, 0.9])
    own = np.broadcast_to(np.eye(2, dtype=bool), (4, 2, 2))
    sent = transmission.with_probing(beams, share, radio.power)
    loss = channel_loss(distance, radio.noise, radio.alpha0)
    there = sinr(sent, own, theta, loss, array)
    made_for = sinr(
        transmission.directional(beams), own, theta, system.loss(distance, share), array
    )
    np.testing.assert_allclose(there, made_for, rtol=1e-12)
    assert np.all(sent.probing.sum(axis=-1) == pytest.approx(share * radio.power))
    np.testing.assert_allclose(transmission.radiated_power(sent), radio.power, rtol=1e-12)


@pytest.mark.slow
def test_with_labels_one_look_is_enough_while_nobody_arrives():
    scenario = eb.load_scenario("paper-long").replace({"coverage.min_rate": 0.0})
    result = eb.simulate(scenario, schemes=["posterior"], trials=2, seed=3)
    assert (result["mode"].values == Mode.OMNI).sum(axis=-1).tolist() == [[1, 1]]


@pytest.mark.slow
def test_a_share_of_the_power_finds_whom_nobody_announces():
    scenario = UNLABELLED.replace({"frame.frames": 4})
    result = eb.simulate(scenario, schemes=["posterior:arrival_rate=5"], trials=2, seed=3)
    mode = result["mode"].values[0]
    assert (mode[:, 0] == Mode.OMNI).all()
    assert (mode == Mode.MIXED).any(axis=-1).all()
    found = result["track_object"].values[0]
    assert ((found == 2).any(axis=(-2, -1))).all()  # it appears at 0.2 s


class Mixer:
    """Frame that mixes without saying how much."""

    def mode(self, tracks, view):
        return np.full(view.n_trials, Mode.MIXED, dtype=np.int8)

    def sensed(self, tracks, mode, view):
        return tracks.known


def test_a_frame_that_mixes_says_what_share(monkeypatch):
    from dataclasses import replace

    scheme = replace(configure(LABELLED, "water-filling").scheme, frame=Mixer(), name="mixer")
    with pytest.raises(SchemeError, match="mode"):
        eb.simulate(LABELLED, schemes=[scheme], trials=1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("share=0", "between 0 and 1"),
        ("share=1", "between 0 and 1"),
        ("arrival_rate=-1", "expected a number >= 0"),
        ("lost=0", "expected a number > 0"),
        ("patience=0", "expected 1 or more"),
    ],
)
def test_what_makes_no_frame_is_one_message(text, words):
    with pytest.raises(eb.InputError, match=words):
        configure(UNLABELLED, f"posterior:{text}")
