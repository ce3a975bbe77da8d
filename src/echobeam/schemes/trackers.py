"""Trackers: from detections to a belief about every object, and its prediction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from echobeam.scenario.tables import FilterTable
from echobeam.schemes.base import View
from echobeam.schemes.models import first_state, measurement_of, motion_of
from echobeam.tracking import filter as ekf
from echobeam.values import (
    Array,
    BoolArray,
    Detections,
    GaussianState,
    IntArray,
    Status,
    Tracks,
)

FILTER_KEYS = tuple(FilterTable.model_fields)


@dataclass(frozen=True, slots=True)
class GaussianBelief:
    """Gaussian belief about every object of the roster.

    Attributes
    ----------
    state
        ``(T, K)`` objects.
    id
        ``(T, K)``: identity of the object that each column is about.
    stated
        Whether the belief is a statement about the slot at hand; a held estimate is none about
        the slots after it.
    """

    state: GaussianState
    id: IntArray
    stated: bool = True

    @property
    def tracks(self) -> Tracks:
        """Tracks, one for each object of the roster."""
        known = self.state.known if self.stated else np.zeros_like(self.state.known)
        mean, cov = self.state.mean, self.state.cov
        if not self.stated:
            mean, cov = np.full_like(mean, np.nan), np.full_like(cov, np.nan)
        return Tracks(mean, cov, np.where(known, Status.CONFIRMED, 0).astype(np.int8), self.id)


def unknown(view: View) -> GaussianBelief:
    """Return the belief of a UAV that has measured nothing."""
    shape, size = view.roster.shape, view.system.geometry.space.size
    nothing = GaussianState(
        mean=np.full((*shape, size), np.nan),
        cov=np.full((*shape, size, size), np.nan),
        known=np.zeros(shape, dtype=bool),
    )
    return GaussianBelief(nothing, view.roster)


def forget(belief: GaussianBelief, view: View) -> GaussianState:
    """Return the belief about the objects that are still on the roster, column by column."""
    state = belief.state
    stays = belief.id == view.roster
    if stays.all():
        return state
    return GaussianState(
        mean=np.where(stays[..., None], state.mean, np.nan),
        cov=np.where(stays[..., None, None], state.cov, np.nan),
        known=state.known & stays,
    )


def labelled(detections: Detections, id: IntArray) -> tuple[Array, Array]:
    """Return the labelled detections in the order of some tracks.

    Parameters
    ----------
    detections
        ``(T, D)`` of them.
    id
        ``(T, C)``: identities of the tracks.

    Returns
    -------
    value, variance
        ``(T, C, M)``; NaN and infinity where a track has no detection.
    """
    if detections.label.shape == id.shape and np.array_equal(detections.label, id):
        return detections.value, detections.variance
    match = (detections.label[..., None, :] == id[..., None]) & detections.valid[..., None, :]
    found = match.any(axis=-1)[..., None]
    if match.shape[-1] == 0:
        shape = (*id.shape, detections.value.shape[-1])
        return np.full(shape, np.nan), np.full(shape, np.inf)
    place = np.argmax(match, axis=-1)[..., None]
    value = np.take_along_axis(detections.value, place, axis=-2)
    variance = np.take_along_axis(detections.variance, place, axis=-2)
    return np.where(found, value, np.nan), np.where(found, variance, np.inf)


def _predicted(belief: GaussianBelief, view: View) -> GaussianState:
    return ekf.predict(forget(belief, view), motion_of(view.system), view.uav_before)


def _started(state: GaussianState, value: Array, variance: Array, view: View) -> GaussianState:
    """Return the belief with a first state for every unknown object that was measured."""
    new = ~state.known & np.isfinite(value).any(axis=-1)
    if not new.any():
        return state
    return _choose(new, first_state(value, variance, view), state)


def _choose(mask: BoolArray, one: GaussianState, other: GaussianState) -> GaussianState:
    """Return ``one`` where the mask ``(..., K)`` holds and ``other`` elsewhere."""
    return GaussianState(
        mean=np.where(mask[..., None], one.mean, other.mean),
        cov=np.where(mask[..., None, None], one.cov, other.cov),
        known=np.where(mask, one.known, other.known),
    )


@dataclass(frozen=True, slots=True)
class ExtendedKalman:
    """The paper's extended Kalman filter, Eqs. (39)-(49); a new object starts as in Note 2."""

    parameters: ClassVar[tuple[str, ...]] = FILTER_KEYS

    def start(self, view: View) -> GaussianBelief:
        """Return no knowledge."""
        return unknown(view)

    def predict(self, belief: GaussianBelief, view: View) -> GaussianBelief:
        """Return the prediction of this slot, Eqs. (44)-(46)."""
        return GaussianBelief(_predicted(belief, view), view.roster)

    def update(self, prior: GaussianBelief, detections: Detections, view: View) -> GaussianBelief:
        """Return the filtered state of known objects and the first state of new ones."""
        value, variance = labelled(detections, prior.id)
        model, space = measurement_of(view.system), view.system.geometry.space
        tracked = ekf.update(prior.state, value, variance, model, view.uav, space).state
        return GaussianBelief(_started(tracked, value, variance, view), prior.id)


@dataclass(frozen=True, slots=True)
class HeldEstimate:
    """The last measurement alone, held until the next; it predicts nothing."""

    parameters: ClassVar[tuple[str, ...]] = ("velocity_prior",)
    predicts: ClassVar[bool] = False

    def start(self, view: View) -> GaussianBelief:
        """Return no knowledge."""
        return unknown(view)

    def predict(self, belief: GaussianBelief, view: View) -> GaussianBelief:
        """Return the held estimate, which states nothing about this slot."""
        return GaussianBelief(forget(belief, view), view.roster, stated=False)

    def update(self, prior: GaussianBelief, detections: Detections, view: View) -> GaussianBelief:
        """Return the state that the measurement alone gives, where there is one."""
        return GaussianBelief(_renewed(prior, detections, view), prior.id)


@dataclass(frozen=True, slots=True)
class DeadReckoning:
    """The last measurement alone, predicted on without any new one."""

    parameters: ClassVar[tuple[str, ...]] = FILTER_KEYS

    def start(self, view: View) -> GaussianBelief:
        """Return no knowledge."""
        return unknown(view)

    def predict(self, belief: GaussianBelief, view: View) -> GaussianBelief:
        """Return the prediction of this slot, Eqs. (44)-(46)."""
        return GaussianBelief(_predicted(belief, view), view.roster)

    def update(self, prior: GaussianBelief, detections: Detections, view: View) -> GaussianBelief:
        """Return the state that the measurement alone gives, where there is one."""
        return GaussianBelief(_renewed(prior, detections, view), prior.id)


def _renewed(prior: GaussianBelief, detections: Detections, view: View) -> GaussianState:
    value, variance = labelled(detections, prior.id)
    if not np.isfinite(value).any():
        return prior.state
    fresh = first_state(value, variance, view)
    return _choose(fresh.known, fresh, prior.state)
