"""What beams are worth, whoever made them: sum rate, violation on the full grid, certified gap."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem, ProblemBatch
from echobeam.values import Array, BoolArray, ComplexArray

MOST_BOUNDS = 64
"""Problems of a case whose optimum is bounded."""

MOST_OBJECTS = 4
"""K up to which branch and bound proves; beyond it takes a minute and proves little more."""

BUDGET = 3.0
"""s: after which no further problem's optimum is bounded."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """What P designs of one method are worth.

    Attributes
    ----------
    objective
        ``(P,)`` bit/s/Hz, Eq. (38a), from the beams; NaN where there are none.
    violation
        ``(P,)``: largest relative violation of (38b), (38e), (38f) on the full grid, of a stated
        fallback that of (38b), (38f); infinite where there are no beams.
    gap
        ``(P,)``: certified relative gap; NaN where no bound was proved.
    """

    objective: Array
    violation: Array
    gap: Array


def bounds_of(batch: ProblemBatch, count: int) -> Array:
    """Return ``(count,)`` proved upper bounds of the first problems, NaN where there is none.

    A bound belongs to the problem and not to a method, so that every method is held against the
    same one. Floors that are out of reach leave none.
    """
    bounds = np.full(count, np.nan)
    begun = time.perf_counter()
    for trial in range(min(count, MOST_BOUNDS)):
        if time.perf_counter() - begun > BUDGET:
            break
        problem = batch.problem(trial)
        answer = design_beams(problem, certify=problem.n_objects <= MOST_OBJECTS)
        if answer.status == "optimal" and np.isfinite(answer.upper_bound):
            bounds[trial] = answer.upper_bound
    return bounds


def judge(
    batch: ProblemBatch,
    designs: Sequence[ComplexArray | None],
    fallback: BoolArray,
    bounds: Array,
) -> Judged:
    """Return what designs of the first problems of a batch are worth.

    Parameters
    ----------
    batch
        T >= P problems.
    designs
        P times ``(K, n_tx)``, or None.
    fallback
        ``(P,)``: the design says that the floors (38e) are out of its reach.
    bounds
        ``(P,)`` or more: `bounds_of`.
    """
    figures = [
        _one(batch.problem(trial), beams, bool(fallback[trial]))
        for trial, beams in enumerate(designs)
    ]
    objective = np.array([value for value, _ in figures])
    with np.errstate(divide="ignore", invalid="ignore"):
        gap = np.maximum(bounds[: objective.size] - objective, 0.0) / objective
    return Judged(objective, np.array([missed for _, missed in figures]), gap)


def _one(problem: BeamProblem, beams: ComplexArray | None, fallback: bool) -> tuple[float, float]:
    if beams is None:
        return np.nan, np.inf
    missed = violation(problem, beams)
    largest = max(missed.power, missed.coverage) if fallback else missed.largest
    return float(np.sum(rates(problem, beams))), largest
