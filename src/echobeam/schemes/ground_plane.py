"""Tracker on the ground for objects on a plane, seen by a planar array."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.brief import Brief
from echobeam.physics.plane import GroundGeometry
from echobeam.schemes.base import View
from echobeam.schemes.trackers import labelled
from echobeam.tracking import fading, filter, ground_start, ground_update
from echobeam.tracking.gaussian_sum import Law
from echobeam.tracking.ground import PLANE, GroundMeasurement, GroundMotion
from echobeam.tracking.life import living
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import (
    Array,
    BoolArray,
    Detections,
    GaussianState,
    IntArray,
    Status,
    Tracks,
    Transmission,
)


@dataclass(frozen=True, slots=True, repr=False)
class PlaneBelief(Brief):
    """Gaussian belief about every object's position, velocity and altitude error.

    Attributes
    ----------
    state
        ``(T, K)`` objects: x, y, v_x, v_y, b in m and m/s.
    surprise
        Memory of the innovation test.
    id
        ``(T, K)``: identities.
    """

    state: GaussianState
    surprise: fading.Surprise
    id: IntArray

    @property
    def tracks(self) -> Tracks:
        """The same without the altitude error: the report is a part of the state."""
        status = np.where(self.state.known, Status.CONFIRMED, 0).astype(np.int8)
        return Tracks(self.state.mean[..., :4], self.state.cov[..., :4, :4], status, self.id)


@dataclass(frozen=True, slots=True)
class PlaneTracker:
    """Gaussian-sum filter of position and velocity on the plane, the altitude error unknown.

    Attributes
    ----------
    first_points
        Gaussians along each axis with which the position of a new object is sought.
    adaptive
        Whether the innovation test widens covariances.
    """

    first_points: int = 16
    adaptive: bool = True

    def start(self, view: View) -> PlaneBelief:
        """Return no knowledge."""
        shape = view.roster.shape
        nothing = GaussianState(
            mean=np.full((*shape, PLANE.size), np.nan),
            cov=np.full((*shape, PLANE.size, PLANE.size), np.nan),
            known=np.zeros(shape, dtype=bool),
        )
        return PlaneBelief(nothing, fading.no_surprise(shape), view.roster)

    def predict(self, belief: PlaneBelief, view: View) -> PlaneBelief:
        """Return the prediction of this slot; objects that left the roster are forgotten."""
        state = _where(belief.id == view.roster, belief.state)
        motion = GroundMotion(view.system.slot_duration, view.system.filter.velocity_std, axes=2)
        predicted = filter.predict(state, motion, view.uav_before)
        return PlaneBelief(predicted, _of(belief.surprise, state.known), view.roster)

    def update(self, prior: PlaneBelief, detections: Detections, view: View) -> PlaneBelief:
        """Return the posterior of known objects and the first state of new ones."""
        value, stated = labelled(detections, prior.id)
        value = np.where(np.isfinite(stated), value, np.nan)
        measured = np.isfinite(value)
        if not measured.any():
            return prior
        state, surprise, known = prior.state, prior.surprise, prior.state.known
        radar = Radar.of(view, prior.tracks, value, stated)
        tracked = known & measured.any(axis=-1)
        if tracked.any():
            state, nis, degrees = _updated(state, tracked, value, radar)
            if self.adaptive:
                surprise = fading.remembered(surprise, nis, degrees)
                factor, surprise = fading.widening(surprise, tracked)
                state = GaussianState(state.mean, state.cov * factor[..., None, None], state.known)
        new = ~known & measured[..., 2]
        if new.any():
            state = self._started(state, new, value, radar)
        return PlaneBelief(state, _of(surprise, known), prior.id)

    def _started(
        self, state: GaussianState, new: BoolArray, value: Array, radar: Radar
    ) -> GaussianState:
        """Return the belief with a first state of the new objects."""
        which = _places(new)
        system = radar.view.system
        speed = system.filter.new_velocity_std
        made = ground_start.first_state(
            value[which][:, None],
            radar.stated[which][:, None],
            radar.law(which),
            radar.model,
            radar.view.uav,
            (speed, speed, system.altitude_std),
            self.first_points,
        )
        mean, cov, known = state.mean.copy(), state.cov.copy(), state.known.copy()
        found = np.isfinite(made.mean).all(axis=(-2, -1))
        chosen = which[0][found], which[1][found]
        mean[chosen], cov[chosen], known[chosen] = made.mean[found, 0], made.cov[found, 0], True
        return living(mean, cov, known, PLANE)


@dataclass(frozen=True, slots=True)
class Radar:
    """Radar of a slot as the tracker knows it.

    Attributes
    ----------
    view, geometry, model
        The UAV's knowledge, the array's frame, and the measurement model.
    stated
        ``(T, K, 4)``: variances that the detections state.
    strength
        ``(T, K)``: how strong each echo is over its mean; None where all are alike.
    """

    view: View
    geometry: GroundGeometry
    model: GroundMeasurement
    stated: Array
    strength: Array | None

    @classmethod
    def of(cls, view: View, tracks: Tracks, value: Array, stated: Array) -> Radar:
        """Return that of the detections ``(T, K, 4)`` of some tracks."""
        geometry = view.system.geometry
        assert isinstance(geometry, GroundGeometry)
        axes = geometry.along_rows, geometry.along_columns
        model = GroundMeasurement(view.system.radio.carrier, 2, axes)
        strength = _strength(tracks, value, stated, geometry, view)
        return cls(view, geometry, model, stated, strength)

    @property
    def aperture(self) -> float:
        """Radians by which a beam turns per unit of a direction cosine, at most."""
        array = self.view.system.transmitter
        return 2.0 * np.pi * array.spacing * (max(array.shape) - 1)

    def law(self, which: tuple[IntArray, IntArray]) -> Law:
        """Return the law of the variance at states ``(n, 1, G, 5)`` of n objects.

        ``which`` are their trials and columns, ``(n,)`` each. Where detections state their own
        variance it is that one everywhere.
        """
        system, sent = self.view.system, self.view.sent
        trials, _ = which
        stated = self.stated[which][:, None, None, :]
        if not system.law_known:
            return lambda state: np.broadcast_to(stated, (*state.shape[:-1], stated.shape[-1]))
        assert sent is not None
        part = Transmission(sent.beams[trials], sent.antenna_power[trials], sent.probing[trials])
        strength = None if self.strength is None else self.strength[which][:, None]

        def variance(state: Array) -> Array:
            place = self._place(state)[:, 0]
            snr = system.law.snr(part, place, along=True)
            if strength is not None:
                snr = snr * strength
            return system.law.variance(part, place, snr)[:, None]

        return variance

    def _place(self, state: Array) -> Array:
        """Return the places of states ``(..., 5)``, as much lower as their altitude error says."""
        place = self.geometry.place(state[..., :4], self.view.uav)
        seen = self.model.expected(state, self.view.uav)[..., :3]
        place[..., :2] = seen[..., :2]
        behind = np.isinf(place[..., 2])
        place[..., 2] = np.where(behind, np.inf, 0.5 * SPEED_OF_LIGHT * seen[..., 2])
        return place


def _strength(
    tracks: Tracks, value: Array, stated: Array, geometry: GroundGeometry, view: View
) -> Array | None:
    """Return how strong each echo is over its mean, ``(T, K)``; None where all are alike.

    The receiver sees it; the variance of the delay is stated for it, at the prediction or, without
    one, at the measured place.
    """
    if not view.system.law_known or view.system.detection.fluctuation.steady:
        return None
    assert view.sent is not None
    predicted = geometry.place(tracks.mean, view.uav)
    here = np.where(tracks.known[..., None], predicted, geometry.measured_place(value))
    with np.errstate(all="ignore"):
        ratio = view.system.law.variance(view.sent, here)[..., 2] / stated[..., 2]
    return np.where(np.isfinite(ratio) & (ratio > 0.0), ratio, 1.0)


def _updated(
    prior: GaussianState, tracked: BoolArray, value: Array, radar: Radar
) -> tuple[GaussianState, Array, Array]:
    """Return the posterior of known objects, their innovations squared, and the components."""
    uav, model, which = radar.view.uav, radar.model, _places(tracked)
    mean, cov, known = prior.mean[which], prior.cov[which], prior.known[which]
    alone = GaussianState(mean[:, None], cov[:, None], known[:, None])

    def law(some: IntArray) -> Law:
        return radar.law((which[0][some], which[1][some]))

    seen = value[which][:, None]
    made = ground_update.update(alone, seen, law, model, uav, radar.aperture)
    counts = (np.isfinite(seen) & np.isfinite(made.variance)).sum(axis=-1)[:, 0]
    mean, cov = prior.mean.copy(), prior.cov.copy()
    nis, degrees = np.full(tracked.shape, np.nan), np.zeros(tracked.shape)
    used = counts > 0
    chosen = which[0][used], which[1][used]
    mean[chosen], cov[chosen] = made.mean[used, 0], made.cov[used, 0]
    nis[which], degrees[which] = made.nis[:, 0], counts
    return living(mean, cov, prior.known, PLANE), nis, degrees


def _places(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the trials and columns where a mask ``(T, K)`` is true."""
    trials, columns = np.nonzero(mask)
    return trials.astype(np.int64), columns.astype(np.int64)


def _where(stays: BoolArray, state: GaussianState) -> GaussianState:
    """Return the belief about some objects only."""
    if stays.all():
        return state
    return GaussianState(
        np.where(stays[..., None], state.mean, np.nan),
        np.where(stays[..., None, None], state.cov, np.nan),
        state.known & stays,
    )


def _of(surprise: fading.Surprise, known: BoolArray) -> fading.Surprise:
    """Return the memory of known objects, none of the others."""
    if known.all():
        return surprise
    parts = (surprise.total, surprise.degrees, surprise.squared)
    return fading.Surprise(*(np.where(known, each, 0.0) for each in parts))
