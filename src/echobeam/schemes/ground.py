"""Tracker on the ground: the height that the UAV knows is a sensor of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, get_args

import numpy as np

from echobeam.brief import Brief
from echobeam.faults import InputError
from echobeam.physics.plane import GroundGeometry
from echobeam.physics.polar import POLAR_MEASUREMENT
from echobeam.schemes.base import View
from echobeam.schemes.ground_echoes import Echoes, law_on, strength_of
from echobeam.schemes.ground_grid import grid_posterior, view_of
from echobeam.schemes.ground_motion import Motion, Motions, motions_of
from echobeam.schemes.ground_plane import PlaneBelief, PlaneTracker
from echobeam.schemes.ground_report import reported
from echobeam.schemes.trackers import labelled
from echobeam.tracking import contradiction, posterior_linearisation
from echobeam.tracking.ground import GroundMeasurement
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

WIDE = 5.0
"""Standard deviation of the altitude error over the stated one, once it has been contradicted."""

COMPONENTS = len(POLAR_MEASUREMENT)
"""Components of a measurement."""


@dataclass(frozen=True, slots=True, repr=False)
class GroundBelief(Brief):
    """Gaussian belief about every object's position, velocity and altitude error.

    Attributes
    ----------
    state
        ``(T, K)`` objects: x, v, b in m, m/s, m, with an acceleration after the velocity if the
        motion has one; ``(T, M K)`` of several models, `Motions`.
    surprise
        Memory of the innovation test.
    tracks
        The same in angle, distance, velocity.
    shape
        Shape of the position's density; None if all are Gaussian.
    probability
        ``(T, K, M)`` of the models.
    """

    state: GaussianState
    surprise: contradiction.Surprise
    tracks: Tracks
    shape: Shape | None
    probability: Array


AnyBelief = GroundBelief | PlaneBelief
"""Belief on the road or on the plane, by the scenario's geometry."""


