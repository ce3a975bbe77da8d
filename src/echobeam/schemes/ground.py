"""Tracker on the ground: the height that the UAV knows is a sensor of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from echobeam.brief import Brief
from echobeam.faults import InputError
from echobeam.schemes.base import View
from echobeam.schemes.ground_echoes import Echoes, law_on, strength_of
from echobeam.schemes.ground_grid import grid_posterior, view_of
from echobeam.schemes.ground_report import reported
from echobeam.schemes.trackers import labelled
from echobeam.tracking import fading, filter, posterior_linearisation
from echobeam.tracking.ground import ROAD, GroundMeasurement, GroundMotion
from echobeam.tracking.road_grid import PositionGrid
from echobeam.tracking.road_shape import Shape, carried, gaussian_shape, shape_of
from echobeam.tracking.road_start import first_state
from echobeam.values import (
    Array,
    BoolArray,
    Detections,
    GaussianState,
    Tracks,
)

VELOCITY_PRIOR = 30.0
"""Standard deviation of a new object's velocity, m/s, where ``filter.velocity_prior`` is 0."""


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
    shape
        Shape of the position's density; None if all are Gaussian.
    """

    state: GaussianState
    surprise: fading.Surprise
    tracks: Tracks
    shape: Shape | None = None


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

    def start(self, view: View) -> GroundBelief:
        """Return no knowledge."""
        shape = view.roster.shape
        nothing = GaussianState(
            mean=np.full((*shape, ROAD.size), np.nan),
            cov=np.full((*shape, ROAD.size, ROAD.size), np.nan),
            known=np.zeros(shape, dtype=bool),
        )
        return _believed(nothing, fading.no_surprise(shape), view)

    def predict(self, belief: GroundBelief, view: View) -> GroundBelief:
        """Return the prediction of this slot; objects that left the roster are forgotten."""
        stays = belief.tracks.id == view.roster
        state, surprise = belief.state, belief.surprise
        if not stays.all():
            state = GaussianState(state.mean, state.cov, state.known & stays)
            surprise = _of(surprise, stays)
        motion = GroundMotion(view.system.slot_duration, view.system.filter.velocity_std)
        prior = filter.predict(state, motion, view.uav_before)
        shape = belief.shape
        if shape is not None:
            shape = carried(shape, state.cov, prior.cov, motion.slot_duration)
        # a beam has the same gain on either side of a vertical array
        mirrors = view.system.array.axis == "vertical"
        return _believed(prior, surprise, view, shape, one_side=mirrors)

    def update(self, prior: GroundBelief, detections: Detections, view: View) -> GroundBelief:
        """Return the posterior of known objects and the first state of new ones."""
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
        shape = gaussian_shape(known.shape) if prior.shape is None else prior.shape
        if tracked.any():
            made, bent = self._tracked(prior, echoes, model, view)
            state, shape = made.state, shape.placed(tracked, bent[tracked])
            if self.adaptive:
                surprise = fading.remembered(surprise, made.nis, made.degrees)
                factor, surprise = fading.widening(surprise, tracked)
                state = GaussianState(state.mean, state.cov * factor[..., None, None], state.known)
        new = ~known & measured[..., 1]
        if new.any():
            state, bent = self._started(state, new, echoes, model, view)
            shape = shape.placed(new, bent[new])
        bent_ones = shape if shape.bent.any() else None
        return _believed(state, _of(surprise, known), view, bent_ones)

    def _tracked(
        self, belief: GroundBelief, echoes: Echoes, model: GroundMeasurement, view: View
    ) -> tuple[posterior_linearisation.Updated, Shape]:
        """Return the posterior of known objects, and its shape.

        Where the law of the variance is known it is that of the grid; where the measurement is too
        accurate for the grid, or states its variance, that of the posterior linearisation, with
        the variance of mean information.
        """
        prior, value, uav = belief.state, echoes.value, view.uav
        update = posterior_linearisation.update
        if not view.system.law_known:
            made = update(prior, value, echoes.stated, model, uav, ROAD, self.iterations)
            return made, gaussian_shape(prior.known.shape)
        found = grid_posterior(prior, belief.shape, echoes, model, view, self.points)
        fine = found.fine
        needed = prior.known & np.isfinite(found.variance).any(axis=-1)
        # the slow way only where it is needed; one fit tells the innovation
        fits = 1 if (fine | ~needed).all() else self.iterations
        made = update(prior, value, found.variance, model, uav, ROAD, fits)
        fine &= needed
        state = GaussianState(
            np.where(fine[..., None], found.mean, made.state.mean),
            np.where(fine[..., None, None], found.cov, made.state.cov),
            np.asarray(made.state.known | fine),
        )
        return replace(made, state=state), found.shape.where(fine)

    def _started(
        self,
        state: GaussianState,
        new: BoolArray,
        echoes: Echoes,
        model: GroundMeasurement,
        view: View,
    ) -> tuple[GaussianState, Shape]:
        """Return the belief with a first state of the new objects, and their shape."""
        trials = np.asarray(new.any(axis=-1))
        mean, cov, bent = self._first(echoes.of(trials), model, view_of(view, trials))
        all_mean, all_cov, known = state.mean.copy(), state.cov.copy(), state.known.copy()
        chosen = new[trials] & np.isfinite(mean).all(axis=-1)
        place = np.zeros_like(new)
        place[trials] = chosen
        all_mean[place], all_cov[place], known[place] = mean[chosen], cov[chosen], True
        shape = gaussian_shape(new.shape).placed(trials, bent)
        return GaussianState(all_mean, all_cov, known), shape

    def _first(
        self, echoes: Echoes, model: GroundMeasurement, view: View
    ) -> tuple[Array, Array, Shape]:
        """Return the moments of the posterior of first measurements, and its shape."""
        system = view.system
        stds = system.filter.velocity_prior or VELOCITY_PRIOR, system.altitude_std

        def law(grid: PositionGrid) -> Array:
            known = system.law_known
            return law_on(grid, echoes, view) if known else echoes.stated[..., None, :]

        grid, weight, mean, cov = first_state(
            echoes.value, law, model, view.uav, stds, self.first_points
        )
        return mean, cov, shape_of(grid, weight, mean, cov)


def _believed(
    state: GaussianState,
    surprise: fading.Surprise,
    view: View,
    shape: Shape | None = None,
    *,
    one_side: bool = False,
) -> GroundBelief:
    """Return a belief with its report; an object that no angle and distance fit is unknown."""
    tracks = reported(state, view.uav, view.roster, shape, one_side=one_side)
    if not np.array_equal(tracks.known, state.known):
        lives = tracks.known
        state = GaussianState(
            np.where(lives[..., None], state.mean, np.nan),
            np.where(lives[..., None, None], state.cov, np.nan),
            lives,
        )
    return GroundBelief(state, surprise, tracks, shape)


def _of(surprise: fading.Surprise, known: BoolArray) -> fading.Surprise:
    """Return the memory of known objects, none of the others."""
    if known.all():
        return surprise
    parts = (surprise.total, surprise.degrees, surprise.squared)
    return fading.Surprise(*(np.where(known, each, 0.0) for each in parts))
