"""Method "sdp": the reduced relaxation of (38), its proof, and rank-one beams from it.

Best shapes alone, a bound from them, then the joint climb where beams disturb each other or
floors bind; other starts where the bound leaves room for something better.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from echobeam.beamforming.certify.bounds import dirty_paper_bound, interference_free_bound
from echobeam.beamforming.certify.certificate import FEASIBLE, violation
from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.flat import flat_proposal, problem_lobes
from echobeam.beamforming.objective import sinr
from echobeam.beamforming.power import BUDGET_DIGITS, spend
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.proposal import Proposal
from echobeam.beamforming.relaxation.conic import limited
from echobeam.beamforming.relaxation.floors import bound_without_floors, fair_proposal
from echobeam.beamforming.relaxation.model import Model, build_model, model_gains
from echobeam.beamforming.relaxation.recovery import recover_beams
from echobeam.beamforming.relaxation.sdp import Design, improve, sum_rate
from echobeam.beamforming.relaxation.shape import Shape, best_shape
from echobeam.values import Array

PROVED = 1e-8
"""Relative gap at which a design is taken as the best one without further search."""

DOUBTFUL = 1e-2
"""Relative gap above which other starts are tried."""

FAR = 0.1
"""Relative gap above which the message says so: beyond an SNR of 1e10 the climb ends early."""

CLOSE = 1e-5
"""Relative gap at which a bound is not tightened further."""

MOST_WORK, BOUND_WORK = 1e7, 6e5
"""Limits of `conic.limited` for method "sdp", some ten seconds, and for a bound, half a second."""

FLOOR_DIGITS = 1e-6
CRUMB = 1e-3
SEPARABLE = 1e-6


def solve(problem: BeamProblem) -> Proposal:
    """Solve problem (38) with K >= 1 objects through its reduced relaxation, Eqs. (51)-(54).

    Beyond `MOST_WORK` the best design so far is the answer, unproved, and its message says so.
    """
    with limited(MOST_WORK) as work:
        proposal = _solve(problem)
    if not work.reached:
        return proposal
    words = "; ".join(filter(None, ["the relaxation reached its limit of work", proposal.message]))
    outcome = "unproved" if proposal.outcome == "converged" else proposal.outcome
    return replace(proposal, outcome=outcome, message=words)


def _solve(problem: BeamProblem) -> Proposal:
    model = build_model(problem)
    shapes = [best_shape(beam) for beam in model.beams]
    found = None if impossible_alone(model, shapes) else _search(model, shapes)
    if found is None:
        return fair_proposal(problem, model, shapes)
    beams = recover_beams(problem, model, found.design.covariances)
    if problem.array.axes > 1 and violation(problem, beams).largest > FEASIBLE:
        flat = flat_proposal(problem, problem_lobes(problem))
        words = (
            "the relaxation is a bound: no single beams with its patterns were found; flat beams"
        )
        return replace(flat, proof=Proof(found.bound), message=words)
    return Proposal(
        beams=beams,
        proof=Proof(found.bound),
        outcome="converged" if found.converged else "unproved",
        message=_message(found, _value(model, found.design)),
        iterations=found.design.solves + sum(shape.solves for shape in shapes),
    )


def _message(found: _Found, value: float) -> str:
    """Say what is doubtful about a design of some sum rate, bit/s/Hz."""
    if not found.converged:
        return "the joint climb failed; best shapes alone"
    above = found.bound / value - 1.0 if value > 0.0 else 0.0
    if above <= FAR:
        return ""
    return (
        f"the proved bound is {100.0 * above:.3g} % above: the climb may have ended early, or in a "
        "local optimum"
    )


def prove(problem: BeamProblem, value: float) -> float:
    """Return `upper_bound` of a problem with K >= 1 objects, given a design's sum rate.

    Looser where `BOUND_WORK` is reached: a shape without a proof of its own counts with gain N.
    """
    model = build_model(problem)
    with limited(BOUND_WORK):
        return upper_bound(model, [best_shape(beam) for beam in model.beams], value)


def prove_without_floors(problem: BeamProblem) -> float:
    """Return `bound_without_floors` of a problem with K >= 1 objects."""
    model = build_model(problem)
    with limited(BOUND_WORK):
        return bound_without_floors(model, [best_shape(beam) for beam in model.beams])


def upper_bound(model: Model, shapes: list[Shape], value: float = 0.0) -> float:
    """Return the smallest bound that could be proved from the shapes' bounds, bit/s/Hz.

    Parameters
    ----------
    model, shapes
        The reduced problem and the best shape of each beam.
    value
        Sum rate of a design; a bound close to it is not tightened further.
    """
    gains = np.array([shape.bound for shape in shapes])
    free = interference_free_bound(gains, model.loss, model.threshold)
    if free <= value * (1.0 + CLOSE):
        return free
    return min(free, dirty_paper_bound(model.channels, model.loss))


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    design: Design
    bound: float
    converged: bool


def _search(model: Model, shapes: list[Shape]) -> _Found | None:
    """Return the best design found, None if the floors (38e) could not be met."""
    units = [shape.covariance for shape in shapes]
    cuts = [shape.cuts for shape in shapes]
    powers = spend(model_gains(model, units), model.loss, model.threshold)
    found = None
    if powers is not None:
        design = Design(_scaled(units, powers), cuts, 0)
        bound = upper_bound(model, shapes, _value(model, design))
        found = _Found(design, bound, bound <= _value(model, design) * (1.0 + PROVED))
        if found.converged:
            return found
    for covariances in _starts(model, units, powers):
        climbed = improve(model, Design(covariances, cuts, 0))
        if climbed is not None and meets_floors(model, climbed):
            found = _better(model, found, climbed)
        if found is None:
            return None
        bound = upper_bound(model, shapes, _value(model, found.design))
        found = replace(found, bound=bound)
        if bound <= _value(model, found.design) * (1.0 + DOUBTFUL):
            break
    return found


def _better(model: Model, found: _Found | None, design: Design) -> _Found:
    if found is None or _value(model, design) > _value(model, found.design):
        return _Found(design, np.inf, converged=True)
    return replace(found, converged=True)


def impossible_alone(model: Model, shapes: list[Shape]) -> bool:
    """Return whether the floors take more than the power even without interference."""
    gains = np.array([shape.bound for shape in shapes])
    return bool(np.sum(model.threshold * model.loss / gains) > 1.0 + BUDGET_DIGITS)


def meets_floors(model: Model, design: Design) -> bool:
    """Return whether a design keeps the floors (38e), but for the last digits."""
    reached = sinr(model_gains(model, design.covariances), model.loss)
    return bool(np.all(reached >= model.threshold * (1.0 - FLOOR_DIGITS)))


def _starts(model: Model, units: list[Array], powers: Array | None) -> Iterator[list[Array]]:
    """Give places to approximate from: water-filling, clean separation, one object for all."""
    n_objects = len(units)
    equal = np.full(n_objects, 1.0 / n_objects)
    yield _scaled(units, equal if powers is None else powers)
    yield _scaled([_separating(model, k) for k in range(n_objects)], equal)
    for favourite in range(n_objects):
        yield _scaled(units, np.where(np.arange(n_objects) == favourite, 1.0, CRUMB))


def _separating(model: Model, k: int) -> Array:
    """Return the matched beam of one object, cleared of interference at the others."""
    beam = model.beams[k]
    foreign, _ = np.linalg.qr(np.delete(beam.channels, k, axis=0).T)
    left = beam.own - foreign @ (foreign.T @ beam.own)
    size = float(left @ left)
    if size <= SEPARABLE * float(beam.own @ beam.own):
        left, size = beam.own, float(beam.own @ beam.own)
    return np.outer(left, left) / size


def _scaled(units: list[Array], powers: Array) -> list[Array]:
    return [power * unit for power, unit in zip(powers, units, strict=True)]


def _value(model: Model, design: Design) -> float:
    return float(sum_rate(model_gains(model, design.covariances), model.loss) / np.log(2.0))