@dataclass(frozen=True, slots=True)
class GroundTracker:
    """Filter of position and velocity on the road, with the altitude error unknown.

    On a plane, `geometry = "ground"`, it is that of `PlaneTracker`; what is said of points and
    iterations is of the road.

    Attributes
    ----------
    points
        Positions at which the law of the variance is taken in a slot.
    first_points
        Those of each grid on which the position of a new object is sought.
    iterations
        Of the posterior linearisation.
    adaptive
        Whether a track that fails the innovation test begins anew, its height less well known.
    motion
        ``"cv"``, ``"ca"`` or ``"imm"``: constant velocity, constant acceleration, or both.
    """

    parameters: ClassVar[tuple[str, ...]] = ("velocity_std", "velocity_prior")
    road_only: ClassVar[tuple[str, ...]] = ("points", "first_points", "iterations", "motion")

    points: int = 32
    first_points: int = 64
    iterations: int = posterior_linearisation.ITERATIONS
    adaptive: bool = True
    motion: Motion = "cv"

    def __post_init__(self) -> None:
        least = {"points": 8, "first_points": 32, "iterations": 1}
        for name, minimum in least.items():
            if getattr(self, name) < minimum:
                raise InputError(
                    f"{name}: {getattr(self, name)} is not accepted; expected {minimum} or more"
                )
        if self.motion not in get_args(Motion):
            raise InputError(
                f"motion: {self.motion!r} is not accepted; expected one of "
                f"{', '.join(get_args(Motion))}"
            )

    @property
    def _on_plane(self) -> PlaneTracker:
        return PlaneTracker(adaptive=self.adaptive)

    def start(self, view: View) -> AnyBelief:
        """Return no knowledge."""
        if isinstance(view.system.geometry, GroundGeometry):
            if self.motion != "cv":
                raise InputError(
                    f'motion: {self.motion!r} is not possible with geometry = "ground"; expected cv'
                )
            return self._on_plane.start(view)
        motions = self._motions(view)
        shape = motions.columns(view.roster).shape
        size = motions.space.size
        nothing = GaussianState(
            mean=np.full((*shape, size), np.nan),
            cov=np.full((*shape, size, size), np.nan),
            known=np.zeros(shape, dtype=bool),
        )
        probability = motions.at_first(view.roster.shape)
        surprise = contradiction.no_surprise(shape, COMPONENTS)
        return _believed(motions, nothing, probability, surprise, None, view)

    def predict(self, belief: AnyBelief, view: View) -> AnyBelief:
        """Return the prediction of this slot; objects that left the roster are forgotten."""
        if isinstance(belief, PlaneBelief):
            return self._on_plane.predict(belief, view)
        motions = self._motions(view)
        stays = motions.columns(belief.tracks.id == view.roster)
        state, surprise, shape = belief.state, belief.surprise, belief.shape
        if not stays.all():
            state = GaussianState(state.mean, state.cov, state.known & stays)
            surprise = _of(surprise, stays)
        prior, probability = motions.predicted(state, belief.probability, view.uav_before)
        if shape is not None:
            shape = carried(shape, state.cov, prior.cov, view.system.slot_duration)
        # a beam has the same gain on either side of a vertical array
        mirrors = view.system.array.axis == "vertical"
        return _believed(motions, prior, probability, surprise, shape, view, one_side=mirrors)

    def update(self, prior: AnyBelief, detections: Detections, view: View) -> AnyBelief:
        """Return the posterior of known objects and the first state of new ones."""
        if isinstance(prior, PlaneBelief):
            return self._on_plane.update(prior, detections, view)
        value, stated = labelled(detections, prior.tracks.id)
        value = np.where(np.isfinite(stated), value, np.nan)
        measured = np.isfinite(value)
        if not measured.any():
            return prior
        motions, model = self._motions(view), GroundMeasurement(view.system.radio.carrier)
        echoes = Echoes(value, stated, strength_of(prior.tracks, value, stated, view))
        state, surprise, probability = prior.state, prior.surprise, prior.probability
        known = prior.tracks.known
        tracked, anew = known & measured.any(axis=-1), np.zeros_like(known)
        shape = gaussian_shape(state.known.shape) if prior.shape is None else prior.shape
        if tracked.any():
            columns = motions.columns(tracked)
            seen = echoes.for_each(motions.columns)
            made, bent = self._tracked(motions, prior, seen, model, view)
            state, shape = made.state, shape.placed(columns, bent[columns])
            probability = motions.reweighted(probability, made.log_likelihood, tracked)
            if self.adaptive:
                surprise = contradiction.remembered(surprise, made.nis, made.degrees, made.scores)
                failing = motions.by_model(contradiction.failing(surprise, columns)).any(axis=-1)
                anew = np.asarray(failing & measured[..., :2].all(axis=-1))
        new = ~known & measured[..., 1]
        for some, widening in ((anew, WIDE), (new, 1.0)):
            if some.any():
                state, bent = self._started(motions, state, some, echoes, model, view, widening)
                columns = motions.columns(some)
                shape = shape.placed(columns, bent[columns])
                probability = np.where(some[..., None], motions.at_first(some.shape), probability)
        bent_ones = shape if shape.bent.any() else None
        surprise = _of(surprise, motions.columns(known & ~anew))
        return _believed(motions, state, probability, surprise, bent_ones, view)

    def _motions(self, view: View) -> Motions:
        system = view.system
        return motions_of(self.motion, system.slot_duration, system.filter.velocity_std)

    def _tracked(
        self,
        motions: Motions,
        belief: GroundBelief,
        echoes: Echoes,
        model: GroundMeasurement,
        view: View,
    ) -> tuple[posterior_linearisation.Updated, Shape]:
        """Return the posterior of known objects, and its shape.

        Where the law of the variance is known it is that of the grid; where the measurement is too
        accurate for the grid, or states its variance, that of the posterior linearisation, with
        the variance of mean information.
        """
        prior, value, uav = belief.state, echoes.value, view.uav
        update = posterior_linearisation.update
        if not view.system.law_known:
            made = update(prior, value, echoes.stated, model, uav, motions.space, self.iterations)
            return made, gaussian_shape(prior.known.shape)
        found = grid_posterior(prior, belief.shape, echoes, model, view, self.points)
        fine = found.fine
        needed = prior.known & np.isfinite(found.variance).any(axis=-1)
        # the slow way only where it is needed; one fit tells the innovation
        fits = 1 if (fine | ~needed).all() else self.iterations
        made = update(prior, value, found.variance, model, uav, motions.space, fits)
        fine &= needed
        state = GaussianState(
            np.where(fine[..., None], found.mean, made.state.mean),
            np.where(fine[..., None, None], found.cov, made.state.cov),
            np.asarray(made.state.known | fine),
        )
        return replace(made, state=state), found.shape.where(fine)

    def _started(
        self,
        motions: Motions,
        state: GaussianState,
        new: BoolArray,
        echoes: Echoes,
        model: GroundMeasurement,
        view: View,
        widening: float,
    ) -> tuple[GaussianState, Shape]:
        """Return the belief with a first state of some objects, and their shape.

        ``widening`` multiplies the standard deviation of the altitude error.
        """
        trials = np.asarray(new.any(axis=-1))
        mean, cov, bent = self._first(
            motions, echoes.of(trials), model, view_of(view, trials), widening
        )
        all_mean, all_cov, known = state.mean.copy(), state.cov.copy(), state.known.copy()
        chosen = motions.columns(new[trials] & np.isfinite(mean).all(axis=-1))
        mean, cov = motions.entered(mean, cov)
        place = np.zeros_like(known)
        place[trials] = chosen
        _recall_velocity(mean, cov, state.mean[trials], state.cov[trials])
        all_mean[place], all_cov[place], known[place] = mean[chosen], cov[chosen], True
        shape = gaussian_shape(known.shape).placed(trials, bent.for_each(motions.columns))
        return GaussianState(all_mean, all_cov, known), shape

    def _first(
        self,
        motions: Motions,
        echoes: Echoes,
        model: GroundMeasurement,
        view: View,
        widening: float,
    ) -> tuple[Array, Array, Shape]:
        """Return the moments of the posterior of first measurements, and its shape."""
        system = view.system
        velocity = system.filter.new_velocity_std
        stds = (velocity, *(0.0,) * motions.extra, widening * system.altitude_std)

        def law(grid: PositionGrid) -> Array:
            known = system.law_known
            return law_on(grid, echoes, view) if known else echoes.stated[..., None, :]

        grid, weight, mean, cov = first_state(
            echoes.value, law, model, view.uav, stds, self.first_points
        )
        return mean, cov, shape_of(grid, weight, mean, cov)


