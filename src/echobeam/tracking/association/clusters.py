"""Clusters of a scan: tracks that compete for detections, and those detections.

They are the connected components of the graph whose edges are the possible pairs. Joint events
factor over them (Reid, An algorithm for tracking multiple targets, IEEE Trans. Automatic Control
24(6), 1979, section IV), so that a scan of many tracks falls apart into small problems.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from echobeam.values import Array, BoolArray, IntArray


class Clusters(NamedTuple):
    """All clusters of one size in a batch of scans.

    Attributes
    ----------
    scan
        ``(P,)``: index in the batch of the scan that the cluster belongs to.
    tracks, detections
        ``(P, T)`` and ``(P, E)``: its members, in ascending order.
    """

    scan: IntArray
    tracks: IntArray
    detections: IntArray

    def pick(self, values: Array) -> Array:
        """Return the clusters' part ``(P, T, E)`` of values of pairs ``(B, C, D)``."""
        part: Array = values[
            self.scan[:, None, None], self.tracks[:, :, None], self.detections[:, None, :]
        ]
        return part


def clusters_of(possible: BoolArray) -> Iterator[Clusters]:
    """Yield the clusters of a batch of scans ``(B, C, D)`` by size; a lone track is in none."""
    n_scans, n_tracks, _ = possible.shape
    track_label, detection_label = _labels(possible)
    base = np.arange(n_scans)[:, None] * n_tracks
    track = _grouped(base + track_label, np.any(possible, axis=2))
    detection = _grouped(base + detection_label, np.any(possible, axis=1))
    if not track.size.size:
        return
    shape = track.size * (possible.shape[2] + 1) + detection.size
    for one in np.unique(shape):
        chosen = np.flatnonzero(shape == one)
        first = chosen[0]
        tracks = track.members(chosen, int(track.size[first]))
        detections = detection.members(chosen, int(detection.size[first]))
        yield Clusters(track.label[chosen] // n_tracks, tracks, detections)


class _Grouped(NamedTuple):
    """Members of all groups one after the other, with the label, begin and size of each group."""

    member: IntArray
    label: IntArray
    begin: IntArray
    size: IntArray

    def members(self, groups: IntArray, size: int) -> IntArray:
        found: IntArray = self.member[self.begin[groups][:, None] + np.arange(size)]
        return found


def _grouped(label: IntArray, linked: BoolArray | np.bool_) -> _Grouped:
    """Sort the linked columns of all scans by their label; within one they stay in order."""
    column = np.nonzero(linked)[1]
    label = label[linked]
    order = np.argsort(label, kind="stable")
    values, begin, size = np.unique(label[order], return_index=True, return_counts=True)
    return _Grouped(column[order], values, begin, size)


def _labels(possible: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the least track of the cluster of each track ``(B, C)`` and detection ``(B, D)``."""
    n_scans, n_tracks, _ = possible.shape
    track: IntArray = np.broadcast_to(np.arange(n_tracks), (n_scans, n_tracks))
    while True:
        detection = np.where(possible, track[:, :, None], n_tracks).min(axis=1, initial=n_tracks)
        around = np.where(possible, detection[:, None, :], n_tracks).min(axis=2, initial=n_tracks)
        least = np.minimum(track, around)
        if np.array_equal(least, track):
            return track, detection
        track = least
