"""A scheme of parts on unlabelled detections, which are associated to tracks of its own.

The frame and the beamer are the scheme's own and see tracks in place of objects. Detections are
associated by an extended Kalman filter's predictions. It is the scheme's tracker where that is
the paper's filter; any other tracker is given the detections that are taken to be a track's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from echobeam.brief import Brief
from echobeam.physics import transmission
from echobeam.physics.array import LinearArray
from echobeam.physics.coordinates import direction_of, spread_shape
from echobeam.schemes.base import Decision, View, no_tracks, reported
from echobeam.schemes.covers import predicted_spread
from echobeam.schemes.heights import depth_of
from echobeam.schemes.models import first_state, measurement_of, motion_of
from echobeam.schemes.parts import PartsBelief, SchemeOfParts, in_order
from echobeam.schemes.shared import share
from echobeam.schemes.trackers import ExtendedKalman
from echobeam.tracking import bank as banks
from echobeam.tracking import filter as ekf
from echobeam.tracking.bank import Bank, LifeRules
from echobeam.tracking.unlabelled import Scan
from echobeam.tracking.unlabelled import update as update_unlabelled
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    Detections,
    IntArray,
    Mode,
    ModeArray,
    Status,
    Tracks,
    Transmission,
    aligned,
    with_beams,
)

LIT = 0.5
"""Probability of detection from which a place counts as lit: there a missed detection counts
against a track."""

LEAST_PROBABILITY = 0.1
"""Probability of detection from which a detection may be a new object's: below it, false ones of
places where nothing is sent are the more frequent ones."""

GROUND_STDS = 4.0
"""Standard deviations of the height d sin(theta) by which a new object may be off the ground."""


@dataclass(frozen=True, slots=True, repr=False)
class UnlabelledBelief(Brief):
    """Belief about an unknown number of objects.

    Attributes
    ----------
    bank
        The tracks as the extended Kalman filter has them.
    own
        The belief of the scheme's tracker, where it is another.
    tracks
        The tracks that the beams are made for.
    last
        Those of the last slot.
    memory
        Hypotheses of the association, if it has several.
    """

    bank: Bank
    own: Any
    tracks: Tracks
    last: Tracks
    memory: Any = None


@dataclass(frozen=True, slots=True)
class Unlabelled:
    """A scheme of parts on unlabelled detections.

    Attributes
    ----------
    scheme
        Its frame, tracker and beamer.
    """

    scheme: SchemeOfParts

    @property
    def name(self) -> str:
        """Name in results."""
        return self.scheme.name

    @property
    def omniscient(self) -> bool:
        """Never."""
        return False

    @property
    def frame(self) -> object:
        """The scheme's frame."""
        return self.scheme.frame

    @property
    def tracker(self) -> object:
        """The scheme's tracker."""
        return self.scheme.tracker

    @property
    def beamer(self) -> object:
        """The scheme's beamer."""
        return self.scheme.beamer

    def start(self, view: View) -> UnlabelledBelief:
        """Return no tracks."""
        table = view.system.tracks
        held = table.hypotheses if table.association == "mht" else 1
        geometry = view.system.geometry
        shape = spread_shape(geometry.axes)
        bank = banks.empty(view.n_trials, table.capacity, geometry.space.size, held, shape)
        own = None if self._kalman else self.scheme.tracker.start(_among(bank, view))
        nothing = no_tracks(bank.id, geometry.space.size)
        return UnlabelledBelief(bank, own, nothing, nothing)

    def predict(self, belief: UnlabelledBelief, view: View) -> UnlabelledBelief:
        """Return the prediction of every track, Eqs. (44)-(46)."""
        state = ekf.predict(belief.bank.state, motion_of(view.system), view.uav_before)
        bank = banks.pruned(replace(belief.bank, state=state))
        own, tracks = None, bank.tracks
        if not self._kalman:
            own = self.scheme.tracker.predict(belief.own, _among(bank, view))
            tracks = _reported(own, bank, "predict", bank.roster)
        return UnlabelledBelief(bank, own, tracks, belief.tracks, belief.memory)

    def transmit(self, prior: UnlabelledBelief, view: View) -> Decision:
        """Return the scheme's decision for its tracks; trials without any look for objects."""
        id, among = prior.bank.id, _among(prior.bank, view)
        last = in_order(prior.last, id)
        aim = getattr(self.scheme.beamer, "aim", "prior")
        sharing = share(prior.tracks if aim == "prior" else last, view.system, view.uav)
        width = view.system.coverage.width
        parts = PartsBelief(
            prior.own,
            sharing.applied(prior.tracks, width),
            sharing.applied(last, width),
            sharing.spread(_spread(prior, view), width),
            np.zeros_like(id),
        )
        decision = self.scheme.transmit(parts, among)
        mode = self._mode(prior, decision.mode)
        searching = mode != decision.mode
        nobody = np.zeros(id.shape, dtype=bool)
        radio, n_tx = view.system.radio, view.system.transmitter.n
        probing = transmission.omni(nobody, radio.power, n_tx)
        sent = transmission.choose(searching, probing, decision.sent)
        beams = with_beams(mode)[:, None]
        # There is no beam to share in an omnidirectional slot: every track has a stream.
        apart = (mode == Mode.OMNI) & sharing.follows.any(axis=-1)
        if apart.any():
            streams = transmission.omni(prior.tracks.id != NOBODY, radio.power, n_tx)
            sent = transmission.choose(apart, streams, sent)
        return replace(
            decision,
            sent=sent,
            addressee=np.where(prior.tracks.id == NOBODY, last.id, prior.tracks.id),
            mode=mode,
            sensed=np.broadcast_to(self._receives(mode, among)[:, None], id.shape),
            carrier=np.where(beams, sharing.leader, np.arange(id.shape[-1])),
        )

    def update(
        self, prior: UnlabelledBelief, detections: Detections, view: View
    ) -> UnlabelledBelief:
        """Return the posterior: tracks updated, confirmed and ended, and new ones."""
        bank, among, system = prior.bank, _among(prior.bank, view), view.system
        mode = view.mode
        assert mode is not None
        receives = self._receives(mode, among)
        seen = _probability(view, _places(bank.state.mean, view)) * receives[:, None, None]
        model, geometry = measurement_of(system), system.geometry
        associated = update_unlabelled(
            bank.state,
            prior.memory,
            _scan(detections, seen, bank.state.mean, view),
            model,
            view.uav,
            geometry.space,
        )
        taken = associated.taken
        sigma = np.sqrt(direction_of(detections.variance, geometry.axes))
        spread = _chosen(sigma, taken, bank.spread)
        if self._kalman:  # as with labels: (38f) has the bound of the last directional slot
            spread = np.where(aligned(mode == Mode.OMNI, spread), bank.spread, spread)
        updated = replace(bank, state=associated.state, spread=spread)
        updated = banks.pruned(banks.aged(updated, taken >= 0, seen[:, 0] >= LIT, rules(view)))
        first = first_state(detections.value, detections.variance, view)
        new = associated.free & _believed(detections, view)
        begun, source = banks.with_births(
            updated, bank.id == NOBODY, first, new, sigma, rules(view)
        )
        if self._kalman:
            return UnlabelledBelief(begun, None, begun.tracks, prior.last, associated.memory)
        given = _given(detections, np.maximum(taken, source), bank.roster)
        own = self.scheme.tracker.update(prior.own, given, among)
        tracks = _reported(own, begun, "update", bank.roster)
        return UnlabelledBelief(begun, own, tracks, prior.last, associated.memory)

    @property
    def _kalman(self) -> bool:
        return isinstance(self.scheme.tracker, ExtendedKalman)

    def _mode(self, prior: UnlabelledBelief, decided: ModeArray) -> ModeArray:
        """Return the mode of each trial: one without tracks looks for objects."""
        alone = (prior.bank.id == NOBODY).all(axis=-1)
        looks = getattr(self.scheme.frame, "looks", Mode.OMNI)
        return np.where(alone & with_beams(decided), looks, decided).astype(np.int8)

    def _receives(self, mode: ModeArray, view: View) -> BoolArray:
        """Return ``(T,)``: whether the frame has the radar on in the slot.

        A frame says whose echoes are processed; without labels those of all or of nobody are.
        """
        shape = (view.n_trials, 2)
        known = np.broadcast_to([True, False], shape)
        nowhere = no_tracks(np.broadcast_to([0, 1], shape))
        either = replace(nowhere, status=np.where(known, Status.CONFIRMED, 0).astype(np.int8))
        return np.asarray(self.scheme.frame.sensed(either, mode, view).any(axis=-1))