def _believed(
    motions: Motions,
    state: GaussianState,
    probability: Array,
    surprise: contradiction.Surprise,
    shape: Shape | None,
    view: View,
    *,
    one_side: bool = False,
) -> GroundBelief:
    """Return a belief with its report; an object that no angle and distance fit is unknown."""
    whole, bent = motions.mixture(state, probability), shape
    if shape is not None and len(motions.models) > 1:
        bent = shape.for_each(lambda values: motions.likelier(values, probability))
    tracks = reported(whole, view.uav, view.roster, bent, one_side=one_side)
    lives = motions.columns(tracks.known)
    if not np.array_equal(lives, state.known):
        state = GaussianState(
            np.where(lives[..., None], state.mean, np.nan),
            np.where(lives[..., None, None], state.cov, np.nan),
            lives,
        )
    return GroundBelief(state, surprise, tracks, shape, probability)


def _recall_velocity(mean: Array, cov: Array, past_mean: Array, past_cov: Array) -> None:
    """Join first states with the velocity of tracks that begin anew, in place; NaN of new ones.

    A height that was wrong has biased it as well, so its standard deviation is multiplied by
    `WIDE`.
    """
    own, told = cov[..., 1, 1], WIDE**2 * past_cov[..., 1, 1]
    with np.errstate(invalid="ignore"):
        gain = np.where(np.isfinite(told), 1.0 / (own + told), 0.0)
    column = cov[..., :, 1].copy()
    off = np.where(gain > 0.0, past_mean[..., 1] - mean[..., 1], 0.0)
    mean += column * (gain * off)[..., None]
    cov -= column[..., :, None] * column[..., None, :] * gain[..., None, None]


def _of(surprise: contradiction.Surprise, known: BoolArray) -> contradiction.Surprise:
    """Return the memory of known objects, none of the others."""
    if known.all():
        return surprise
    none = contradiction.no_surprise(known.shape, COMPONENTS)
    return contradiction.Surprise(
        np.where(known, surprise.total, none.total),
        np.where(known, surprise.degrees, none.degrees),
        np.where(known, surprise.squared, none.squared),
        np.where(known[..., None], surprise.drift, none.drift),
        np.where(known[..., None], surprise.spread, none.spread),
    )
