"""Update of tracks by detections of which nobody says whose they are.

Gate and probabilities come from the filter's own innovation covariance. With one hypothesis the
tracks are updated by the nearest detections, or by all of them in proportion to the probabilities
that they are the track's; with several each has a filter and an assignment of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from echobeam.brief import Brief
from echobeam.estimation import gaussian
from echobeam.tracking import filter as ekf
from echobeam.tracking.association.hypotheses import Hypotheses, first_hypotheses, grow, marginal
from echobeam.tracking.association.joint import association_probabilities
from echobeam.tracking.association.moments import moment_matched
from echobeam.tracking.association.nearest import nearest
from echobeam.tracking.association.pairs import Pairs, pairs_of
from echobeam.tracking.models import MeasurementModel
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    GaussianState,
    IntArray,
    StateSpace,
    UavState,
)

Method = Literal["nearest", "jpda", "mht"]

LEAST_WEIGHT = 1e-6
"""Probability of association below which a detection does not move a track."""

MIRROR_STDS = 3.0
"""Standard deviations of the innovation within which both sides of a vertical array are near a
prediction."""

MOSTLY = 0.5
"""Probability of being some track's detection below which one may be a new object's."""


@dataclass(frozen=True, slots=True, repr=False)
class Scan(Brief):
    """Detections of one slot, and how they are associated.

    Attributes
    ----------
    value, variance
        ``(T, D, M)``.
    valid
        ``(T, D)``.
    mirror
        ``(T, D, M)``: the values if the object is on the other side, where the array cannot tell;
        NaN where it can. A track takes the one whose angle is nearer to its prediction, and no
        angle if both are near it: the nearer one would agree with it too well.
    probability
        ``(T, H, C)``: of detection, at each track's prediction.
    density, density_without_angle
        ``(T, D)``: of false detections, at each one; and a number, over the components but for the
        angle.
    gate
        Probability with which a track's own detection is inside its gate.
    method
        Association.
    scans
        Slots after which hypotheses are decided ("mht"); the prior has as many as are held.
    predicted_variance
        ``(T, H, C, D or 1, M)``: of each detection if it is at a track's prediction, where that is
        what the UAV knows; None where each detection states its own.
    """

    value: Array
    variance: Array
    valid: BoolArray
    mirror: Array
    probability: Array
    density: Array
    density_without_angle: float
    gate: float
    method: Method
    scans: int = 1
    predicted_variance: Array | None = None


class _Seen(NamedTuple):
    """Detections as each track sees them: values and their variances, ``(T, H, C, D, M)``."""

    value: Array
    variance: Array


class Associated(NamedTuple):
    """Tracks after a slot.

    Attributes
    ----------
    state
        ``(T, H, C)``: the posterior, the likeliest hypothesis first.
    taken
        ``(T, C)``: the detection that is each track's in the likeliest joint event; -1 none.
    free
        ``(T, D)``: detections that are probably no track's.
    memory
        Hypotheses, if there are several.
    """

    state: GaussianState
    taken: IntArray
    free: BoolArray
    memory: Hypotheses | None


def update(
    prior: GaussianState,
    memory: Hypotheses | None,
    scan: Scan,
    model: MeasurementModel,
    uav: UavState,
    space: StateSpace,
) -> Associated:
    """Return the posterior of all tracks.

    Parameters
    ----------
    prior
        ``(T, H, C)``: the prediction of the slot.
    memory
        Hypotheses of the slots before; None before the first, and with one hypothesis.
    scan
        The slot's detections.
    model, uav, space
        As in `echobeam.tracking.filter.update`.
    """
    columns, width = prior.known.shape[-1], _used(prior.known)
    some = _columns(prior, width)
    seen, pairs = _pairs(some, scan, model, uav)

    def updated(before: GaussianState, seen: _Seen, chosen: IntArray) -> GaussianState:
        own, noise = _gathered(seen.value, chosen, np.nan), _gathered(seen.variance, chosen, np.inf)
        return ekf.update(before, own, noise, model, uav, space).state

    total = None
    if scan.method == "mht":
        trials, hypotheses = prior.known.shape[:2]
        before = memory or first_hypotheses((trials,), columns, hypotheses, scan.scans)
        narrow = Hypotheses(before.log_weight, before.history[..., :width])
        growth = grow(narrow, pairs, hypotheses, scan.scans)
        chosen, memory = growth.assignment, _with_columns(growth.hypotheses, columns)
        total = marginal(growth.hypotheses, scan.valid.shape[-1])[..., 1:].sum(axis=-2)
        parent = growth.parent
        parents = GaussianState(
            _of(some.mean, parent), _of(some.cov, parent), _of(some.known, parent)
        )
        state = updated(parents, _Seen(_of(seen.value, parent), _of(seen.variance, parent)), chosen)
    else:
        chosen = nearest(pairs)
        if scan.method == "jpda":
            weight = association_probabilities(pairs)
            state = _mixed(some, seen, weight, updated, space)
            total = weight[:, 0, :, 1:].sum(axis=-2)
        else:
            state = updated(some, seen, chosen)
    taken = np.full((len(chosen), columns), NOBODY)
    taken[:, :width] = chosen[:, 0]
    numbers = np.arange(scan.valid.shape[-1])
    free = scan.valid & ~(taken[..., None] == numbers).any(axis=-2)
    if total is not None:
        free &= total < MOSTLY
    return Associated(_in_place(prior, state), taken, free, memory)


def _columns(state: GaussianState, width: int) -> GaussianState:
    """Return the first columns: tracks begin in the first free one, most of the last are empty."""
    return GaussianState(
        state.mean[:, :, :width], state.cov[:, :, :width], state.known[:, :, :width]
    )


def _in_place(whole: GaussianState, first: GaussianState) -> GaussianState:
    """Return the tracks with new first columns."""
    width = first.known.shape[-1]
    return GaussianState(
        np.concatenate([first.mean, whole.mean[:, :, width:]], axis=2),
        np.concatenate([first.cov, whole.cov[:, :, width:]], axis=2),
        np.concatenate([first.known, whole.known[:, :, width:]], axis=2),
    )


def _with_columns(hypotheses: Hypotheses, columns: int) -> Hypotheses:
    """Return hypotheses about more columns, in which nothing was detected."""
    history = hypotheses.history
    rest = np.full((*history.shape[:-1], columns - history.shape[-1]), NOBODY)
    return Hypotheses(hypotheses.log_weight, np.concatenate([history, rest], axis=-1))


def _of(values: Any, parent: IntArray) -> Any:
    """Return values ``(T, H, ...)`` of the hypotheses ``(T, H')`` that others come from."""
    return values[np.arange(len(parent))[:, None], parent]


def _used(known: BoolArray) -> int:
    """Return the number of columns up to the last one with a track, at least one."""
    used = np.nonzero(known.any(axis=(0, 1)))[0]
    return int(used[-1]) + 1 if used.size else 1


def _pairs(
    prior: GaussianState, scan: Scan, model: MeasurementModel, uav: UavState
) -> tuple[_Seen, Pairs]:
    """Return the detections as each track sees them, and the odds of pairs."""
    width = prior.known.shape[-1]
    shape = (*prior.known.shape, *scan.value.shape[1:])
    expected = model.expected(prior.mean, uav)[..., None, :]
    mirror = scan.mirror[:, None, None]
    error = model.residual(np.broadcast_to(scan.value[:, None, None], shape), expected)
    other = model.residual(np.broadcast_to(mirror, shape), expected)
    behind = np.abs(other[..., :1]) < np.abs(error[..., :1])  # of the angles; NaN is not
    value = np.where(behind, mirror, scan.value[:, None, None])
    error, other = np.where(behind, other, error), np.where(behind, error, other)
    variance = np.broadcast_to(scan.variance[:, None, None], shape)
    if scan.predicted_variance is not None:
        predicted = scan.predicted_variance[:, :, :width]
        variance = np.where(np.isfinite(variance), predicted, np.inf)
    H = model.jacobian(prior.mean, uav)[..., None, :, :]
    S = gaussian.innovation_cov(prior.cov[..., None, :, :], H, variance)
    folded = np.abs(other[..., 0]) < MIRROR_STDS * np.sqrt(S[..., 0, 0])
    if folded.any():
        S[..., 0, 0] = np.where(folded, np.inf, S[..., 0, 0])
        angle = np.where(folded, np.inf, variance[..., 0])
        variance = np.concatenate([angle[..., None], variance[..., 1:]], axis=-1)
    probability = scan.probability[:, :, :width]
    known, valid, density = prior.known, scan.valid[:, None, :], scan.density[:, None, :]
    pairs = pairs_of(error, S, probability, density, scan.gate, known, valid)
    if folded.any():
        more = np.log(density / scan.density_without_angle)[..., None, :]
        pairs = pairs._replace(log_odds=pairs.log_odds + np.where(folded, more, 0.0))
    return _Seen(value, variance), pairs


def _gathered(values: Array, chosen: IntArray, missing: float) -> Array:
    """Return the chosen detection's values for each track, ``(T, H, C, M)``."""
    if values.shape[-2] == 0:
        return np.full((*chosen.shape, values.shape[-1]), missing)
    place = np.maximum(chosen, 0)[..., None, None]
    own = np.take_along_axis(values, place, axis=-2)[..., 0, :]
    return np.where((chosen == NOBODY)[..., None], missing, own)


def _mixed(
    prior: GaussianState,
    seen: _Seen,
    weight: Array,
    updated: Callable[[GaussianState, _Seen, IntArray], GaussianState],
    space: StateSpace,
) -> GaussianState:
    """Return the tracks updated by every detection in proportion to its probability.

    The mixture over the detections is replaced by the Gaussian of its mean and covariance. A track
    with one possible answer has that answer's state in every bit.

    Parameters
    ----------
    prior, seen
        ``(T, H, C)`` tracks and their detections.
    weight
        ``(T, H, C, D + 1)``: probabilities of association, of a miss first.
    updated
        Update by one detection of each track.
    space
        The state space.
    """
    weight = np.where(weight > LEAST_WEIGHT, weight, 0.0)
    order = np.argsort(-weight, axis=-1, kind="stable")
    ordered = np.take_along_axis(weight, order, axis=-1)
    most = max(1, int((ordered > 0.0).sum(axis=-1).max(initial=0)))
    parts, shares = [], []
    for rank in range(most):
        possible = ordered[..., rank] > 0.0
        parts.append(updated(prior, seen, np.where(possible, order[..., rank] - 1, NOBODY)))
        shares.append(np.where(possible & parts[-1].known, ordered[..., rank], 0.0))
    if most == 1:
        return parts[0]
    share = np.stack(shares, axis=-1)
    mean, cov = moment_matched(
        share,
        np.stack([part.mean for part in parts], axis=-2),
        np.stack([part.cov for part in parts], axis=-3),
        space.angles,
    )
    alone = (share[..., 0] > 0.0) & (share[..., 1:] == 0.0).all(axis=-1)
    return GaussianState(
        np.where(alone[..., None], parts[0].mean, mean),
        np.where(alone[..., None, None], parts[0].cov, cov),
        np.asarray((share > 0.0).any(axis=-1)),
    )
