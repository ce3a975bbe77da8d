"""The relaxed problem (38) with interference in a box: solved for good multipliers, then proved.

The first logarithm of the sum rate keeps its second-order model around what is received, renewed
round by round, as in `sdp`; the second one is replaced by its chord over the box (`box_bound`), so
that the programme is convex as it stands and no start matters. What the solver returns is only a
suggestion: the multipliers, at which the bound is evaluated, and beams, which may be better ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.certify.box_bound import Box, Multipliers, box_bound
from echobeam.beamforming.relaxation import conic
from echobeam.beamforming.relaxation.model import Model, model_gains
from echobeam.beamforming.relaxation.sdp import LEAST_SCALE, floor_rows, keep_coverage
from echobeam.beamforming.relaxation.shape import cover_rows
from echobeam.values import Array, BoolArray

MOST_ROUNDS = 6
ENOUGH = 1e-6
"""Relative distance of the bound and what the relaxed beams reach at which the rounds end."""

LEAST_TOTAL = 1e-9
"""The sum rate is counted in units of what is received, but of no less than this part of what
all objects together could have alone."""

LEAST_LIMIT = 1e-6
"""Limits of the box are counted in units of themselves, but of no less than this part of N."""


@dataclass(frozen=True, slots=True, eq=False)
class Relaxed:
    """What is known of the designs whose interference lies in a box.

    Attributes
    ----------
    bound
        None of them has a larger sum rate, bit/s/Hz, proved; infinite if nothing was proved, minus
        infinity if there are none.
    covariances
        ``(r_k, r_k)`` per beam: the relaxed beams, which keep coverage; None if none were found.
    cuts
        Grid points imposed so far.
    """

    bound: float
    covariances: list[Array] | None
    cuts: list[BoolArray]


def relax_box(
    model: Model, box: Box, around: list[Array], cuts: list[BoolArray], enough: float
) -> Relaxed:
    """Return a proved bound for a box, and the beams of the relaxed problem.

    Parameters
    ----------
    model
        The reduced problem.
    box
        Limits of the interference.
    around
        Covariances of a design to start the second-order model from.
    cuts
        Grid points to impose at first.
    enough
        bit/s/Hz: a bound no larger than this is not tightened.
    """
    received = model_gains(model, around).sum(axis=-1)
    scales = _scales(around)
    found = Relaxed(np.inf, None, cuts)
    for _ in range(MOST_ROUNDS):
        answer = conic.solve(_programme(model, box, received, scales, cuts))
        if answer.infeasible and _proved_empty(model, box, answer, scales, cuts):
            return Relaxed(-np.inf, None, cuts)
        if not answer.usable:
            break
        values = [scale * _positive(m) for scale, m in zip(scales, answer.matrices, strict=True)]
        gains = model_gains(model, values)
        total = _total(model, received)
        at = _multipliers(model, box, answer, scales, total, gains.sum(axis=-1))
        bound = min(found.bound, _bound(model, box, at, cuts))
        kept, cuts, complete = keep_coverage(model, values, cuts)
        found = Relaxed(bound, kept, cuts)
        reached = _relaxed_rate(model, box, model_gains(model, kept))
        if bound <= enough or (complete and bound <= reached + ENOUGH * bound):
            break
        received, scales = gains.sum(axis=-1), _scales(values)
    return found


def _scales(covariances: list[Array]) -> Array:
    return np.maximum([float(np.trace(c)) for c in covariances], LEAST_SCALE)


def _positive(symmetric: Array) -> Array:
    values, vectors = np.linalg.eigh(symmetric)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _total(model: Model, received: Array) -> float:
    """Return the size of the sum rate, nats, in which the programme counts.

    A round may end with beams of next to no power; in units of what they reach the next programme
    would overflow.
    """
    most = float(np.sum(np.log1p(model.channels.shape[-1] / model.loss)))
    return max(float(np.sum(np.log1p(received / model.loss))), LEAST_TOTAL * most)


def _relaxed_rate(model: Model, box: Box, gains: Array) -> float:
    """Return what the relaxed problem makes of beams, bit/s/Hz."""
    own = np.diagonal(gains)
    interference = gains.sum(axis=-1) - own
    rate = np.log1p(own / (interference + model.loss)) + box.lift(model.loss, interference)
    return float(np.sum(rate) / np.log(2.0))


def _programme(
    model: Model, box: Box, received: Array, scales: Array, cuts: list[BoolArray]
) -> conic.Programme:
    """Return the relaxed problem around what is received, as a minimisation relative to it."""
    n_objects = scales.size
    noise = model.loss + received
    total = _total(model, received)
    unit = np.array([float(beam.own @ beam.own) for beam in model.beams])
    forms = [
        scale * beam.block.squares(beam.channels)
        for scale, beam in zip(scales, model.beams, strict=True)
    ]
    others = [np.arange(n_objects) != k for k in range(n_objects)]
    chord = box.chord(model.loss)
    floors, floors_of = floor_rows(model, forms)
    interference = [form * other[:, np.newaxis] for form, other in zip(forms, others, strict=True)]
    high, low, bounded = _limits(model, box)
    return conic.Programme(
        blocks=[beam.block for beam in model.beams],
        cost=[(chord * other / total) @ form for form, other in zip(forms, others, strict=True)],
        equal=[form / unit[:, np.newaxis] for form in forms],
        equal_free=-np.eye(n_objects),
        equal_to=np.zeros(n_objects),
        free_cost=-(unit / noise) * (1.0 + received / noise) / total,
        curvature=(unit / noise) ** 2 / total,
        most=[
            np.vstack(
                [
                    scale * beam.block.identity(),
                    floor,
                    interferes / high[:, np.newaxis],
                    -interferes[bounded] / low[bounded, np.newaxis],
                ]
            )
            for scale, beam, floor, interferes in zip(
                scales, model.beams, floors, interference, strict=True
            )
        ],
        most_of=np.concatenate(
            [[1.0], floors_of, box.high / high, -box.low[bounded] / low[bounded]]
        ),
        own=[cover_rows(beam, cut) for beam, cut in zip(model.beams, cuts, strict=True)],
    )


def _limits(model: Model, box: Box) -> tuple[Array, Array, BoolArray]:
    """Return units to count the box's limits in, and which lower ones there are."""
    least = LEAST_LIMIT * model.channels.shape[-1]
    return np.maximum(box.high, least), np.maximum(box.low, least), box.low > 0.0


