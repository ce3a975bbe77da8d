"""The direct solver: rank-one beams for problem (38), a whole batch of trials in one call.

A trial's beams are found in the dual uplink (`uplink`), where their shapes separate; the shapes
of all beams of all trials take their Newton steps together (`barrier`), with the powers improved
in between. The first rounds impose a few points of each cover, later ones whatever the full grid
shows to be missed (`cuts`). What does not converge starts again from another chirp; what still
does not says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.direct.beams import beam_set, cover_phases, node_count
from echobeam.beamforming.direct.chirp import CHIRPS
from echobeam.beamforming.direct.climb import Trials, climb
from echobeam.beamforming.direct.contest import settle
from echobeam.beamforming.objective import channel_loss
from echobeam.beamforming.problem import ProblemBatch
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

CHUNK = 256
"""Beams worked on at a time: what fits the cache."""


@dataclass(frozen=True, slots=True, eq=False)
class DirectResult:
    """What the direct solver found for T trials.

    Attributes
    ----------
    beams
        ``(T, K, N)``, sqrt(power); zero for inactive objects and where nothing was found.
    objective
        ``(T,)`` bit/s/Hz: the sum rate of these beams.
    converged
        ``(T,)``: feasible and optimal to the solver's tolerance. The others are best efforts.
    floors_infeasible
        ``(T,)``: the floors (38e) were found to take more than the power.
    floor_factor
        ``(T,)``: the part of every min_rate that the beams meet; 1 where the floors are met.
    iterations
        ``(T,)``.
    """

    beams: ComplexArray
    objective: Array
    converged: BoolArray
    floors_infeasible: BoolArray
    floor_factor: Array
    iterations: IntArray


def solve_batch(batch: ProblemBatch) -> DirectResult:
    """Solve problem (38) for every trial of a batch, by beams of rank one.

    Parameters
    ----------
    batch
        T trials with up to K objects. A trial's answer does not depend on the others but for
        rounding.
    """
    n_trials, n_objects = batch.active.shape
    result = DirectResult(
        beams=np.zeros((n_trials, n_objects, batch.n_tx), dtype=complex),
        objective=np.zeros(n_trials),
        converged=np.ones(n_trials, dtype=bool),
        floors_infeasible=np.zeros(n_trials, dtype=bool),
        floor_factor=np.ones(n_trials),
        iterations=np.zeros(n_trials, dtype=np.int64),
    )
    for which, objects, nodes in _groups(batch):
        step = max(1, CHUNK // objects.shape[1])
        for begin in range(0, which.size, step):
            part = slice(begin, begin + step)
            _solve_alike(batch, which[part], objects[part], nodes, result)
    return result


def _groups(batch: ProblemBatch) -> Iterator[tuple[IntArray, IntArray, int]]:
    """Give trials with equally many objects and nodes: their indices, their objects, the nodes."""
    phases, _ = cover_phases(
        np.where(batch.active, batch.angles, 0.0),
        np.where(batch.active, batch.coverage_halfwidths, 0.0),
        batch.resolution,
        batch.spacing,
        batch.axis,
    )
    width = np.max(phases, axis=-1, initial=-np.inf) - np.min(phases, axis=-1, initial=np.inf)
    lobes = np.where(batch.active, width, 0.0) * batch.n_tx / (2.0 * np.pi)
    nodes = node_count(np.max(lobes, axis=1, initial=0.0))
    counts = np.sum(batch.active, axis=1)
    for count, node in sorted(set(zip(counts.tolist(), nodes.tolist(), strict=True))):
        if count:
            which = np.flatnonzero((counts == count) & (nodes == node))
            yield which, np.nonzero(batch.active[which])[1].reshape(-1, count), node


def _solve_alike(
    batch: ProblemBatch, which: IntArray, objects: IntArray, nodes: int, result: DirectResult
) -> None:
    """Solve trials of one group and write what was found."""
    angles, distances, halfwidths = (
        np.take_along_axis(array[which], objects, axis=1)
        for array in (batch.angles, batch.distances, batch.coverage_halfwidths)
    )
    phases, mask = cover_phases(angles, halfwidths, batch.resolution, batch.spacing, batch.axis)
    beams = beam_set(phases, mask, batch.n_tx, batch.ripple[objects], nodes)
    loss = channel_loss(distances, batch.noise, batch.alpha0) / (batch.n_tx * batch.power)
    threshold = np.expm1(batch.min_rate[objects] * np.log(2.0))
    warm = None
    if batch.warm_start is not None:
        warm = batch.warm_start[which[:, np.newaxis], objects].reshape(-1, batch.n_tx)
    trials = Trials(beams=beams, loss=loss, threshold=threshold)
    found = climb(trials, CHIRPS[0], warm)
    for chirp in CHIRPS[1:]:
        again = np.flatnonzero(~found.converged)
        if not again.size:
            break
        found.put(again, climb(trials.taken(again), chirp))
    cold = np.arange(which.size)
    if warm is not None:
        given = np.isfinite(warm).reshape(*objects.shape, -1)
        cold = np.flatnonzero(~np.all(given, axis=(1, 2)))
    settle(trials, found, cold, CHIRPS[0], CHUNK)
    scale = np.sqrt(batch.power)
    result.beams[which[:, np.newaxis], objects] = found.beams * scale
    result.objective[which] = found.objective
    result.converged[which] = found.converged
    result.floor_factor[which] = found.factor
    result.floors_infeasible[which] = found.converged & (found.factor < 1.0)
    result.iterations[which] = found.iterations
