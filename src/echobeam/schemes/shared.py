"""Shared beams: tracks that the array cannot separate are served by one stream in turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.brief import Brief
from echobeam.physics.link import channel_loss
from echobeam.schemes.base import System
from echobeam.values import Array, BoolArray, IntArray, Tracks


@dataclass(frozen=True, slots=True, repr=False)
class Sharing(Brief):
    """Groups of tracks that share a beam.

    Attributes
    ----------
    leader
        ``(T, C)``: the column whose stream serves a track; its own if it shares none.
    centre
        ``(T, C)`` rad: middle of the angles of a leader's group, of a vertical array below 90
        degrees; NaN for a leader of one.
    reach
        ``(T, C)`` rad: from there to the outermost angle.
    farthest
        ``(T, C)`` m: the largest distance of the group.
    """

    leader: IntArray
    centre: Array
    reach: Array
    farthest: Array

    @property
    def follows(self) -> BoolArray:
        """``(T, C)``: whether a track is served by another's stream."""
        follows: BoolArray = self.leader != np.arange(self.leader.shape[-1])
        return follows

    def applied(self, tracks: Tracks) -> Tracks:
        """Return tracks ``(T, C)`` of which a group's leader stands for all of them."""
        follows, together = self.follows, np.isfinite(self.centre) & tracks.known
        if not follows.any():
            return tracks
        mean = np.where(follows[..., None], np.nan, tracks.mean)
        mean[..., 0] = np.where(together, self.centre, mean[..., 0])
        mean[..., 1] = np.where(together, self.farthest, mean[..., 1])
        return Tracks(
            mean=mean,
            cov=np.where(follows[..., None, None], np.nan, tracks.cov),
            status=np.where(follows, 0, tracks.status).astype(np.int8),
            id=np.where(follows, -1, tracks.id),
        )

    def spread(self, sigma: Array, width: float) -> Array:
        """Return ``(T, C)`` rad: the deviation whose cover reaches all of a leader's group.

        Parameters
        ----------
        sigma
            ``(T, C)`` rad: standard deviation of each track's angle.
        width
            l: half-width of a cover in standard deviations.
        """
        if not self.follows.any():
            return sigma
        columns = np.arange(self.leader.shape[-1])
        own = self.leader[:, None, :] == columns[:, None]
        widest = np.nanmax(np.where(own, sigma[:, None, :], -np.inf), axis=-1)
        together = np.isfinite(self.centre)
        return np.where(together, widest + self.reach / max(width, 1e-9), sigma)


def share(tracks: Tracks, system: System) -> Sharing:
    """Return which tracks are served by one beam.

    Two beams of half the power each, matched or with zeros at the other's angle, reach
    ``2 log2(1 + max(x (1 - r^2), x / (1 + x r^2)))`` with x = N P_T / (2 loss) and r the
    correlation of the steering vectors. One beam over both, used in turns, reaches
    log2(1 + 2 x). Tracks for which that is more share it, and so does who shares with one of
    them.

    Parameters
    ----------
    tracks
        ``(T, C)``: where the beams are aimed; unknown ones share nothing.
    system
        The UAV's equipment.
    """
    angle, distance = tracks.mean[..., 0], tracks.mean[..., 1]
    columns = angle.shape[-1]
    alone = np.broadcast_to(np.arange(columns), angle.shape)
    nothing = np.full(angle.shape, np.nan)
    known = tracks.known
    if (known.sum(axis=-1) < 2).all():
        return Sharing(alone, nothing, nothing, nothing)
    near = _inseparable(np.where(known, angle, 0.0), np.where(known, distance, 1.0), system)
    near &= known[..., :, None] & known[..., None, :] & ~np.eye(columns, dtype=bool)
    if not near.any():
        return Sharing(alone, nothing, nothing, nothing)
    leader = _components(near, alone)
    own = (leader[:, None, :] == alone[..., None]) & known[:, None, :]
    many = own.sum(axis=-1) > 1
    # A vertical array sees theta and pi - theta as one: between mirror images is another direction.
    seen = np.minimum(angle, np.pi - angle) if system.array.axis == "vertical" else angle
    low = np.min(np.where(own, seen[:, None, :], np.inf), axis=-1)
    high = np.max(np.where(own, seen[:, None, :], -np.inf), axis=-1)
    far = np.max(np.where(own, distance[:, None, :], -np.inf), axis=-1)
    low, high, far = (np.where(many, each, np.nan) for each in (low, high, far))
    return Sharing(leader, 0.5 * (low + high), 0.5 * (high - low), far)


def _inseparable(angle: Array, distance: Array, system: System) -> BoolArray:
    """Return ``(T, C, C)``: whether one beam over both gives more than two beams."""
    array, radio = system.transmitter, system.radio
    steering = array.steering(angle)
    correlation = np.abs(steering @ np.conj(np.swapaxes(steering, -1, -2))) / array.n
    square = np.minimum(correlation, 1.0) ** 2
    loss = channel_loss(distance, radio.noise, radio.alpha0)
    farther = np.maximum(loss[..., :, None], loss[..., None, :])
    half = 0.5 * array.n * radio.power / farther
    apart = np.maximum(half * (1.0 - square), half / (1.0 + half * square))
    inseparable: BoolArray = 2.0 * np.log1p(apart) < np.log1p(2.0 * half)
    return inseparable


def _components(near: BoolArray, alone: IntArray) -> IntArray:
    """Return the lowest column ``(T, C)`` that each track is connected with."""
    leader = alone.copy()
    for _ in range(alone.shape[-1]):
        others = np.where(near, leader[:, None, :], alone.shape[-1]).min(axis=-1)
        lower = np.minimum(leader, others)
        if np.array_equal(lower, leader):
            break
        leader = lower
    return leader
