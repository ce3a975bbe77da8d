"""Problem in, answer out: the one door to all solvers, and the judge of what they propose."""

from __future__ import annotations

import time
from importlib import import_module
from typing import Any

import numpy as np

from echobeam.beamforming.answer import BatchAnswer, BeamAnswer
from echobeam.beamforming.certificate import violation
from echobeam.beamforming.coverage import coverage_steps
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem, ProblemBatch, ProblemError
from echobeam.beamforming.proposal import Proposal
from echobeam.values import ComplexArray

SOLVERS = {
    "fast": "echobeam.beamforming.relaxation",
    "sdp": "echobeam.beamforming.relaxation",
    "reference": "echobeam.beamforming.reference",
}
"""Where each method's ``solve(problem) -> Proposal`` lives; imported when first used."""

FEASIBLE = 1e-6
"""Largest relative violation of a design that passes for feasible."""

MOST_NUMBERS = 2e7
"""Largest number of values of all coverage grids' steering vectors that is taken on."""


def design_beams(problem: BeamProblem, method: str = "fast") -> BeamAnswer:
    """Design the beams of one slot, problem (38).

    Parameters
    ----------
    problem
        Objects, coverage, floors, power.
    method
        ``"fast"``: the quickest solver there is. ``"sdp"``: the reduced relaxation and a rank-one
        beam from it. ``"reference"``: the paper's SDR + SCA + IRM through CVXPY.

    Returns
    -------
    BeamAnswer
        Beams and what they achieve, examined on the full grid whatever the solver says.

    Raises
    ------
    ProblemError
        If there is no such method, or the coverage grid would not fit into memory.
    ImportError
        If ``"reference"`` is asked for and CVXPY is not installed.
    """
    _check_method(method)
    _check_size(problem)
    begun = time.perf_counter()
    proposal = _nothing(problem) if problem.n_objects == 0 else _solver(method)(problem)
    return _judged(problem, proposal, begun)


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
    n_trials, n_objects = batch.active.shape
    beams = np.zeros((n_trials, n_objects, batch.n_tx), dtype=complex)
    objective = np.zeros(n_trials)
    fallback = np.zeros(n_trials, dtype=bool)
    messages: dict[int, str] = {}
    solved: dict[bytes, BeamAnswer | str] = {}
    for trial in range(n_trials):
        key = _key(batch, trial)
        if key not in solved:
            solved[key] = _one(batch, trial, method)
        answer = solved[key]
        if isinstance(answer, str):
            fallback[trial], messages[trial] = True, answer
            continue
        beams[trial, batch.active[trial]] = answer.beams
        objective[trial] = answer.objective
        if answer.status != "optimal":
            fallback[trial], messages[trial] = True, answer.message
    return BatchAnswer(beams=beams, objective=objective, fallback=fallback, messages=messages)


def _check_method(method: str) -> None:
    if method not in SOLVERS:
        raise ProblemError(f"method must be one of {', '.join(SOLVERS)}, not {method!r}")


def _check_size(problem: BeamProblem) -> None:
    steps = coverage_steps(problem.coverage_halfwidths, problem.resolution)
    points = 2.0 * float(np.max(steps, initial=0)) + 1.0
    if points * problem.n_objects * problem.n_tx > MOST_NUMBERS:
        raise ProblemError(
            f"the coverage grid has {points:.3g} points per object at n_tx = {problem.n_tx}, "
            "too many to examine; take a coarser resolution or a narrower coverage"
        )


def _one(batch: ProblemBatch, trial: int, method: str) -> BeamAnswer | str:
    try:
        return design_beams(batch.problem(trial), method)
    except ProblemError as error:
        return str(error)


def _key(batch: ProblemBatch, trial: int) -> bytes:
    """Return what tells one trial's problem from another's."""
    active = batch.active[trial]
    parts = [active, *(a[trial, active] for a in (batch.angles, batch.distances))]
    parts.append(batch.coverage_halfwidths[trial, active])
    if batch.warm_start is not None:
        parts.append(batch.warm_start[trial, active])
    return b"".join(np.ascontiguousarray(part).tobytes() for part in parts)


def _solver(method: str) -> Any:
    return import_module(SOLVERS[method]).solve


def _nothing(problem: BeamProblem) -> Proposal:
    beams: ComplexArray = np.zeros((0, problem.n_tx), dtype=complex)
    return Proposal(beams, upper_bound=0.0, status="optimal", message="", iterations=0)


def _judged(problem: BeamProblem, proposal: Proposal, begun: float) -> BeamAnswer:
    achieved = rates(problem, proposal.beams)
    missed = violation(problem, proposal.beams)
    status, message = proposal.status, proposal.message
    if status == "optimal" and missed.largest > FEASIBLE:
        status = "fallback"
        message = f"no design was found that keeps all constraints: {missed}"
    objective = float(np.sum(achieved))
    # Rounding may put the last digit of an exact optimum above its bound.
    bound = max(proposal.upper_bound, objective)
    return BeamAnswer(
        beams=proposal.beams,
        objective=objective,
        upper_bound=bound,
        status=status,
        message=message,
        rates=achieved,
        max_violation=missed,
        seconds=time.perf_counter() - begun,
        iterations=proposal.iterations,
    )
