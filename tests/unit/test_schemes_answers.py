"""Whatever a scheme or a part answers that breaks the contract is one clear message."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.base import SchemeError
from echobeam.schemes.beamers import CoverBeamer, MatchedBeamer
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.trackers import ExtendedKalman
from echobeam.schemes.water_filling import WATER_FILLING

SCENARIO = eb.load_scenario("paper-multi", {"frame.slots_per_frame": 4})


def run(scheme, trials=3):
    return eb.simulate(SCENARIO, schemes=[scheme], trials=trials)


class Whole:
    """A whole scheme whose decision is changed on its way."""

    name = "whole"
    omniscient = False

    def __init__(self, change):
        self.change = change

    def start(self, view):
        return WATER_FILLING.start(view)

    def predict(self, belief, view):
        return WATER_FILLING.predict(belief, view)

    def transmit(self, prior, view):
        return self.change(WATER_FILLING.transmit(prior, view))

    def update(self, prior, detections, view):
        return WATER_FILLING.update(prior, detections, view)


def sent(decision, **changes):
    return replace(decision, sent=replace(decision.sent, **changes))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: replace(d, sent=None), "sent of type NoneType in slot 1"),
        (lambda d: sent(d, beams=d.sent.beams.tolist()), "beams is a list; expected a NumPy array"),
        (lambda d: sent(d, beams=d.sent.beams.astype(object)), "beams is of type object"),
        (lambda d: sent(d, beams=d.sent.beams[..., 1:]), r"beams is of shape \(3, 2, 29\)"),
        (lambda d: replace(d, addressee=d.addressee.astype(float)), "addressee is of type float64"),
        (lambda d: replace(d, addressee=0 * d.addressee), "two streams to one track"),
        (lambda d: replace(d, sensed=d.sensed.astype(int)), "sensed .* expected true or false"),
        (lambda d: replace(d, mode=d.mode.tolist()), "mode is a list"),
        (lambda d: replace(d, mode=d.mode + 7), r"mode is 7; expected 0 \(omni\)"),
        (lambda d: replace(d, covered=-np.ones((3, 2))), "covers a negative"),
        (lambda d: replace(d, covered=np.full((3, 2), np.inf)), "covers a negative or infinite"),
        (lambda d: replace(d, covered=np.full((3, 2), "wide")), "covered is of type <U4"),
        (lambda d: replace(d, fallback=np.full(3, np.nan)), "fallback .* expected true or false"),
    ],
)
def test_decisions(change, said):
    with pytest.raises(SchemeError, match=said):
        run(Whole(change))


@dataclass(frozen=True)
class Report:
    """The belief of a filter, reported in another way."""

    belief: object
    change: object

    @property
    def tracks(self):
        return self.change(self.belief.tracks)


@dataclass(frozen=True)
class Reporter:
    """The extended Kalman filter, which reports its tracks in another way."""

    change: object

    def start(self, view):
        return Report(ExtendedKalman().start(view), self.change)

    def predict(self, belief, view):
        return Report(ExtendedKalman().predict(belief.belief, view), self.change)

    def update(self, prior, detections, view):
        return Report(ExtendedKalman().update(prior.belief, detections, view), self.change)


def reporting(change, beamer=None):
    return SchemeOfParts("parts", ClockedFrame(), Reporter(change), beamer or MatchedBeamer())


def typo(tracks):
    return tracks.maen


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: None, "Reporter returned a belief of type Report from predict that reports no"),
        (lambda t: replace(t, mean=t.mean.tolist()), "mean is a list"),
        (lambda t: replace(t, cov=t.cov[..., 0]), r"cov is of shape \(3, 2, 3\)"),
        (lambda t: replace(t, status=t.status + 9), "status is none of 0, 1, 2, 3"),
        (lambda t: replace(t, mean=t.mean * np.nan), "the mean of a known track is not finite"),
        (lambda t: replace(t, cov=-t.cov), "a variance of a known track is negative"),
        (typo, r"answers.py, line \d+, in typo: AttributeError: .*, predict of slot 1"),
    ],
)
def test_tracks(change, said):
    with pytest.raises(SchemeError, match=said):
        run(reporting(change))


def taken(tracks, columns):
    return eb.Tracks(
        *(getattr(tracks, name)[:, columns] for name in ("mean", "cov", "status", "id"))
    )


@pytest.mark.parametrize("beamer", [MatchedBeamer(), CoverBeamer()])
@pytest.mark.parametrize("columns", [[1, 0], [1, 0, 1]], ids=["another order", "one twice"])
def test_tracks_in_another_order_are_the_same_tracks(columns, beamer):
    """Matched by identity: the order in which a tracker reports is its own affair."""
    plain = SchemeOfParts("parts", ClockedFrame(), ExtendedKalman(), beamer)
    other = run(reporting(lambda tracks: taken(tracks, columns), beamer))
    for name in ("rate", "predicted", "estimated", "covered"):
        np.testing.assert_array_equal(other[name], run(plain)[name])


def test_a_tracker_may_report_known_tracks_alone():
    def known(tracks):
        return taken(tracks, np.flatnonzero(tracks.known.any(axis=0)))

    plain = SchemeOfParts("parts", ClockedFrame(), ExtendedKalman(), MatchedBeamer())
    np.testing.assert_array_equal(run(reporting(known))["rate"], run(plain)["rate"])


@dataclass(frozen=True)
class Frame:
    """The paper's frame, with other answers."""

    answer: object

    def mode(self, tracks, view):
        return self.answer(ClockedFrame().mode(tracks, view))

    def sensed(self, tracks, mode, view):
        return ClockedFrame().sensed(tracks, mode, view)