def _multipliers(
    model: Model,
    box: Box,
    answer: conic.ConicAnswer,
    scales: Array,
    total: float,
    received: Array,
) -> Multipliers:
    """Return the programme's multipliers in the units of `box_bound`."""
    n_objects = scales.size
    asked = model.threshold > 0.0
    high, low, bounded = _limits(model, box)
    shared = total * answer.most_multipliers[1:]
    floors, at_least = np.zeros(n_objects), np.zeros(n_objects)
    n_floors = int(np.sum(asked))
    floors[asked] = shared[:n_floors] / (model.threshold * model.loss)[asked]
    at_most = shared[n_floors : n_floors + n_objects] / high
    at_least[bounded] = shared[n_floors + n_objects :] / low[bounded]
    halves = [
        np.split(total * own / scale, 2)
        for own, scale in zip(answer.own_multipliers, scales, strict=True)
    ]
    return Multipliers(
        received=received,
        floors=floors,
        at_most=at_most,
        at_least=at_least,
        above=[above for above, _ in halves],
        below=[below for _, below in halves],
    )


def _bound(
    model: Model, box: Box, at: Multipliers, cuts: list[BoolArray], rates: bool = True
) -> float:
    covers = [beam.steering[1:][cut] for beam, cut in zip(model.beams, cuts, strict=True)]
    ripple = np.array([beam.ripple for beam in model.beams])
    return box_bound(
        model.channels, covers, ripple, model.loss, model.threshold, box, at, rates=rates
    )


def _proved_empty(
    model: Model, box: Box, answer: conic.ConicAnswer, scales: Array, cuts: list[BoolArray]
) -> bool:
    """Return whether the solver's proof that there is no design in the box holds when evaluated."""
    received = np.zeros(scales.size)
    at = _multipliers(model, box, answer, scales, 1.0, received)
    return _bound(model, box, at, cuts, rates=False) < 0.0
