"""Method "fast": the direct solver on rank-one beams, examined, with the relaxation behind it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from echobeam.beamforming.answer import Outcome
from echobeam.beamforming.certify.certificate import (
    FEASIBLE,
    Violations,
    floor_part,
    violation,
    violations,
)
from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.coverage import has_cover
from echobeam.beamforming.direct import LEAST_ANTENNAS, DirectResult, solve_batch
from echobeam.beamforming.flat import STIFF_LOBES, flat_proposal, problem_lobes, single_proposal
from echobeam.beamforming.objective import beam_gains, rates, rates_from_gains
from echobeam.beamforming.problem import BeamProblem, ProblemBatch, only_active
from echobeam.beamforming.proposal import Proposal
from echobeam.beamforming.relaxation import solver as relaxation
from echobeam.beamforming.relaxation.conic import limited
from echobeam.beamforming.relaxation.floors import named_faults
from echobeam.beamforming.relaxation.recovery import keep_coverage, repair_beam_powers
from echobeam.beamforming.subspace import real_steering
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

GIVEN_FEASIBLE = 1e-8
"""The same for beams that were given to start from, and are better than those found."""

RAISED = 1e-9
"""Rise of the sum rate, relative, from which beams given are the better ones: less is rounding."""

LEAST_RIPPLE = 1e-3
"""With less ripple allowed there is hardly an interior for an interior-point method to be in: it
was seen to give up after seconds where the relaxation takes a tenth of one."""

LEAST_SEARCHED = 1e-5
"""With less ripple over a wide cover the direct solver finds nothing better than flat beams."""

RELAXED_WORK = 1e6
"""Work of `conic.limited` that the relaxation may spend on what did not converge: a second, about.
With a third of it one object in twenty under a wide cover of the exact bound got a fallback."""

MOST_LOBES = 12.0
"""Cover in Nyquist lobes up to which the relaxation takes over what did not converge: beyond, and
from `STIFF_LOBES` on with hardly any ripple allowed, it was seen to take minutes."""

MOST_OBJECTS = 16
"""Objects up to which it does: it starts once for each, and 40 were seen to take minutes."""


def load() -> None:
    """Load the compiled solver, or compile it where it is not on disk."""
    from echobeam.beamforming.direct.trials import ready

    ready()


def solve(problem: BeamProblem, found: DirectResult | None = None) -> Proposal:
    """Solve problem (38) with K >= 1 objects; what the direct solver leaves, the relaxation does.

    Where the floors (38e) are out of reach, its beams meet the largest common part of them, and
    the message names what is at fault.

    Parameters
    ----------
    problem
        Problem (38).
    found
        What the direct solver found for it, if it was asked already.
    """
    if problem.array.elements < LEAST_ANTENNAS:
        return single_proposal(problem)
    covered = has_cover(problem.array, problem.coverage_halfwidths)
    stiff = (problem.ripple < LEAST_RIPPLE) & covered
    linear = problem.array.axes == 1
    if stiff.any():
        lobes = problem_lobes(problem)
        if linear and np.max(lobes) <= STIFF_LOBES:
            return _relaxed(problem)
        if np.any(stiff & (problem.ripple < LEAST_SEARCHED)):
            return flat_proposal(problem, lobes)
    batch = problem.batch()
    if found is None:
        found = _solved(batch)
    missed = violations(batch, found.beams, found.floor_factor)
    if not found.converged[0] or missed.largest[0] > FEASIBLE:
        unproved = _unproved(problem, found, problem_lobes(problem))
        # stiff and narrow was left to it above
        if not linear or stiff.any() or long_relaxation(problem):
            return unproved
        relaxed = _relaxed(problem)
        if relaxed.outcome == "converged" or _worth(problem, relaxed.beams) >= _worth(
            problem, unproved.beams
        ):
            return relaxed
        return replace(unproved, proof=relaxed.proof)
    short = bool(found.floors_infeasible[0])
    prove = partial(relaxation.prove, problem, float(found.objective[0]))
    if short:
        prove = partial(relaxation.prove_without_floors, problem)
    return Proposal(
        beams=found.beams[0],
        proof=Proof(prove),
        outcome="floors lowered" if short else "converged",
        message=short_floors(batch, found, np.zeros(1, dtype=np.int64))[0] if short else "",
        iterations=int(found.iterations[0]),
        examined=None if short else missed.trial(0),
    )


def _relaxed(problem: BeamProblem) -> Proposal:
    """Return what the relaxation finds within a second's work."""
    with limited(RELAXED_WORK):
        return relaxation.solve(problem)


def _solved(batch: ProblemBatch) -> DirectResult:
    # A step that goes too far may overflow before it is cut back; what comes out is examined.
    with np.errstate(all="ignore"):
        return solve_batch(batch)


def long_relaxation(problem: BeamProblem) -> bool:
    """Return whether the relaxation would take minutes for a problem with K >= 1 objects."""
    return problem.n_objects > MOST_OBJECTS or bool(np.max(problem_lobes(problem)) > MOST_LOBES)


