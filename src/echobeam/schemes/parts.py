"""Schemes as a choice of parts: when to look, how to track, how to beam."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from echobeam.physics import transmission
from echobeam.schemes.base import Belief, Decision, View, no_tracks, reported
from echobeam.schemes.beamers import Aim, Beams
from echobeam.schemes.trackers import labelled
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    Detections,
    Mode,
    ModeArray,
    Tracks,
    Transmission,
)


@runtime_checkable
class Frame(Protocol):
    """Part that decides when to look around."""

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


@dataclass(frozen=True, slots=True)
class PartsBelief:
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
        never.
    """

    own: Belief
    tracks: Tracks
    last: Tracks
    spread: Array


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
        nothing = no_tracks(view.roster)
        spread = np.full(view.roster.shape, np.nan)
        return PartsBelief(self.tracker.start(view), nothing, nothing, spread)

    def predict(self, belief: PartsBelief, view: View) -> PartsBelief:
        """Return the tracker's prediction."""
        own = self.tracker.predict(belief.own, view)
        last = belief.tracks
        stays = last.id == view.roster
        if not stays.all():
            last = _without(last, stays)
        spread = np.where(stays, belief.spread, np.nan)
        return PartsBelief(own, reported(own, self.name, "predict"), last, spread)

    def transmit(self, prior: PartsBelief, view: View) -> Decision:
        """Return the frame's choice of omnidirectional, pilot and directional trials."""
        tracks = prior.tracks
        mode = self.frame.mode(tracks, view)
        directional = mode == Mode.DIRECTIONAL
        radio, n_tx = view.system.radio, view.system.array.n_tx
        served = tracks.id != NOBODY
        covered = np.full(tracks.id.shape, np.nan)
        made = Beams(np.zeros((*tracks.id.shape, n_tx)), covered, np.zeros(len(mode), dtype=bool))
        if directional.any():
            made = self.beamer.beams(Aim(tracks, prior.last, prior.spread, directional), view)
        sent: Transmission = transmission.directional(made.beams)
        for label, send in ((Mode.OMNI, transmission.omni), (Mode.PILOT, transmission.pilot)):
            trials = mode == label
            if trials.any():
                sent = transmission.choose(trials, send(served, radio.power, n_tx), sent)
        return Decision(
            sent=sent,
            addressee=tracks.id,
            sensed=self.frame.sensed(tracks, mode, view),
            mode=mode,
            covered=made.covered,
            fallback=made.fallback,
            messages=made.messages,
            memory=made.memory if directional.any() else view.memory,
        )

    def update(self, prior: PartsBelief, detections: Detections, view: View) -> PartsBelief:
        """Return the tracker's posterior."""
        own = self.tracker.update(prior.own, detections, view)
        _, variance = labelled(detections, prior.tracks.id)
        measured = np.isfinite(variance[..., 0])
        sigma = np.sqrt(np.where(measured, variance[..., 0], 0.0))
        spread = np.where(measured, sigma, prior.spread)
        return PartsBelief(own, reported(own, self.name, "update"), prior.last, spread)


def _without(tracks: Tracks, stays: BoolArray) -> Tracks:
    """Return the tracks of a mask ``(T, C)``, the others unknown."""
    return Tracks(
        mean=np.where(stays[..., None], tracks.mean, np.nan),
        cov=np.where(stays[..., None, None], tracks.cov, np.nan),
        status=np.where(stays, tracks.status, 0).astype(np.int8),
        id=tracks.id,
    )
