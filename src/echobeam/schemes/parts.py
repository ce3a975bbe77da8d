"""Schemes as a choice of parts: when to look, how to track, how to beam."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np

from echobeam.brief import Brief
from echobeam.physics import transmission
from echobeam.physics.coordinates import cover_shape, direction_of, spread_shape
from echobeam.schemes.answers import check_array, check_mode, check_tracks
from echobeam.schemes.base import Belief, Decision, SchemeError, View, no_tracks, reported
from echobeam.schemes.beamers import Aim, Beams
from echobeam.schemes.trackers import labelled
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    Detections,
    IntArray,
    Mode,
    ModeArray,
    Tracks,
    aligned,
    with_beams,
)


@runtime_checkable
class Frame(Protocol):
    """Part that decides when to look around.

    A frame may mix the two: one with an attribute ``share``, a part of the power, may answer
    `Mode.MIXED`, beams with the rest of it while that part goes in all directions, without data.
    """

    def mode(self, tracks: Tracks, view: View) -> ModeArray:
        """Return ``(T,)`` `Mode`: what each trial does in this slot."""

    def sensed(self, tracks: Tracks, mode: ModeArray, view: View) -> BoolArray:
        """Return ``(T, C)``: the tracks whose echoes are processed."""


@runtime_checkable
class Tracker(Protocol):
    """Part that turns detections into a belief of its own type, which reports `Tracks`."""

    def start(self, view: View) -> Any:
        """Return the belief before the first slot."""

    def predict(self, belief: Any, view: View) -> Any:
        """Return the prior of this slot; objects that left the roster are forgotten."""

    def update(self, prior: Any, detections: Detections, view: View) -> Any:
        """Return the posterior of this slot."""


@runtime_checkable
class Beamer(Protocol):
    """Part that makes beams for a belief."""

    def beams(self, aim: Aim, view: View) -> Beams:
        """Return the beams of the trials that send some in this slot."""


@dataclass(frozen=True, slots=True, repr=False)
class PartsBelief(Brief):
    """Belief of a scheme of parts: the tracker's, and what (38f) needs of the slots before.

    Attributes
    ----------
    own
        The tracker's belief.
    tracks
        What it reports.
    last
        Tracks of the last posterior, of the objects that are still on the roster.
    spread
        ``(T, C)`` rad: sigma_theta of the last slot in which the object was measured; NaN if
        never. On the ground ``(T, C, 2)``, of both direction cosines.
    unanswered
        ``(T, C)``: looks since the last echo of each object, or since it came on the roster.
    """

    own: Belief
    tracks: Tracks
    last: Tracks
    spread: Array
    unanswered: IntArray


@dataclass(frozen=True, slots=True)
class SchemeOfParts:
    """A frame, a tracker and a beamer under one name.

    Attributes
    ----------
    name
        Name in results.
    frame, tracker, beamer
        The parts.
    """

    name: str
    frame: Frame
    tracker: Tracker
    beamer: Beamer

    @property
    def omniscient(self) -> bool:
        """Never: it knows what its radar gives."""
        return False

    def start(self, view: View) -> PartsBelief:
        """Return the belief before the first slot."""
        nothing = no_tracks(view.roster, view.system.geometry.space.size)
        axes = view.system.geometry.axes
        spread = np.full((*view.roster.shape, *spread_shape(axes)), np.nan)
        own = _call(self.tracker, "tracker", "start", view)
        return PartsBelief(own, nothing, nothing, spread, np.zeros_like(view.roster))

    def predict(self, belief: PartsBelief, view: View) -> PartsBelief:
        """Return the tracker's prediction."""
        own = _call(self.tracker, "tracker", "predict", belief.own, view)
        last = belief.tracks
        stays = last.id == view.roster
        if not stays.all():
            last = _without(last, stays)
        spread = np.where(aligned(stays, belief.spread), belief.spread, np.nan)
        unanswered = np.where(stays, belief.unanswered, 0)
        return PartsBelief(own, self._tracks(own, "predict", view), last, spread, unanswered)

    def transmit(self, prior: PartsBelief, view: View) -> Decision:
        """Return the frame's choice of omnidirectional, pilot and directional trials."""
        tracks, view = prior.tracks, replace(view, unanswered=prior.unanswered)
        mode = _call(self.frame, "frame", "mode", tracks, view)
        mixes = hasattr(self.frame, "share")
        check_mode(f"{_name(self.frame, 'frame')}: mode", mode, view.n_trials, _modes(mixes))
        directional = with_beams(mode)
        share = np.where(mode == Mode.MIXED, getattr(self.frame, "share", 0.0), 0.0)
        radio, n_tx = view.system.radio, view.system.transmitter.n
        served = tracks.id != NOBODY
        cover = cover_shape(view.system.geometry.axes)
        covered = np.full((*tracks.id.shape, *cover), np.nan)
        made = Beams(np.zeros((*tracks.id.shape, n_tx)), covered, np.zeros(len(mode), dtype=bool))
        if directional.any():
            aim = Aim(tracks, prior.last, prior.spread, directional, share)
            made = _call(self.beamer, "beamer", "beams", aim, view)
            _check_beams(_name(self.beamer, "beamer"), made, (*tracks.id.shape, n_tx), cover)
        sent = transmission.with_probing(made.beams, share, radio.power)
        for label, send in ((Mode.OMNI, transmission.omni), (Mode.PILOT, transmission.pilot)):
            trials = mode == label
            if trials.any():
                sent = transmission.choose(trials, send(served, radio.power, n_tx), sent)
        return Decision(
            sent=sent,
            addressee=tracks.id,
            sensed=_call(self.frame, "frame", "sensed", tracks, mode, view),
            mode=mode,
            covered=made.covered,
            fallback=made.fallback,
            messages=made.messages,
            memory=made.memory if directional.any() else view.memory,
        )

    def update(self, prior: PartsBelief, detections: Detections, view: View) -> PartsBelief:
        """Return the tracker's posterior."""
        own = _call(self.tracker, "tracker", "update", prior.own, detections, view)
        _, variance = labelled(detections, prior.tracks.id)
        square = direction_of(variance, view.system.geometry.axes)
        measured = np.isfinite(square)
        sigma = np.sqrt(np.where(measured, square, 0.0))
        spread = np.where(measured, sigma, prior.spread)
        looked = np.asarray(view.mode != Mode.DIRECTIONAL)[:, None]
        answered = measured if measured.ndim == looked.ndim else measured.any(axis=-1)
        unanswered = np.where(answered, 0, prior.unanswered + looked)
        return PartsBelief(own, self._tracks(own, "update", view), prior.last, spread, unanswered)

    def _tracks(self, own: Any, call: str, view: View) -> Tracks:
        """Return the tracks that the tracker's belief reports, in the order of the roster."""
        label = _name(self.tracker, "tracker")
        tracks = reported(own, label, call)
        if tracks.id is view.roster:
            return tracks
        size = view.system.geometry.space.size
        check_tracks(
            f"{label}, tracks from {call} of slot {view.slot}", tracks, view.n_trials, size
        )
        return in_order(tracks, view.roster)


