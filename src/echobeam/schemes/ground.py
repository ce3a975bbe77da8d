"""Tracker on the ground: the height that the UAV knows is a sensor of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from echobeam.brief import Brief
from echobeam.estimation.sigma_points import cubature_points, moments, root
from echobeam.faults import InputError
from echobeam.physics.plane import GroundGeometry
from echobeam.physics.polar import physical
from echobeam.schemes.base import View
from echobeam.schemes.ground_echoes import Echoes, law_on, strength_of
from echobeam.schemes.ground_plane import PlaneBelief, PlaneTracker
from echobeam.schemes.trackers import labelled
from echobeam.tracking import fading, filter, posterior_linearisation, road_grid
from echobeam.tracking.ground import ROAD, GroundMeasurement, GroundMotion, polar_of
from echobeam.tracking.road_grid import PositionGrid
from echobeam.tracking.road_start import first_state
from echobeam.values import (
    Array,
    BoolArray,
    Detections,
    GaussianState,
    IntArray,
    Status,
    Tracks,
    Transmission,
    UavState,
)

VELOCITY_PRIOR = 30.0
"""Standard deviation of a new object's velocity, m/s, where ``filter.velocity_prior`` is 0."""

REACH = 5.0
"""Standard deviations of the prior to either side of the grid."""


@dataclass(frozen=True, slots=True, repr=False)
class GroundBelief(Brief):
    """Gaussian belief about every object's position, velocity and altitude error.

    Attributes
    ----------
    state
        ``(T, K)`` objects: x, v, b in m, m/s, m.
    surprise
        Memory of the innovation test.
    tracks
        The same in angle, distance, velocity.
    """

    state: GaussianState
    surprise: fading.Surprise
    tracks: Tracks


AnyBelief = GroundBelief | PlaneBelief
"""Belief on the road or on the plane, by the scenario's geometry."""


def reported(state: GaussianState, uav: UavState, id: IntArray) -> Tracks:
    """Return a belief on the road as tracks in angle, distance and velocity.

    Mean and covariance are those of sigma points, so that they hold the altitude error and the
    bend of the coordinates.

    Parameters
    ----------
    state
        ``(T, K)`` objects: x, v, b; NaN where one is unknown.
    uav
        The UAV in the slot.
    id
        ``(T, K)``: identities.
    """
    with np.errstate(invalid="ignore"):
        centre = polar_of(state.mean, uav)
        points = polar_of(cubature_points(state.mean, root(state.cov)), uav)
        shift, cov = moments(points - centre[..., None, :])
    mean = centre + shift
    known = np.asarray(state.known & physical(mean))
    return Tracks(
        np.where(known[..., None], mean, np.nan),
        np.where(known[..., None, None], cov, np.nan),
        np.where(known, Status.CONFIRMED, 0).astype(np.int8),
        id,
    )


