"""Problem in, answer out: the one door to all solvers, and the judge of what they propose."""

from __future__ import annotations

import time
from dataclasses import replace
from numbers import Real

import numpy as np

from echobeam.beamforming.answer import STATUS, BatchAnswer, BeamAnswer
from echobeam.beamforming.certify.certificate import FEASIBLE, floor_part, violation
from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.coverage import cover_size
from echobeam.beamforming.direct import DirectResult
from echobeam.beamforming.fast import (
    better_given,
    short_floors,
    solve,
    solve_examined,
)
from echobeam.beamforming.methods import METHODS
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem, ProblemBatch, ProblemError
from echobeam.beamforming.proposal import Proposal
from echobeam.beamforming.trials import distinct_trials, sound_trials
from echobeam.values import ComplexArray, IntArray

GAP = 1e-4
"""Relative gap that is proved unless another one is asked for."""

MOST_NUMBERS = 2e7
"""Largest number of values of all coverage grids' steering vectors that is taken on."""


def design_beams(
    problem: BeamProblem, method: str = "fast", certify: bool = False, gap: float = GAP
) -> BeamAnswer:
    """Design the beams of one slot, problem (38).

    Parameters
    ----------
    problem
        Objects, coverage, floors, power.
    method
        See `methods`. ``"fast"``: the direct solver, and ``"sdp"`` where that fails. ``"sdp"``:
        the reduced relaxation and a rank-one beam from it. ``"reference"``: the paper's SDR + SCA +
        IRM through CVXPY.
    certify
        Prove how good the beams are by branch and bound, or find better ones. This takes longer,
        and ends with the gap that it has when boxes or work run out; the message says so. For a
        fallback the bound is on designs that keep the floors as far as its beams do.
    gap
        Relative gap to prove.

    Returns
    -------
    BeamAnswer
        Beams and what they achieve, examined on the full grid whatever the solver says.

    Raises
    ------
    ProblemError
        If there is no such method, the coverage grid would not fit into memory, or the gap is
        not positive.
    ImportError
        If ``"reference"`` is asked for and CVXPY is not installed.
    """
    _check_method(method)
    _check_types(problem, gap)
    _check_size(problem)
    solver = METHODS[method].solver()
    begun = time.perf_counter()
    if problem.n_objects == 0:
        return _judged(problem, _nothing(problem), begun)
    answer = _answered(problem, solver(problem), begun)
    return _certified(problem, answer, gap, begun) if certify else answer


def _answered(problem: BeamProblem, proposal: Proposal, begun: float) -> BeamAnswer:
    """Return what a proposal achieves, or the beams that were given where these are better."""
    answer = _judged(problem, proposal, begun)
    return answer if problem.warm_start is None else _or_given(problem, answer, begun)


def design_batch(batch: ProblemBatch, method: str = "fast") -> BatchAnswer:
    """Design the beams of many trials, problem (38); equal problems are solved once.

    A trial whose numbers make no problem (a lost track, say) gets no beams and is marked as a
    fallback; it does not stop the others.

    Parameters
    ----------
    batch
        ``T`` problems.
    method
        As in `design_beams`.
    """
    _check_method(method)
    first, same_as = distinct_trials(batch)
    distinct = batch.taken(first)
    answer = BatchAnswer(
        beams=np.zeros((len(distinct), *batch.active.shape[1:], batch.n_tx), dtype=complex),
        objective=np.zeros(len(distinct)),
        fallback=np.zeros(len(distinct), dtype=bool),
    )
    found: dict[int, DirectResult] = {}
    left = list(range(len(distinct)))
    if method == "fast":
        left, found = _design_together(distinct, answer)
    sound = np.ones(len(distinct), dtype=bool)
    for trial in left:
        one = _one(distinct, trial, method, found.get(trial))
        sound[trial] = not isinstance(one, str)
        _put(answer, distinct, trial, one)
    _take_given(distinct, answer, np.flatnonzero(sound))
    return BatchAnswer(
        beams=answer.beams[same_as],
        objective=answer.objective[same_as],
        fallback=answer.fallback[same_as],
        messages={
            trial: answer.messages[source]
            for trial, source in enumerate(same_as.tolist())
            if source in answer.messages
        },
    )


GIVEN = "no search found beams better than those that it was given to start from"


def _take_given(batch: ProblemBatch, answer: BatchAnswer, sound: IntArray) -> None:
    """Put the beams given in place of those found where they are better.

    ``sound`` are the trials whose numbers make a problem; others are not even examined.
    """
    better = better_given(batch.taken(sound), answer.objective[sound], ~answer.fallback[sound])
    for trial in sound[better].tolist():
        problem = batch.problem(trial)
        assert problem.warm_start is not None
        answer.beams[trial, batch.active[trial]] = problem.warm_start
        answer.objective[trial] = float(np.sum(rates(problem, problem.warm_start)))
        answer.fallback[trial] = False
        answer.messages.pop(trial, None)


def _or_given(problem: BeamProblem, answer: BeamAnswer, begun: float) -> BeamAnswer:
    """Return the answer, or the beams that it was to start from where these are better."""
    objective, met = np.array([answer.objective]), np.array([answer.status == "optimal"])
    if not better_given(problem.batch(), objective, met)[0]:
        return answer
    assert problem.warm_start is not None
    given = Proposal(
        np.array(problem.warm_start), answer.proof, "unproved", GIVEN, answer.iterations
    )
    return _judged(problem, given, begun)