def rules(view: View) -> LifeRules:
    """Return the rules of life of a scheme's tracks."""
    table = view.system.tracks
    return LifeRules(table.confirm, table.window, table.coast)


def _among(bank: Bank, view: View) -> View:
    """Return the view with the tracks as the roster."""
    return replace(view, roster=bank.roster)


def _reported(own: Any, bank: Bank, call: str, roster: IntArray) -> Tracks:
    """Return the tracks of the scheme's own tracker, of those that the bank has."""
    tracks = in_order(reported(own, "the tracker", call), roster)
    there = tracks.known & (bank.id == roster)
    return Tracks(
        mean=np.where(there[..., None], tracks.mean, np.nan),
        cov=np.where(there[..., None, None], tracks.cov, np.nan),
        status=np.where(there, bank.status, Status.NONE).astype(np.int8),
        id=bank.id,
    )


def _spread(prior: UnlabelledBelief, view: View) -> Array:
    """Return ``(T, C)`` rad, or ``(T, C, 2)`` direction cosines: the deviation that (38f) covers.

    It is that of the last measurement, as the paper has it, or that of the prediction where this
    is larger: a track that is coasting or whose detection is in doubt is known less well.
    """
    state = prior.bank.state
    predicted = predicted_spread(state.mean[:, 0], state.cov[:, 0], view)
    spread: Array = np.fmax(prior.bank.spread, predicted)
    return spread