def _modes(mixes: bool) -> tuple[Mode, ...]:
    """Return the modes that a frame may choose for a trial; only some frames mix them."""
    pure = (Mode.OMNI, Mode.DIRECTIONAL, Mode.PILOT)
    return (*pure, Mode.MIXED) if mixes else pure


def misfits(scheme: SchemeOfParts) -> list[str]:
    """Return why the parts of a scheme do not go together, in words; nothing if they do."""
    fits = getattr(scheme.tracker, "predicts", True) or not getattr(
        scheme.frame, "directional", True
    )
    if fits or getattr(scheme.beamer, "aim", "last") != "prior":
        return []
    return [
        f"{_name(scheme.tracker, 'tracker')} predicts nothing, and beams aimed at the prediction "
        "would go to nobody; give another tracker, or aim=last"
    ]


def _name(part: object, kind: str) -> str:
    return f"{kind} {type(part).__name__}"


def _call(part: object, kind: str, call: str, *arguments: object) -> Any:
    """Return what a call of a part gives.

    Raises
    ------
    SchemeError
        If the call does not take these arguments; what its code raises goes on as it is.
    """
    try:
        return getattr(part, call)(*arguments)
    except TypeError as error:
        if error.__traceback__ is not None and error.__traceback__.tb_next is not None:
            raise
        given = ", ".join(type(argument).__name__ for argument in arguments)
        raise SchemeError(f"{_name(part, kind)}: {call}({given}): {error}") from error


def _check_beams(
    label: str, made: object, shape: tuple[int, int, int], cover: tuple[int, ...]
) -> None:
    """Refuse what is no `Beams` of the tracks ``(T, C, N)`` with covers of a shape."""
    if not isinstance(made, Beams):
        raise SchemeError(
            f"{label}: beams returned a {type(made).__name__}; expected echobeam.Beams"
        )
    check_array(f"{label}: beams", made.beams, shape, "complex numbers")
    check_array(f"{label}: covered", made.covered, (*shape[:2], *cover), "real numbers")
    check_array(f"{label}: fallback", made.fallback, shape[:1], "true or false")


def in_order(tracks: Tracks, roster: IntArray) -> Tracks:
    """Return tracks in the columns of a roster ``(T, K)``, unknown where it has no track."""
    if tracks.id.shape == roster.shape and np.array_equal(tracks.id, roster):
        return tracks
    match = (tracks.id[:, None, :] == roster[..., None]) & (roster != NOBODY)[..., None]
    found = match.any(axis=-1)
    if not found.any():
        return no_tracks(roster, tracks.mean.shape[-1])
    place = np.argmax(match, axis=-1)
    chosen = Tracks(
        mean=np.take_along_axis(tracks.mean, place[..., None], axis=1),
        cov=np.take_along_axis(tracks.cov, place[..., None, None], axis=1),
        status=np.take_along_axis(tracks.status, place, axis=1),
        id=roster,
    )
    return _without(chosen, found)


def _without(tracks: Tracks, stays: BoolArray) -> Tracks:
    """Return the tracks of a mask ``(T, C)``, the others unknown."""
    return Tracks(
        mean=np.where(stays[..., None], tracks.mean, np.nan),
        cov=np.where(stays[..., None, None], tracks.cov, np.nan),
        status=np.where(stays, tracks.status, 0).astype(np.int8),
        id=tracks.id,
    )