class Unlike:
    """A frame whose calls take other arguments."""

    def mode(self, view):
        return np.zeros(view.n_trials, dtype=np.int8)

    def sensed(self, view):
        return np.ones(view.roster.shape, dtype=bool)


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (Frame(lambda mode: 1), "frame Frame: mode is a int; expected a NumPy array"),
        (Frame(lambda mode: mode * 0 + 3), r"mode is 3; expected 0 \(omni\), 1"),
        (Frame(lambda mode: mode[1:]), r"mode is of shape \(2,\); expected \(3,\)"),
        (Unlike(), r"frame Unlike: mode\(Tracks, View\): .* takes 2 positional arguments but 3"),
    ],
)
def test_frames(frame, said):
    with pytest.raises(SchemeError, match=said):
        run(SchemeOfParts("parts", frame, ExtendedKalman(), MatchedBeamer()))


@dataclass(frozen=True)
class Beamer:
    """Matched beams, with other answers."""

    answer: object

    def beams(self, aim, view):
        return self.answer(MatchedBeamer().beams(aim, view))


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda made: made.beams, "beamer Beamer: beams returned a ndarray; expected echobeam"),
        (lambda made: None, "beams returned a NoneType"),
        (lambda made: replace(made, covered=None), "covered is a NoneType"),
        (lambda made: replace(made, beams=made.beams[:, :1]), r"beams is of shape \(3, 1, 30\)"),
    ],
)
def test_beamers(answer, said):
    with pytest.raises(SchemeError, match=said):
        run(SchemeOfParts("parts", ClockedFrame(), ExtendedKalman(), Beamer(answer)))


def test_arrays_that_a_scheme_uses_again_are_recorded_as_they_were():
    store = np.zeros((3, 2))

    def numbered(decision):
        store[:] += 0.01
        return replace(decision, covered=store)

    covered = run(Whole(numbered))["covered"].isel(scheme=0).to_numpy()
    np.testing.assert_allclose(
        covered, np.broadcast_to([[[0.01], [0.02], [0.03], [0.04]]], covered.shape)
    )