def _at(law: Callable[[Transmission, Array], Array], view: View, place: Array) -> Array:
    """Return a law of what was sent at places ``(T, ..., P)``."""
    assert view.sent is not None
    flat = place.reshape(len(place), -1, place.shape[-1])
    with np.errstate(all="ignore"):  # unknown tracks
        values = law(view.sent, flat)
    return values.reshape(*place.shape[:-1], *values.shape[2:])


def _probability(view: View, place: Array) -> Array:
    """Return the probability of detection ``(T, ...)`` at places ``(T, ..., P)``; 0 where NaN."""
    snr = _at(view.system.law.snr, view, place)
    return view.system.detection.probability(np.nan_to_num(snr, nan=0.0))


def _scan(detections: Detections, seen: Array, state: Array, view: View) -> Scan:
    """Return the detections as an association takes them."""
    system, law = view.system, view.system.detection
    table, mirror = system.tracks, np.full_like(detections.value, np.nan)
    receiver = law.receiver
    if isinstance(receiver, LinearArray) and receiver.axis == "vertical":
        mirror = detections.value.copy()
        mirror[..., 0] = np.pi - mirror[..., 0]
    return Scan(
        value=detections.value,
        variance=detections.variance,
        valid=detections.valid,
        mirror=mirror,
        probability=seen,
        density=law.density(direction_of(detections.value, system.geometry.axes)),
        density_without_angle=law.density_without_angle,
        gate=table.gate,
        method=table.association,
        scans=table.scans,
        predicted_variance=_predicted_variance(detections, state, view),
    )


def _predicted_variance(detections: Detections, state: Array, view: View) -> Array | None:
    """Return the variance of each detection if it is at a track's prediction, ``(T, H, C, D, M)``.

    It is the law there; for an echo that fluctuates, scaled by what is stated over the law at the
    detection: the receiver sees the strength of an echo.
    """
    system = view.system
    if not system.law_known:
        return None
    variance = _at(system.law.variance, view, _places(state, view))[..., None, :]
    if system.detection.fluctuation.steady:
        return variance
    plain = _at(system.law.variance, view, system.geometry.measured_place(detections.value))
    with np.errstate(invalid="ignore"):
        scale = np.where(detections.valid[..., None], detections.variance / plain, 1.0)
    return variance * scale[:, None, None]


def _believed(detections: Detections, view: View) -> BoolArray:
    """Return ``(T, D)``: which detections may be new objects.

    They are where an echo is possible, and on the ground: the UAV knows its height, and the noise
    does not.
    """
    geometry = view.system.geometry
    depth, square = depth_of(detections.value, detections.variance, geometry)
    ground = np.abs(depth - view.uav.position[2]) <= GROUND_STDS * np.sqrt(square)
    believed: BoolArray = (
        detections.valid
        & ground
        & (_probability(view, geometry.measured_place(detections.value)) >= LEAST_PROBABILITY)
    )
    return believed


def _places(state: Array, view: View) -> Array:
    """Return the places ``(T, ..., P)`` of states ``(T, ..., S)``."""
    with np.errstate(invalid="ignore"):  # unknown tracks
        return view.system.geometry.place(state, view.uav)


def _chosen(values: Array, taken: IntArray, otherwise: Array) -> Array:
    """Return each track's value ``(T, C, ...)`` of those of the detections ``(T, D, ...)``."""
    if values.shape[1] == 0:
        return otherwise
    found = aligned(taken >= 0, otherwise)
    own = np.take_along_axis(values, np.maximum(taken, 0).reshape(found.shape), axis=1)
    return np.where(found, own, otherwise)


def _given(detections: Detections, taken: IntArray, roster: IntArray) -> Detections:
    """Return the detections that are taken to be the tracks', labelled with them."""
    found, place = (taken >= 0)[..., None], np.maximum(taken, 0)[..., None]
    if detections.valid.shape[-1] == 0:
        shape = (*taken.shape, detections.value.shape[-1])
        return Detections(np.full(shape, np.nan), np.full(shape, np.inf), found[..., 0], roster)
    value = np.take_along_axis(detections.value, place, axis=1)
    variance = np.take_along_axis(detections.variance, place, axis=1)
    return Detections(
        np.where(found, value, np.nan), np.where(found, variance, np.inf), found[..., 0], roster
    )