@dataclass(frozen=True, slots=True)
class GroundTracker:
    """Sigma-point filter of position and velocity on the road, with the altitude error unknown.

    Attributes
    ----------
    points
        Positions at which the law of the variance is taken in a slot.
    first_points
        Those of each grid on which the position of a new object is sought.
    iterations
        Of the posterior linearisation.
    adaptive
        Whether the innovation test widens covariances.
    """

    parameters: ClassVar[tuple[str, ...]] = ("velocity_std", "velocity_prior")

    points: int = 32
    first_points: int = 64
    iterations: int = posterior_linearisation.ITERATIONS
    adaptive: bool = True

    def __post_init__(self) -> None:
        least = {"points": 8, "first_points": 32, "iterations": 1}
        for name, minimum in least.items():
            if getattr(self, name) < minimum:
                raise InputError(
                    f"{name}: {getattr(self, name)} is not accepted; expected {minimum} or more"
                )

    @property
    def _on_plane(self) -> PlaneTracker:
        return PlaneTracker(adaptive=self.adaptive)

    def start(self, view: View) -> AnyBelief:
        """Return no knowledge."""
        if isinstance(view.system.geometry, GroundGeometry):
            return self._on_plane.start(view)
        shape = view.roster.shape
        nothing = GaussianState(
            mean=np.full((*shape, ROAD.size), np.nan),
            cov=np.full((*shape, ROAD.size, ROAD.size), np.nan),
            known=np.zeros(shape, dtype=bool),
        )
        return _believed(nothing, fading.no_surprise(shape), view)

    def predict(self, belief: AnyBelief, view: View) -> AnyBelief:
        """Return the prediction of this slot; objects that left the roster are forgotten."""
        if isinstance(belief, PlaneBelief):
            return self._on_plane.predict(belief, view)
        stays = belief.tracks.id == view.roster
        state, surprise = belief.state, belief.surprise
        if not stays.all():
            state = GaussianState(state.mean, state.cov, state.known & stays)
            surprise = _of(surprise, stays)
        motion = GroundMotion(view.system.slot_duration, view.system.filter.velocity_std)
        return _believed(filter.predict(state, motion, view.uav_before), surprise, view)

    def update(self, prior: AnyBelief, detections: Detections, view: View) -> AnyBelief:
        """Return the posterior of known objects and the first state of new ones."""
        if isinstance(prior, PlaneBelief):
            return self._on_plane.update(prior, detections, view)
        value, stated = labelled(detections, prior.tracks.id)
        value = np.where(np.isfinite(stated), value, np.nan)
        measured = np.isfinite(value)
        if not measured.any():
            return prior
        model = GroundMeasurement(view.system.radio.carrier)
        known = prior.state.known
        state, surprise = prior.state, prior.surprise
        echoes = Echoes(value, stated, strength_of(prior.tracks, value, stated, view))
        tracked = known & measured.any(axis=-1)
        if tracked.any():
            made = self._tracked(prior.state, echoes, model, view)
            state = made.state
            if self.adaptive:
                surprise = fading.remembered(surprise, made.nis, made.degrees)
                factor, surprise = fading.widening(surprise, tracked)
                state = GaussianState(state.mean, state.cov * factor[..., None, None], state.known)
        new = ~known & measured[..., 1]
        if new.any():
            state = self._started(state, new, echoes, model, view)
        return _believed(state, _of(surprise, known), view)

    def _tracked(
        self, prior: GaussianState, echoes: Echoes, model: GroundMeasurement, view: View
    ) -> posterior_linearisation.Updated:
        """Return the posterior of known objects.

        Where the law of the variance is known it is that of the grid; where the measurement is too
        accurate for the grid, or states its variance, that of the posterior linearisation, with
        the variance of mean information.
        """
        value, uav = echoes.value, view.uav
        update = posterior_linearisation.update
        if not view.system.law_known:
            return update(prior, value, echoes.stated, model, uav, ROAD, self.iterations)
        grid = road_grid.grid_of(prior, self.points, REACH)
        law = law_on(grid, echoes, view)
        weight, mean, cov = road_grid.posterior(grid, value, law, model, uav)
        variance = road_grid.effective_variance(weight, law)
        variance = np.where(np.isfinite(value), variance, np.inf)
        fine = road_grid.resolved(grid, cov)
        needed = prior.known & np.isfinite(variance).any(axis=-1)
        # the slow way only where it is needed; one fit tells the innovation
        fits = 1 if (fine | ~needed).all() else self.iterations
        made = update(prior, value, variance, model, uav, ROAD, fits)
        fine &= needed
        state = GaussianState(
            np.where(fine[..., None], mean, made.state.mean),
            np.where(fine[..., None, None], cov, made.state.cov),
            np.asarray(made.state.known | fine),
        )
        return replace(made, state=state)

    def _started(
        self,
        state: GaussianState,
        new: BoolArray,
        echoes: Echoes,
        model: GroundMeasurement,
        view: View,
    ) -> GaussianState:
        """Return the belief with a first state of the new objects."""
        trials = np.asarray(new.any(axis=-1))
        some = echoes.of(trials)
        sent = view.sent
        if sent is not None:
            sent = Transmission(
                sent.beams[trials], sent.antenna_power[trials], sent.probing[trials]
            )
        there = replace(view, sent=sent)
        mean, cov = self._first(some, model, there)
        all_mean, all_cov, known = state.mean.copy(), state.cov.copy(), state.known.copy()
        chosen = new[trials] & np.isfinite(mean).all(axis=-1)
        place = np.zeros_like(new)
        place[trials] = chosen
        all_mean[place], all_cov[place], known[place] = mean[chosen], cov[chosen], True
        return GaussianState(all_mean, all_cov, known)

    def _first(self, echoes: Echoes, model: GroundMeasurement, view: View) -> tuple[Array, Array]:
        """Return the moments of the posterior of first measurements."""
        system = view.system
        stds = system.filter.velocity_prior or VELOCITY_PRIOR, system.altitude_std

        def law(grid: PositionGrid) -> Array:
            known = system.law_known
            return law_on(grid, echoes, view) if known else echoes.stated[..., None, :]

        return first_state(echoes.value, law, model, view.uav, stds, self.first_points)


def _believed(state: GaussianState, surprise: fading.Surprise, view: View) -> GroundBelief:
    """Return a belief with its report; an object that no angle and distance fit is unknown."""
    tracks = reported(state, view.uav, view.roster)
    if not np.array_equal(tracks.known, state.known):
        lives = tracks.known
        state = GaussianState(
            np.where(lives[..., None], state.mean, np.nan),
            np.where(lives[..., None, None], state.cov, np.nan),
            lives,
        )
    return GroundBelief(state, surprise, tracks)


def _of(surprise: fading.Surprise, known: BoolArray) -> fading.Surprise:
    """Return the memory of known objects, none of the others."""
    if known.all():
        return surprise
    parts = (surprise.total, surprise.degrees, surprise.squared)
    return fading.Surprise(*(np.where(known, each, 0.0) for each in parts))