def _unproved(problem: BeamProblem, found: DirectResult, lobes: Array) -> Proposal:
    """Return what a search that did not converge found, made to keep (38), or better flat beams.

    Better is what meets a larger part of the floors (38e); where both meet them, the sum rate.
    """
    flat = flat_proposal(problem, lobes)
    beams = _made_to_keep(problem, found.beams[0], float(found.floor_factor[0]))
    missed = violation(problem, beams)
    reached, otherwise = _worth(problem, beams), _worth(problem, flat.beams)
    if max(missed.power, missed.coverage) > FEASIBLE or reached <= otherwise:
        return flat
    widest = int(np.argmax(lobes))
    wide = f"object {widest}: its cover is {lobes[widest]:.0f} lobes wide"
    words = wide if lobes[widest] > STIFF_LOBES else f"{problem.n_objects} objects"
    outcome: Outcome = "unproved"
    kept = "all constraints, not proved the best"
    if reached[0] < 1.0:
        outcome = "floors lowered"
        kept = f"power and coverage; all floors scaled by {reached[0]:.4g}"
    return replace(
        flat,
        beams=beams,
        outcome=outcome,
        message=f"{words}, and the search did not converge; the beams keep {kept}",
        iterations=int(found.iterations[0]),
    )


def _made_to_keep(problem: BeamProblem, beams: ComplexArray, factor: float) -> ComplexArray:
    """Return beams that keep coverage, with powers near theirs for a part of the floors."""
    unit = math.sqrt(problem.power)
    kept = keep_coverage(problem, beams / unit)
    threshold = np.expm1(factor * problem.min_rate * math.log(2.0))
    return repair_beam_powers(problem, kept, threshold) * unit


def _worth(problem: BeamProblem, beams: ComplexArray) -> tuple[float, float]:
    """Return the part of the floors (38e) that beams meet, 1 if all, and their sum rate."""
    achieved = rates(problem, beams)
    part = floor_part(achieved, problem.min_rate)
    return (1.0 if part >= 1.0 - FEASIBLE else part), float(np.sum(achieved))


def solve_examined(batch: ProblemBatch) -> tuple[DirectResult, Violations]:
    """Return what the direct solver found, and how far it is from feasible.

    Of floors (38e) that are out of reach the part counts that the solver says it meets.

    Parameters
    ----------
    batch
        T trials.
    """
    found = _solved(batch)
    return found, violations(batch, found.beams, found.floor_factor)


def short_floors(batch: ProblemBatch, found: DirectResult, which: IntArray) -> list[str]:
    """Return what is at fault in trials whose floors (38e) are out of reach, in words.

    Parameters
    ----------
    batch, found
        The problems and what the direct solver found.
    which
        Trials to speak of.
    """
    alone = _alone(batch, found, which)
    messages = []
    for trial, reach in zip(which, alone, strict=True):
        active = batch.active[trial]
        phases = batch.array.phases(batch.angles[trial, active])
        channels = real_steering(phases, batch.array.shape)
        factor = float(found.floor_factor[trial])
        messages.append(named_faults(batch.min_rate[active], factor, reach[active], channels))
    return messages


def _alone(batch: ProblemBatch, found: DirectResult, which: IntArray) -> Array:
    """Return the rate that each object could have with all the power and no other beam.

    ``(len(which), K)``; where the beam found would keep its floor so, that is all that is asked.
    """
    part = batch.taken(which)
    active = part.active
    angles = only_active(active, part.angles)
    loss = np.where(active, part.loss, 1.0) / batch.power
    beams = np.where(active[..., np.newaxis], found.beams[which], 0.0)
    spent = np.sum(np.abs(beams) ** 2, axis=-1)
    own = np.diagonal(beam_gains(beams, angles, batch.array), axis1=-2, axis2=-1)
    gain = own / np.where(spent > 0.0, spent, 1.0)
    rate: Array = np.log1p(gain / loss) / np.log(2.0)
    trials, objects = np.nonzero(active & (rate < batch.min_rate))
    lonely = part.taken(trials)
    single = np.zeros(lonely.active.shape, dtype=bool)
    single[np.arange(trials.size), objects] = True
    unasked = np.zeros_like(batch.min_rate)
    best = solve_batch(replace(lonely, active=single, min_rate=unasked, warm_start=None))
    limit = np.log1p(batch.array.elements / loss[trials, objects]) / np.log(2.0)
    rate[trials, objects] = np.where(best.converged, best.objective, limit)
    return rate


def better_given(batch: ProblemBatch, objective: Array, floors_met: BoolArray) -> BoolArray:
    """Return which trials were given beams to start from that are better than those found.

    Better are beams that keep power, floors and coverage on the full grid where those found do not
    meet the floors, or have the higher sum rate.

    Parameters
    ----------
    batch
        T trials.
    objective, floors_met
        ``(T,)``: sum rate of the beams found, bit/s/Hz, and whether they meet the floors (38e).
    """
    better = np.zeros(len(batch), dtype=bool)
    if batch.warm_start is None:
        return better
    active = batch.active
    given = only_active(active, batch.warm_start)
    there: BoolArray = np.asarray(np.isfinite(given).all(axis=(1, 2)) & active.any(axis=1))
    given = np.where(there[:, np.newaxis, np.newaxis], given, 0.0)
    gains = beam_gains(given, only_active(active, batch.angles), batch.array)
    reached = rates_from_gains(gains, np.where(active, batch.loss, 1.0))
    higher = reached.sum(axis=-1) > objective * (1.0 + RAISED)
    which = np.flatnonzero(there & (higher | ~floors_met))
    if which.size:
        missed = violations(batch.taken(which), given[which])
        better[which] = missed.largest <= GIVEN_FEASIBLE
    return better
