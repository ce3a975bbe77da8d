"""Scoring of unlabelled tracks: which object each of them is about, for the record alone.

No scheme sees a score. A track is about the object that it is nearest to on the ground, within
`CUTOFF`; a pair of the slot before stays one while it is that near (CLEAR MOT; Bernardin and
Stiefelhagen 2008), and confirmed tracks go first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.estimation.matching import UNMATCHED, match
from echobeam.scenario.model import Scenario
from echobeam.values import NOBODY, Array, Axis, IntArray, Status, Tracks, UavState

CUTOFF = 10.0
"""Distance, m, from which a track is about another object: a lane's traffic is not nearer."""

_NEW, _TENTATIVE, _UNMATCHED = 1_500.0, 100.0, 2_000.0
"""Costs of a new pair, of a tentative track, and of two that stay alone, m. Two new pairs cost more
than a pair that stays and two that are alone, so that pairs stay."""


@dataclass(frozen=True, slots=True)
class Score:
    """Objects of the tracks of one slot.

    Attributes
    ----------
    id
        ``(T, C)``: identities of the tracks; `NOBODY` in empty columns.
    identity
        ``(T, C)``: identity of the object that each is about; `NOBODY` for none.
    """

    id: IntArray
    identity: IntArray

    def of(self, id: IntArray) -> IntArray:
        """Return the identities of the objects ``(T, ...)`` of tracks ``(T, ...)``."""
        if self.id.shape[-1] == 0:
            return np.full(id.shape, NOBODY)
        same = (id[..., None] == self.id[:, None, :]) & (id != NOBODY)[..., None]
        place = np.argmax(same, axis=-1)
        return np.where(same.any(axis=-1), np.take_along_axis(self.identity, place, -1), NOBODY)


def unscored(trials: int) -> Score:
    """Return the score before the first slot."""
    nobody = np.full((trials, 0), NOBODY)
    return Score(nobody, nobody)


def axis_of(scenario: Scenario) -> Axis | None:
    """Return the axis of an array above a road, for which places are scored; None on the ground."""
    return scenario.array.axis if scenario.geometry == "road" else None


def place(state: Array, axis: Axis | None) -> Array:
    """Return places ``(..., 2)`` m of states ``(..., S)``: along the road and down from the UAV.

    A vertical array cannot tell theta from pi - theta: both are one place. On the ground, where
    there is no axis, they are x and y.
    """
    if axis is None:
        return state[..., :2]
    along = state[..., 1] * np.cos(state[..., 0])
    along = np.abs(along) if axis == "vertical" else along
    return np.stack([along, state[..., 1] * np.sin(state[..., 0])], axis=-1)


def distances(tracks: Array, truth: Array, axis: Axis | None) -> Array:
    """Return the distances ``(..., C, K)`` m of states ``(..., C, S)`` and ``(..., K, S)``."""
    apart = place(tracks, axis)[..., :, None, :] - place(truth, axis)[..., None, :, :]
    distance: Array = np.hypot(apart[..., 0], apart[..., 1])
    return distance


def scored(
    tracks: Tracks, truth: Array, identity: IntArray, before: Score, axis: Axis | None
) -> Score:
    """Return which object each track is about.

    Parameters
    ----------
    tracks
        ``(T, C)``.
    truth, identity
        ``(T or 1, K, S)`` and ``(K,)``: the objects.
    before
        Score of the slot before.
    axis
        The array's, see `axis_of`.
    """
    there = np.broadcast_to(identity != NOBODY, (len(tracks.id), identity.size))
    known = tracks.known
    if not known.any() or not there.any():
        return Score(tracks.id, np.full(tracks.id.shape, NOBODY))
    apart = distances(tracks.mean, truth, axis)
    stays = before.of(tracks.id)[..., None] == identity
    tentative = (tracks.status == Status.TENTATIVE)[..., None]
    cost = apart + _NEW * ~(stays & (identity != NOBODY)) + _TENTATIVE * tentative
    cost = np.where(apart < CUTOFF, cost, np.inf)
    column = match(cost, known, there, _UNMATCHED)
    return Score(tracks.id, np.where(column == UNMATCHED, NOBODY, identity[column]))


def about_objects(
    tracks: Tracks, score: Score, truth: Array, identity: IntArray, uav: UavState, axis: Axis | None
) -> Tracks:
    """Return tracks with the identities of their objects, on the side where these are.

    For the record: a vertical array's track may be the mirror image of its object, at pi - theta
    and with the opposite velocity relative to the UAV. What is about no object is left out.

    Parameters
    ----------
    tracks, score
        ``(T, C)``.
    truth, identity
        As in `scored`.
    uav
        The UAV in the slot.
    axis
        The array's.
    """
    own = np.where(tracks.known, score.of(tracks.id), NOBODY)
    mean, cov = tracks.mean, tracks.cov
    if axis == "vertical" and (own != NOBODY).any():
        image = np.array([np.pi, 0.0, 2.0 * uav.velocity[0]]) + _MIRROR * mean
        true = _of_objects(truth, own, identity)
        nearer = _misfit(image, cov, true) < _misfit(mean, cov, true)
        behind = (nearer & (own != NOBODY))[..., None]
        mean = np.where(behind, image, mean)
        cov = np.where(behind[..., None], cov * _MIRROR * _MIRROR[:, None], cov)
    status = np.where(own != NOBODY, tracks.status, 0).astype(np.int8)
    return Tracks(mean, cov, status, own)


_MIRROR = np.array([-1.0, 1.0, -1.0])
"""Signs of angle, distance and velocity in a mirror image."""


def _of_objects(truth: Array, own: IntArray, identity: IntArray) -> Array:
    """Return the true state ``(T, C, S)`` of the object that each track is about."""
    column = np.argmax(own[..., None] == identity, axis=-1)
    states = np.broadcast_to(truth, (len(own), *truth.shape[1:]))
    return np.take_along_axis(states, column[..., None], axis=1)


def _misfit(mean: Array, cov: Array, true: Array) -> Array:
    """Return the squared errors over their variances, ``(T, C)``.

    At 90 degrees the angle of a mirror image is right, and its velocity wrong.
    """
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        misfit: Array = np.sum((mean - true) ** 2 / variance, axis=-1)
    return misfit
