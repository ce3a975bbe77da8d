"""Shared beams: tracks that the array cannot separate are served by one stream in turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.brief import Brief
from echobeam.physics.coordinates import direction_of, distance_of
from echobeam.physics.link import channel_loss
from echobeam.physics.plane import GroundGeometry
from echobeam.schemes.base import System
from echobeam.values import Array, BoolArray, IntArray, Tracks, UavState, aligned


@dataclass(frozen=True, slots=True, repr=False)
class Sharing(Brief):
    """Groups of tracks that share a beam.

    Attributes
    ----------
    leader
        ``(T, C)``: the column whose stream serves a track; its own if it shares none.
    centre
        ``(T, C)`` rad: middle of the angles of a leader's group, of a vertical array below 90
        degrees; NaN for a leader of one. On the ground ``(T, C, 2)`` direction cosines.
    reach
        Of the same shape: from there to the outermost angle, or cosines.
    farthest
        ``(T, C)`` m: the largest distance of the group.
    ground
        Geometry and UAV by which directions on the ground are places; None on a road.
    """

    leader: IntArray
    centre: Array
    reach: Array
    farthest: Array
    ground: tuple[GroundGeometry, UavState] | None = None

    @property
    def follows(self) -> BoolArray:
        """``(T, C)``: whether a track is served by another's stream."""
        follows: BoolArray = self.leader != np.arange(self.leader.shape[-1])
        return follows

    def applied(self, tracks: Tracks, width: float) -> Tracks:
        """Return tracks ``(T, C)`` of which a group's leader stands for all of them.

        ``width`` is l: the variance of the leader's angle is that of the cover over its group.
        """
        follows = self.follows
        if not follows.any():
            return tracks
        if self.ground is not None:
            return self._on_ground(tracks, width, *self.ground)
        together = np.isfinite(self.centre) & tracks.known
        cov = tracks.cov.copy()
        cov[..., 0, 0] = self.spread(np.sqrt(np.maximum(cov[..., 0, 0], 0.0)), width) ** 2
        mean = np.where(follows[..., None], np.nan, tracks.mean)
        mean[..., 0] = np.where(together, self.centre, mean[..., 0])
        mean[..., 1] = np.where(together, self.farthest, mean[..., 1])
        return Tracks(
            mean=mean,
            cov=np.where(follows[..., None, None], np.nan, cov),
            status=np.where(follows, 0, tracks.status).astype(np.int8),
            id=np.where(follows, -1, tracks.id),
        )

    def _on_ground(
        self, tracks: Tracks, width: float, geometry: GroundGeometry, uav: UavState
    ) -> Tracks:
        """Return the same on the ground: a leader stands where its group's direction meets it."""
        follows = self.follows
        together = np.isfinite(self.centre).all(axis=-1) & tracks.known
        with np.errstate(all="ignore"):  # leaders of one
            sight = geometry.sight(self.centre)
            position = uav.position[:2] - sight[..., :2] * (uav.position[2] / sight[..., 2:])
            mean = np.where(follows[..., None], np.nan, tracks.mean)
            mean[..., :2] = np.where(together[..., None], position, mean[..., :2])
            slope = geometry.cosine_jacobian(mean, uav)
            own = np.einsum("...ij,...jk,...ik->...i", slope, tracks.cov[..., :2, :2], slope)
            square = self.spread(np.sqrt(np.maximum(own, 0.0)), width) ** 2
            back = np.linalg.inv(np.where(together[..., None, None], slope, np.eye(2)))
            wide = (back * square[..., None, :]) @ np.swapaxes(back, -1, -2)
        cov = tracks.cov.copy()
        cov[..., :2, :2] = np.where(together[..., None, None], wide, cov[..., :2, :2])
        return Tracks(
            mean=mean,
            cov=np.where(follows[..., None, None], np.nan, cov),
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
        each = np.nan_to_num(sigma)[:, None]
        widest = np.max(np.where(aligned(own, each), each, 0.0), axis=2)
        together = np.isfinite(self.centre)
        return np.where(together, widest + self.reach / max(width, 1e-9), sigma)


def share(tracks: Tracks, system: System, uav: UavState | None = None) -> Sharing:
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
    uav
        The UAV in the slot; needed on the ground alone.
    """
    geometry, known = system.geometry, tracks.known
    place, ground = tracks.mean, None
    if isinstance(geometry, GroundGeometry):
        assert uav is not None
        with np.errstate(invalid="ignore"):
            place, ground = geometry.place(tracks.mean, uav), (geometry, uav)
    angle = direction_of(place, geometry.axes)
    distance = distance_of(place, geometry.axes)
    columns = known.shape[-1]
    alone = np.broadcast_to(np.arange(columns), known.shape)
    nothing, nowhere = np.full(angle.shape, np.nan), np.full(known.shape, np.nan)
    if (known.sum(axis=-1) < 2).all():
        return Sharing(alone, nothing, nothing, nowhere, ground)
    somewhere = np.where(aligned(known, angle), angle, 0.0)
    near = _inseparable(somewhere, np.where(known, distance, 1.0), system)
    near &= known[..., :, None] & known[..., None, :] & ~np.eye(columns, dtype=bool)
    if not near.any():
        return Sharing(alone, nothing, nothing, nowhere, ground)
    leader = _components(near, alone)
    own = (leader[:, None, :] == alone[..., None]) & known[:, None, :]
    many = own.sum(axis=-1) > 1
    # A vertical array sees theta and pi - theta as one: between mirror images is another direction.
    folds = ground is None and system.array.axis == "vertical"
    seen = (np.minimum(angle, np.pi - angle) if folds else angle)[:, None]
    low = np.min(np.where(aligned(own, seen), seen, np.inf), axis=2)
    high = np.max(np.where(aligned(own, seen), seen, -np.inf), axis=2)
    far = np.max(np.where(own, distance[:, None, :], -np.inf), axis=-1)
    low, high, far = (np.where(aligned(many, each), each, np.nan) for each in (low, high, far))
    return Sharing(leader, 0.5 * (low + high), 0.5 * (high - low), far, ground)


def _inseparable(angle: Array, distance: Array, system: System) -> BoolArray:
    """Return ``(T, C, C)``: whether one beam over both gives more than two beams."""
    array, radio = system.transmitter, system.radio
    steering = array.steering(angle)
    correlation = np.abs(steering @ np.conj(np.swapaxes(steering, -1, -2))) / array.elements
    square = np.minimum(correlation, 1.0) ** 2
    loss = channel_loss(distance, radio.noise, radio.alpha0)
    farther = np.maximum(loss[..., :, None], loss[..., None, :])
    half = 0.5 * array.elements * radio.power / farther
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
