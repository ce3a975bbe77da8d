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
from echobeam.tracking.association.hypotheses import Hypotheses, first_hypotheses, grow
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
        NaN where it can. A track takes the one that is nearer to its prediction.
    probability
        ``(T, H, C)``: of detection, at each track's prediction.
    density
        ``(T, D)``: of false detections, at each one.
    gate
        Probability with which a track's own detection is inside its gate.
    method
        Association.
    scans
        Slots after which hypotheses are decided ("mht"); the prior has as many as are held.
    """

    value: Array
    variance: Array
    valid: BoolArray
    mirror: Array
    probability: Array
    density: Array
    gate: float
    method: Method
    scans: int = 1


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
    value, pairs = _pairs(some, scan, model, uav)

    def updated(before: GaussianState, value: Array, chosen: IntArray) -> GaussianState:
        own, noise = _gathered(value, scan.variance, chosen)
        return ekf.update(before, own, noise, model, uav, space).state

    total = None
    if scan.method == "mht":
        trials, hypotheses = prior.known.shape[:2]
        before = memory or first_hypotheses((trials,), columns, hypotheses, scan.scans)
        narrow = Hypotheses(before.log_weight, before.history[..., :width])
        growth = grow(narrow, pairs, hypotheses, scan.scans)
        chosen, memory = growth.assignment, _with_columns(growth.hypotheses, columns)
        parent = growth.parent
        parents = GaussianState(
            _of(some.mean, parent), _of(some.cov, parent), _of(some.known, parent)
        )
        state = updated(parents, _of(value, growth.parent), chosen)
    else:
        chosen = nearest(pairs)
        if scan.method == "jpda":
            weight = association_probabilities(pairs)
            state = _mixed(some, value, weight, updated, space)
            total = weight[:, 0, :, 1:].sum(axis=-2)
        else:
            state = updated(some, value, chosen)
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
) -> tuple[Array, Pairs]:
    """Return the detections as each track sees them, ``(T, H, C, D, M)``, and the odds of pairs."""
    expected = model.expected(prior.mean, uav)[..., None, :]
    value = np.broadcast_to(scan.value[:, None, None], (*prior.known.shape, *scan.value.shape[1:]))
    error = model.residual(value, expected)
    other = model.residual(np.broadcast_to(scan.mirror[:, None, None], value.shape), expected)
    behind = np.abs(other[..., :1]) < np.abs(error[..., :1])  # of the angles; NaN is not
    value = np.where(behind, scan.mirror[:, None, None], value)
    error = np.where(behind, other, error)
    H = model.jacobian(prior.mean, uav)[..., None, :, :]
    variance = scan.variance[:, None, None]
    shape = (*error.shape, error.shape[-1])
    S = np.broadcast_to(
        gaussian.innovation_cov(
            prior.cov[..., None, :, :], H, np.broadcast_to(variance, error.shape)
        ),
        shape,
    )
    pairs = pairs_of(
        error,
        S,
        scan.probability[:, :, : prior.known.shape[-1]],
        scan.density[:, None, :],
        scan.gate,
        prior.known,
        scan.valid[:, None, :],
    )
    return value, pairs


def _gathered(value: Array, variance: Array, chosen: IntArray) -> tuple[Array, Array]:
    """Return the chosen detection of each track and its variance, ``(T, H, C, M)``."""
    missing = (chosen == NOBODY)[..., None]
    if value.shape[-2] == 0:
        shape = (*chosen.shape, value.shape[-1])
        return np.full(shape, np.nan), np.full(shape, np.inf)
    place = np.maximum(chosen, 0)[..., None, None]
    own = np.take_along_axis(value, place, axis=-2)[..., 0, :]
    spread = np.broadcast_to(variance[:, None, None], value.shape)
    noise = np.take_along_axis(spread, place, axis=-2)[..., 0, :]
    return np.where(missing, np.nan, own), np.where(missing, np.inf, noise)


def _mixed(
    prior: GaussianState,
    value: Array,
    weight: Array,
    updated: Callable[[GaussianState, Array, IntArray], GaussianState],
    space: StateSpace,
) -> GaussianState:
    """Return the tracks updated by every detection in proportion to its probability.

    The mixture over the detections is replaced by the Gaussian of its mean and covariance. A track
    with one possible answer has that answer's state in every bit.

    Parameters
    ----------
    prior, value
        ``(T, H, C)`` and ``(T, H, C, D, M)``.
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
        parts.append(updated(prior, value, np.where(possible, order[..., rank] - 1, NOBODY)))
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
