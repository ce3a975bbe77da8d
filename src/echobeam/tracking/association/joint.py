"""Joint probabilistic data association: the probability of each pair over all joint events.

Fortmann, Bar-Shalom and Scheffe, Sonar tracking of multiple targets using joint probabilistic data
association, IEEE J. Oceanic Engineering 8(3), 1983. Small scans and small clusters are summed
exactly, the rest by belief propagation.
"""

from __future__ import annotations

import numpy as np

from echobeam.faults import InputError
from echobeam.tracking.association.belief import believed_probabilities
from echobeam.tracking.association.clusters import clusters_of
from echobeam.tracking.association.exact import exact_probabilities
from echobeam.tracking.association.pairs import Pairs, flattened
from echobeam.values import Array

EXACT_UP_TO = 10
"""Tracks or detections of a cluster, the fewer of the two, up to which it is summed exactly."""

_WHOLE_UP_TO = 5
"""The same for whole scans: below it, taking them apart costs more than the sum."""


def association_probabilities(pairs: Pairs, exact_up_to: int = EXACT_UP_TO) -> Array:
    """Return each track's association probabilities, ``(..., C, D + 1)``, of sum one.

    Parameters
    ----------
    pairs
        Of a scan.
    exact_up_to
        Clusters with more tracks and more detections than this are left to belief propagation, all
        with 0. An exact sum over J of the fewer kind and I of the other costs 2^J I J.

    Returns
    -------
    Array
        [..., 0] is the probability that the track has no detection, 1 where there is no track;
        [..., d + 1] that detection d is its own.
    """
    if exact_up_to < 0:
        raise InputError(f"exact_up_to must not be negative, not {exact_up_to}")
    log_odds, missed, lead = flattened(pairs)
    n_tracks, n_detections = log_odds.shape[1:]
    if min(n_tracks, n_detections) <= min(_WHOLE_UP_TO, exact_up_to):
        result = exact_probabilities(log_odds, missed)
    else:
        result = _by_cluster(log_odds, missed, exact_up_to)
    return result.reshape(*lead, n_tracks, n_detections + 1)


def _by_cluster(log_odds: Array, missed: Array, exact_up_to: int) -> Array:
    """Return the probabilities of scans that are taken apart."""
    size, n_tracks, n_detections = log_odds.shape
    result = np.zeros((size, n_tracks, n_detections + 1))
    result[..., 0] = 1.0
    for clusters in clusters_of(log_odds > -np.inf):
        scan, tracks, detections = clusters
        small = min(tracks.shape[1], detections.shape[1]) <= exact_up_to
        method = exact_probabilities if small else believed_probabilities
        part = method(clusters.pick(log_odds), missed[scan[:, None], tracks])
        result[scan[:, None], tracks, 0] = part[..., 0]
        result[scan[:, None, None], tracks[:, :, None], detections[:, None, :] + 1] = part[..., 1:]
    return result
