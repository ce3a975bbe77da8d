"""Rate floors (38e) that cannot all be met: say which, and serve all objects fairly.

Coverage alone never fails (one antenna has a flat pattern), so floors are the only constraint
that can be impossible. Then every floor Gamma_k is scaled by the same factor, the largest for
which beams exist: max-min fairness with the floors as weights.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echobeam.beamforming.certify.bounds import dirty_paper_bound, interference_free_bound
from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.power import least_powers
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.proposal import Proposal
from echobeam.beamforming.relaxation import conic
from echobeam.beamforming.relaxation.model import Model, model_gains
from echobeam.beamforming.relaxation.recovery import recover_beams
from echobeam.beamforming.relaxation.sdp import Design, floor_rows, solve_on_grid
from echobeam.beamforming.relaxation.shape import Shape, cover_rows
from echobeam.values import Array, BoolArray

MOST_ROUNDS = 12
ENOUGH = 1e-7
"""Relative rise of the common factor at which the search ends."""

BISECTIONS = 60

ALIKE = 1e-9
"""How far the correlation of two steering vectors may be from one to call them the same."""


@dataclass(frozen=True, slots=True, eq=False)
class Fair:
    """The largest common part of the floors that can be met.

    Attributes
    ----------
    factor
        Of every Gamma_k; 1 if all floors can be met.
    design
        Covariances that meet the scaled floors with all the power.
    """

    factor: float
    design: Design


def fair_proposal(problem: BeamProblem, model: Model, shapes: list[Shape]) -> Proposal:
    """Return the beams that meet the largest common part of the floors, and what is at fault.

    Parameters
    ----------
    problem, model
        The problem whose floors (38e) cannot all be met, and its reduced form.
    shapes
        Best shape of each beam alone.
    """
    fair = largest_factor(model, shapes)
    scaled = replace(model, threshold=np.expm1(fair.factor * np.log1p(model.threshold)))
    return Proposal(
        beams=recover_beams(problem, scaled, fair.design.covariances),
        proof=Proof(bound_without_floors(model, shapes)),
        outcome="floors lowered",
        message=named_faults(problem.min_rate, fair.factor, _alone(model, shapes), model.channels),
        iterations=fair.design.solves + sum(shape.solves for shape in shapes),
    )


def bound_without_floors(model: Model, shapes: list[Shape]) -> float:
    """Return a bound on the sum rate of every design, whatever floors it misses, bit/s/Hz."""
    gains = np.array([shape.bound for shape in shapes])
    free = interference_free_bound(gains, model.loss, 0.0 * model.threshold)
    return min(free, dirty_paper_bound(model.channels, model.loss))


def largest_factor(model: Model, shapes: list[Shape]) -> Fair:
    """Return the largest common factor of the floors (38e) that beams can meet.

    For given shapes the factor is a matter of powers alone; for a given factor the shapes of
    least power are a convex problem. The two in turn climb to the answer as Newton's method does.
    """
    units = [shape.covariance for shape in shapes]
    design = Design(units, [shape.cuts for shape in shapes], 0)
    factor, design = _spread(model, units, design)
    for _ in range(MOST_ROUNDS):
        if factor >= 1.0:
            break
        found = _least_power(model, factor, design)
        if found is None:
            break
        units = [c / max(float(np.trace(c)), np.finfo(float).tiny) for c in found.covariances]
        solved = replace(found, solves=design.solves + found.solves)
        higher, better = _spread(model, units, solved)
        rise = higher - factor
        if rise > 0.0:
            factor, design = higher, better
        if rise <= ENOUGH * factor:
            break
    return Fair(factor, design)


def _spread(model: Model, units: list[Array], design: Design) -> tuple[float, Design]:
    """Return the largest factor for given shapes, and the design that reaches it."""
    gains = model_gains(model, units)

    def powers_for(factor: float) -> Array | None:
        powers = least_powers(gains, model.loss, _scaled_threshold(model, factor))
        return None if powers is None or float(np.sum(powers)) > 1.0 else powers

    low, high, best = 0.0, 1.0, powers_for(1.0)
    if best is not None:
        low = 1.0
    for _ in range(BISECTIONS if best is None else 0):
        middle = (low + high) / 2.0
        powers = powers_for(middle)
        if powers is None:
            high = middle
        else:
            low, best = middle, powers
    if best is None or float(np.sum(best)) <= 0.0:
        best = np.ones(len(units))
    best = best / float(np.sum(best))
    covariances = [power * unit for power, unit in zip(best, units, strict=True)]
    return low, replace(design, covariances=covariances)


def _scaled_threshold(model: Model, factor: float) -> Array:
    return np.expm1(factor * np.log1p(model.threshold))


def _least_power(model: Model, factor: float, around: Design) -> Design | None:
    """Return the covariances of least power that meet the floors times a factor."""
    scaled = replace(model, threshold=_scaled_threshold(model, factor))

    def programme(scales: Array, cuts: list[BoolArray]) -> conic.Programme:
        forms = [
            scale * beam.block.squares(beam.channels)
            for scale, beam in zip(scales, scaled.beams, strict=True)
        ]
        floors, floors_of = floor_rows(scaled, forms)
        return conic.Programme(
            blocks=[beam.block for beam in scaled.beams],
            cost=[
                scale / float(np.sum(scales)) * beam.block.identity()
                for scale, beam in zip(scales, scaled.beams, strict=True)
            ],
            most=floors,
            most_of=floors_of,
            own=[cover_rows(beam, cut) for beam, cut in zip(scaled.beams, cuts, strict=True)],
        )

    powers = np.array([float(np.trace(c)) for c in around.covariances])
    return solve_on_grid(scaled, np.maximum(powers, 1e-6), around.cuts, programme)


def _alone(model: Model, shapes: list[Shape]) -> Array:
    """Return the rate that each object could have with all the power and no other beam."""
    gains = np.array([shape.bound for shape in shapes])
    return np.asarray(np.log1p(gains / model.loss) / np.log(2.0))


def named_faults(min_rate: Array, factor: float, alone: Array, channels: Array) -> str:
    """Say which floors (38e) are at fault, in words.

    Parameters
    ----------
    min_rate
        ``(K,)`` bit/s/Hz: Gamma_k.
    factor
        The common part of them that is met.
    alone
        ``(K,)`` bit/s/Hz: what each object could have with all the power and no other beam.
    channels
        ``(K, N)``: real steering vectors of the objects.
    """
    if factor >= 1.0:
        return "the floors can be met, but the solver did not converge; beams of least power"
    hopeless = np.flatnonzero(min_rate > alone)
    if hopeless.size:
        faults = [
            f"object {k}: floor {min_rate[k]:.3g} bit/s/Hz, at most {alone[k]:.3g} reachable"
            for k in hopeless
        ]
    else:
        faults = [
            f"object {k}: floor {floor:.3g} bit/s/Hz, {factor * floor:.3g} reachable"
            for k, floor in enumerate(min_rate)
            if floor > 0.0
        ]
        faults[0] = "the floors cannot be met together; " + faults[0]
    return "; ".join(faults + _alike(channels)) + f"; all floors scaled by {factor:.4g}"


def _alike(channels: Array) -> list[str]:
    """Name the pairs of objects whose steering vectors are the same: no beam tells them apart."""
    gram = channels @ channels.T / channels.shape[-1]
    first, second = np.nonzero(np.triu(np.abs(gram) >= 1.0 - ALIKE, k=1))
    return [
        f"objects {i} and {k} lie in one direction for the array (same sine), "
        "where no beams can separate them"
        for i, k in zip(first, second, strict=True)
    ]
