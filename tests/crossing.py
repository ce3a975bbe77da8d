"""Two objects that cross at a flat angle among clutter, and linear trackers in the plane.

The filter is a constant-velocity Kalman filter that the tests write out; association is the
package's. All seeds are one batch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.estimation import gaussian
from echobeam.tracking.association import (
    Pairs,
    association_probabilities,
    first_hypotheses,
    grow,
    moment_matched,
    nearest,
    pairs_of,
)
from echobeam.values import Array, BoolArray, IntArray

SCANS, SEEDS, CROSSING = 40, 60, 16
P_D, P_G, DENSITY = 0.9, 0.9999, 3 / 1200
NOISE = np.full(2, 0.25)
START_COV = np.diag([0.25, 0.1, 0.25, 0.1])
F = np.kron(np.eye(2), [[1.0, 1.0], [0.0, 1.0]])
Q = 0.01 * np.kron(np.eye(2), [[1 / 3, 1 / 2], [1 / 2, 1.0]])
H = np.eye(4)[[0, 2]]
POSITION = [0, 2]


class Crossing(NamedTuple):
    """Detections ``(T, B, D, 2)``, whether there is one ``(T, B, D)``, and truth ``(T, 2, 4)``."""

    value: Array
    valid: BoolArray
    truth: Array


def truth() -> Array:
    """Return x, its rate, y and its rate of both objects, one metre and 0.15 m in each scan."""
    k = np.arange(SCANS)
    y = 0.3 * (-10 + k / 2) + 0.6
    one = np.ones(SCANS)
    first = np.stack([-20 + k, one, y, 0.15 * one], axis=-1)
    return np.stack([first, first * [1, 1, -1, -1]], axis=1)


def scans(seed: int) -> list[Array]:
    """Return the detections of each scan ``(D, 2)``.

    The noise of an object that is missed is drawn as well, and so is the scan at the start, which
    no tracker uses.
    """
    rng = np.random.default_rng(seed)
    found = []
    for states in truth():
        points = []
        for state in states:
            seen, noise = rng.random() < P_D, rng.normal(size=2) * 0.5
            if seen:
                points.append(state[POSITION] + noise)
        clutter = rng.random((rng.poisson(3), 2)) * [60, 20] - [30, 10]
        found.append(np.array([*points, *clutter]).reshape(-1, 2))
    return found


def crossing(seeds: range = range(SEEDS)) -> Crossing:
    """Return the scans of all seeds side by side."""
    every = [scans(seed) for seed in seeds]
    most = max(len(scan) for run in every for scan in run)
    value = np.zeros((SCANS, len(every), most, 2))
    valid = np.zeros(value.shape[:-1], dtype=bool)
    for b, run in enumerate(every):
        for t, scan in enumerate(run):
            value[t, b, : len(scan)], valid[t, b, : len(scan)] = scan, True
    return Crossing(value, valid, truth())


class Belief(NamedTuple):
    """Means ``(..., 2, 4)`` and covariances ``(..., 2, 4, 4)`` of the two tracks."""

    mean: Array
    cov: Array

    @classmethod
    def start(cls, *lead: int) -> Belief:
        """Return the truth of the first scan with its stated covariance."""
        mean, cov = truth()[0], np.broadcast_to(START_COV, (2, 4, 4))
        return cls(np.broadcast_to(mean, (*lead, 2, 4)), np.broadcast_to(cov, (*lead, 2, 4, 4)))

    def predicted(self) -> Belief:
        return Belief(self.mean @ F.T, gaussian.propagate(self.cov, F, Q))

    def innovation(self, value: Array) -> tuple[Array, Array]:
        """Return innovations ``(..., 2, D, 2)`` and their covariances ``(..., 2, 1, 2, 2)``."""
        rows = np.broadcast_to(H, (*self.mean.shape[:-1], 2, 4))
        noise = np.broadcast_to(NOISE, (*self.mean.shape[:-1], 2))
        cov = gaussian.innovation_cov(self.cov, rows, noise)
        return value[..., None, :, :] - (self.mean @ H.T)[..., None, :], cov[..., None, :, :]

    def updated(self, innovation: Array) -> Belief:
        """Return the posterior; an innovation of NaN changes nothing."""
        rows = np.broadcast_to(H, (*self.mean.shape[:-1], 2, 4))
        noise = np.broadcast_to(NOISE, innovation.shape)
        return Belief(*gaussian.update(self.mean, self.cov, innovation, rows, noise))

    def given(self, value: Array, detection: IntArray) -> Belief:
        """Return the posterior with one detection for each track, or none (-1)."""
        taken = np.take_along_axis(value, np.maximum(detection, 0)[..., None], axis=-2)
        error = np.where((detection >= 0)[..., None], taken - self.mean @ H.T, np.nan)
        return self.updated(error)

    def pairs(self, value: Array, valid: BoolArray) -> Pairs:
        innovation, cov = self.innovation(value)
        tracks = np.ones(self.mean.shape[:-1], dtype=bool)
        return pairs_of(innovation, cov, P_D, DENSITY, P_G, tracks, valid)

    def shared(self, value: Array, probability: Array) -> Belief:
        """Return the moments of the mixture over all detections of each track."""
        innovation, _ = self.innovation(value)
        lead = innovation.shape[:-1]
        each = Belief(
            np.broadcast_to(self.mean[..., None, :], (*lead, 4)),
            np.broadcast_to(self.cov[..., None, :, :], (*lead, 4, 4)),
        ).updated(innovation)
        return Belief(
            *moment_matched(
                probability,
                np.concatenate([self.mean[..., None, :], each.mean], axis=-2),
                np.concatenate([self.cov[..., None, :, :], each.cov], axis=-3),
            )
        )


def nearest_by_distance(run: Crossing, gate: float = 3.0) -> Array:
    """Return means ``(T, B, 2, 4)``: least sum of Mahalanobis distances; a miss costs the gate."""
    belief = Belief.start(run.value.shape[1])
    means = [belief.mean]
    for value, valid in zip(run.value[1:], run.valid[1:], strict=True):
        belief = belief.predicted()
        distance = np.sqrt(gaussian.square_norm(*belief.innovation(value)))
        inside = valid[..., None, :] & (distance < gate)
        missed = np.full(distance.shape[:-1], -gate)
        detection = nearest(Pairs(np.where(inside, -distance, -np.inf), missed))
        belief = belief.given(value, detection)
        means.append(belief.mean)
    return np.array(means)


def nearest_by_odds(run: Crossing) -> Array:
    """Return means: the most probable joint event of each scan."""
    belief = Belief.start(run.value.shape[1])
    means = [belief.mean]
    for value, valid in zip(run.value[1:], run.valid[1:], strict=True):
        belief = belief.predicted()
        belief = belief.given(value, nearest(belief.pairs(value, valid)))
        means.append(belief.mean)
    return np.array(means)


def joint(run: Crossing) -> tuple[Array, list[Array]]:
    """Return means, and the association probabilities of each scan: JPDA."""
    belief = Belief.start(run.value.shape[1])
    means, probabilities = [belief.mean], []
    for value, valid in zip(run.value[1:], run.valid[1:], strict=True):
        belief = belief.predicted()
        probabilities.append(association_probabilities(belief.pairs(value, valid)))
        belief = belief.shared(value, probabilities[-1])
        means.append(belief.mean)
    return np.array(means), probabilities


def multiple_hypotheses(run: Crossing, keep: int = 20, window: int = 5) -> Array:
    """Return means of the best hypothesis of each scan."""
    trials = run.value.shape[1]
    belief = Belief.start(trials, keep)
    hypotheses = first_hypotheses((trials,), 2, keep, window)
    means = [belief.mean[:, 0]]
    for value, valid in zip(run.value[1:], run.valid[1:], strict=True):
        belief = belief.predicted()
        each = np.broadcast_to(value[:, None], (trials, keep, *value.shape[1:]))
        pairs = belief.pairs(each, np.broadcast_to(valid[:, None], each.shape[:-1]))
        hypotheses, parent, assignment = grow(hypotheses, pairs, keep, window)
        rows = np.arange(trials)[:, None]
        belief = Belief(belief.mean[rows, parent], belief.cov[rows, parent])
        belief = belief.given(each, assignment)
        means.append(belief.mean[:, 0])
    return np.array(means)


def gospa(means: Array, cutoff: float = 10.0) -> Array:
    """Return GOSPA (p = 2, alpha = 2) of two tracks and two objects by scan ``(T, B)``.

    Rahmathullah, Garcia-Fernandez and Svensson, Generalized optimal sub-pattern assignment metric,
    Fusion 2017: a pair beyond the cutoff costs as much as a missed and a false track.
    """
    square = _squares(means)
    straight = np.minimum(square[..., 0, 0], cutoff**2) + np.minimum(square[..., 1, 1], cutoff**2)
    crossed = np.minimum(square[..., 0, 1], cutoff**2) + np.minimum(square[..., 1, 0], cutoff**2)
    return np.sqrt(np.minimum(straight, crossed))


def swapped(means: Array) -> BoolArray:
    """Return whether labels fit the objects better exchanged in the last scan, ``(B,)``."""
    last = _squares(means)[-1]
    return last[..., 0, 1] + last[..., 1, 0] < last[..., 0, 0] + last[..., 1, 1]


def _squares(means: Array) -> Array:
    """Return squared distances of tracks and objects ``(T, B, 2, 2)``."""
    objects = truth()[:, None, None, :, POSITION]
    return ((means[..., :, None, POSITION] - objects) ** 2).sum(axis=-1)