def _check_method(method: str) -> None:
    if not isinstance(method, str) or method not in METHODS:
        raise ProblemError(f"method must be one of {', '.join(METHODS)}, not {method!r}")


def _check_types(problem: object, gap: object) -> None:
    if not isinstance(problem, BeamProblem):
        raise ProblemError(f"problem must be a BeamProblem, not a {type(problem).__name__}")
    if not isinstance(gap, Real) or not float(gap) > 0.0:
        raise ProblemError(f"gap must be a positive number, not {gap!r}")


def _check_size(problem: BeamProblem) -> None:
    points = cover_size(problem.array, problem.coverage_halfwidths, problem.resolution)
    if points * problem.n_objects * problem.n_tx > MOST_NUMBERS:
        raise ProblemError(
            f"the coverage grid has {points:.3g} points per object at n_tx = {problem.n_tx:.10g}, "
            "too many to examine; take a coarser resolution or a narrower coverage"
        )


def _design_together(
    batch: ProblemBatch, answer: BatchAnswer
) -> tuple[list[int], dict[int, DirectResult]]:
    """Take what the direct solver finds; return the trials left, and what it found for them."""
    which = np.flatnonzero(sound_trials(batch))
    found, missed = solve_examined(batch.taken(which))
    good = found.converged & (missed.largest <= FEASIBLE)
    kept = which[good]
    answer.beams[kept] = found.beams[good]
    answer.objective[kept] = found.objective[good]
    short = np.flatnonzero(good & found.floors_infeasible)
    answer.fallback[which[short]] = True
    messages = short_floors(batch.taken(which), found, short)
    answer.messages.update(zip(which[short].tolist(), messages, strict=True))
    bad = np.flatnonzero(~good)
    active = batch.active[which[bad]]
    poor = {
        trial: found.trial(place, there)
        for trial, place, there in zip(which[bad].tolist(), bad.tolist(), active, strict=True)
    }
    return sorted(set(range(len(batch))) - set(kept.tolist())), poor


def _put(answer: BatchAnswer, batch: ProblemBatch, trial: int, found: BeamAnswer | str) -> None:
    """Write one trial's answer; a text says why there is none."""
    if isinstance(found, str):
        answer.fallback[trial], answer.messages[trial] = True, found
        return
    answer.beams[trial, batch.active[trial]] = found.beams
    answer.objective[trial] = found.objective
    if found.status != "optimal":
        answer.fallback[trial], answer.messages[trial] = True, found.message


def _one(
    batch: ProblemBatch, trial: int, method: str, found: DirectResult | None
) -> BeamAnswer | str:
    """Return the answer to one trial, or in words why there is none.

    ``found`` is what the direct solver found for it, if it was asked already.
    """
    try:
        problem = batch.problem(trial)
        if found is None:
            return design_beams(problem, method)
        _check_size(problem)
        begun = time.perf_counter()
        return _answered(problem, solve(problem, found), begun)
    except ProblemError as error:
        return str(error)


def _nothing(problem: BeamProblem) -> Proposal:
    beams: ComplexArray = np.zeros((0, problem.n_tx), dtype=complex)
    return Proposal(beams, proof=Proof(0.0), outcome="converged", message="", iterations=0)


def _certified(problem: BeamProblem, answer: BeamAnswer, gap: float, begun: float) -> BeamAnswer:
    """Return the answer with the bound of branch and bound, and better beams if that found some."""
    from echobeam.beamforming.certify.branch import certify

    stated = problem if answer.status == "optimal" else _with_floors_met(problem, answer)
    found = certify(stated, answer.beams, answer.objective, gap)
    if found.beams is not None:
        proposed = Proposal(
            found.beams, Proof(found.bound), answer.outcome, answer.message, answer.iterations
        )
        judged = _judged(problem, proposed, begun)
        keeps = violation(stated, found.beams).largest <= FEASIBLE
        if keeps and judged.objective > answer.objective:
            answer = judged
    answer = replace(answer, proof=Proof(found.bound), seconds=time.perf_counter() - begun)
    if answer.gap <= gap:
        return answer
    short = f"a gap of {gap:.3g} was not reached; it is {answer.gap:.3g} after {found.boxes} boxes"
    return replace(answer, message="; ".join(filter(None, [answer.message, short])))


def _with_floors_met(problem: BeamProblem, answer: BeamAnswer) -> BeamProblem:
    """Return the problem with its floors (38e) scaled to what an answer keeps of them."""
    part = floor_part(answer.rates, problem.min_rate)
    return replace(problem, min_rate=problem.min_rate * part)


def _judged(problem: BeamProblem, proposal: Proposal, begun: float) -> BeamAnswer:
    achieved = rates(problem, proposal.beams)
    missed = proposal.examined or violation(problem, proposal.beams)
    outcome, message = proposal.outcome, proposal.message
    if STATUS[outcome] == "optimal" and missed.largest > FEASIBLE:
        outcome = "violated"
        message = f"no design was found that keeps all constraints: {missed}"
    return BeamAnswer(
        beams=proposal.beams,
        objective=float(np.sum(achieved)),
        proof=proposal.proof,
        outcome=outcome,
        message=message,
        rates=achieved,
        max_violation=missed,
        seconds=time.perf_counter() - begun,
        iterations=proposal.iterations,
    )
