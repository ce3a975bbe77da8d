"""Joint events of a scan one by one: what every method of association is compared with."""

from __future__ import annotations

from itertools import product
from math import exp, log

import numpy as np
from hypothesis import strategies as st

from echobeam.tracking.association import Pairs
from echobeam.values import Array


def events(n_tracks: int, n_detections: int) -> list[tuple[int, ...]]:
    """Return every way to give tracks detections or none (-1), no detection twice."""
    found = []
    for event in product(range(-1, n_detections), repeat=n_tracks):
        taken = [detection for detection in event if detection >= 0]
        if len(taken) == len(set(taken)):
            found.append(event)
    return found


def log_weight(event: tuple[int, ...], log_odds: Array, missed: Array) -> float:
    """Return the logarithm of an event's weight."""
    return float(sum(missed[c] if d < 0 else log_odds[c, d] for c, d in enumerate(event)))


def possible_events(log_odds: Array, missed: Array) -> dict[tuple[int, ...], float]:
    """Return the log weights of the events of one scan that are possible."""
    weights = {e: log_weight(e, log_odds, missed) for e in events(*log_odds.shape)}
    return {e: w for e, w in weights.items() if w > -np.inf}


def probabilities(log_odds: Array, missed: Array) -> Array:
    """Return the marginal probabilities of one scan ``(C, D + 1)``, event by event."""
    weights = possible_events(log_odds, missed)
    highest = max(weights.values())
    result = np.zeros((log_odds.shape[0], log_odds.shape[1] + 1))
    for event, weight in weights.items():
        for track, detection in enumerate(event):
            result[track, detection + 1] += exp(weight - highest)
    return result / result.sum(axis=1, keepdims=True)


def random_pairs(
    rng: np.random.Generator,
    lead: tuple[int, ...],
    n_tracks: int,
    n_detections: int,
    share: float = 0.5,
    spread: float = 3.0,
) -> Pairs:
    """Return pairs of which a share is possible, with log odds of a spread around 0."""
    log_odds = spread * rng.normal(size=(*lead, n_tracks, n_detections))
    log_odds[rng.random(log_odds.shape) >= share] = -np.inf
    return Pairs(log_odds, np.log(rng.uniform(0.05, 0.9, (*lead, n_tracks))))


def forest(rng: np.random.Generator, n_tracks: int, n_detections: int) -> Pairs:
    """Return pairs whose graph has no cycle: each new node hangs on at most one of each tree."""
    log_odds = np.full((n_tracks, n_detections), -np.inf)
    tree = list(range(n_tracks + n_detections))  # label of each node's tree
    for pair in rng.permutation(n_tracks * n_detections):
        c, d = divmod(int(pair), n_detections)
        if tree[c] != tree[n_tracks + d] and rng.random() < 0.6:
            log_odds[c, d] = 3.0 * rng.normal()
            old, new = tree[c], tree[n_tracks + d]
            tree = [new if label == old else label for label in tree]
    return Pairs(log_odds, np.log(rng.uniform(0.05, 0.9, n_tracks)))


@st.composite
def small_pairs(draw: st.DrawFn) -> Pairs:
    """Draw a scan of up to four tracks and five detections, with odds of any size and none."""
    n_tracks, n_detections = draw(st.integers(1, 4)), draw(st.integers(0, 5))
    odds = st.one_of(st.just(-np.inf), st.floats(-5.0, 10.0), st.floats(-690.0, 690.0))
    miss = st.one_of(st.just(0.0), st.floats(-36.0, 0.0), st.just(log(2.2e-16)))
    size = n_tracks * n_detections
    log_odds = draw(st.lists(odds, min_size=size, max_size=size))
    missed = draw(st.lists(miss, min_size=n_tracks, max_size=n_tracks))
    return Pairs(np.array(log_odds).reshape(n_tracks, n_detections), np.array(missed))
