"""Method "fast": the direct solver on rank-one beams, examined, with the relaxation behind it."""

from __future__ import annotations

from functools import partial

import numpy as np

from echobeam.beamforming import relaxation
from echobeam.beamforming.certificate import coverage_excess, rate_shortfall
from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.direct import DirectResult, solve_batch
from echobeam.beamforming.objective import beam_gains, channel_loss, rates_from_gains
from echobeam.beamforming.problem import BeamProblem, ProblemBatch
from echobeam.beamforming.proof import Proof
from echobeam.beamforming.proposal import Proposal
from echobeam.values import BoolArray, IntArray

FEASIBLE = 1e-6
"""Largest relative violation of a design that passes for feasible."""

LEAST_ANTENNAS = 2
"""One antenna has one pattern: there is no shape to look for."""

EXAMINED = 2e6
"""Numbers of the full grids' steering vectors that are examined at a time."""


def solve(problem: BeamProblem) -> Proposal:
    """Solve problem (38) with K >= 1 objects; what the direct solver leaves, the relaxation does.

    Floors (38e) out of reach are left to it, too: it names them, and proves it.
    """
    if problem.n_tx < LEAST_ANTENNAS:
        return relaxation.solve(problem)
    found, good = solve_examined(batch_of(problem))
    if not good[0]:
        return relaxation.solve(problem)
    return Proposal(
        beams=found.beams[0],
        proof=Proof(partial(relaxation.prove, problem, float(found.objective[0]))),
        status="optimal",
        message="",
        iterations=int(found.iterations[0]),
    )


def solve_examined(batch: ProblemBatch) -> tuple[DirectResult, BoolArray]:
    """Return what the direct solver found, and which trials' beams converged and keep (38)."""
    found = solve_batch(batch)
    good = found.converged & ~found.floors_infeasible
    steps = np.where(batch.active, batch.coverage_halfwidths, 0.0) / batch.resolution
    numbers = (2.0 * steps.max(initial=0.0) + 3.0) * batch.active.shape[1] * batch.n_tx
    size = max(1, int(EXAMINED / numbers))
    for begin in range(0, len(batch), size):
        part = np.arange(begin, min(begin + size, len(batch)))
        good[part] &= _keeps(batch, found, part)
    return found, good


def batch_of(problem: BeamProblem) -> ProblemBatch:
    """Return one problem as a batch of one."""
    warm = problem.warm_start
    return ProblemBatch(
        angles=problem.angles[np.newaxis],
        distances=problem.distances[np.newaxis],
        coverage_halfwidths=problem.coverage_halfwidths[np.newaxis],
        active=np.ones((1, problem.n_objects), dtype=bool),
        ripple=problem.ripple,
        min_rate=problem.min_rate,
        power=problem.power,
        noise=problem.noise,
        n_tx=problem.n_tx,
        alpha0=problem.alpha0,
        spacing=problem.spacing,
        axis=problem.axis,
        resolution=problem.resolution,
        warm_start=None if warm is None else warm[np.newaxis],
    )


def _keeps(batch: ProblemBatch, found: DirectResult, part: IntArray) -> BoolArray:
    """Return which trials of a part keep power, floors and coverage on the full grid."""
    active = batch.active[part]
    beams = np.where(active[..., np.newaxis], found.beams[part], 0.0)
    angles, distances, halfwidths = (
        np.where(active, values[part], unused)
        for values, unused in (
            (batch.angles, 0.0),
            (batch.distances, 1.0),
            (batch.coverage_halfwidths, 0.0),
        )
    )
    grid, mask = coverage_grid(angles, halfwidths, batch.resolution)
    excess = coverage_excess(beams, angles, grid, mask, batch.ripple, batch.spacing, batch.axis)
    spent = np.sum(np.abs(beams) ** 2, axis=(-2, -1)) / batch.power - 1.0
    gains = beam_gains(beams, angles, batch.spacing, batch.axis)
    achieved = rates_from_gains(gains, channel_loss(distances, batch.noise, batch.alpha0))
    missed = rate_shortfall(achieved, np.where(active, batch.min_rate, 0.0))
    each = np.maximum(excess, missed).max(axis=-1, initial=0.0)
    keeps: BoolArray = np.maximum(each, spent) <= FEASIBLE
    return keeps
