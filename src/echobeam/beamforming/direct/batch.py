"""The direct solver: rank-one beams for problem (38), a whole batch of trials in one call.

A trial's beams are found in the dual uplink (`uplink`), where their shapes separate; the shapes
of all beams of all trials take their Newton steps together (`barrier`), with the powers improved
in between. The first rounds impose a few points of each cover, later ones whatever the full grid
shows to be missed (`cuts`). What does not converge starts again from another chirp; what still
does not says so. Where Numba is installed, the trials are solved one after the other by the same
steps, compiled (`compiled`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec

import numpy as np

from echobeam.beamforming.direct.beams import beam_set, cover_phases, node_count
from echobeam.beamforming.direct.chirp import CHIRPS
from echobeam.beamforming.direct.climb import Climber, Trials
from echobeam.beamforming.direct.contest import settle
from echobeam.beamforming.problem import ProblemBatch
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

CHUNK = 256
"""Beams that NumPy works on at a time: what fits the cache."""

NODES_CHUNK = 16384
"""Beams whose covers are compared at a time."""

COMPILED_CHUNK = 4096
"""Beams whose grids are laid out at a time."""


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


def solve_batch(batch: ProblemBatch, compiled: bool | None = None) -> DirectResult:
    """Solve problem (38) for every trial of a batch, by beams of rank one.

    Parameters
    ----------
    batch
        T trials with up to K objects. A trial's answer does not depend on the others but for
        rounding.
    compiled
        Solve trial by trial with compiled code, or all trials together with NumPy; by default the
        former where Numba is installed. The algorithm is the same.
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
    if compiled is None:
        compiled = can_compile()
    # With one antenna there is no shape to look for.
    for task in _tasks(batch, compiled and batch.n_tx > 1):
        _solve(task, result)
    return result


@cache
def can_compile() -> bool:
    """Tell whether Numba is installed."""
    return find_spec("numba") is not None


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Trials that are solved in one go.

    Attributes
    ----------
    which
        ``(T,)``: their indices in the batch.
    objects
        ``(T, K)``: their active objects.
    trials
        What is to be solved.
    warm
        ``(T, K, N)`` beams to start from, NaN where there are none.
    power
        P_T.
    """

    which: IntArray
    objects: IntArray
    trials: Climber
    warm: ComplexArray | None
    power: float


def _tasks(batch: ProblemBatch, compiled: bool) -> Iterator[Task]:
    """Give trials with equally many objects, and for NumPy with equally many nodes."""
    counts = np.sum(batch.active, axis=1)
    for count in sorted(set(counts.tolist()) - {0}):
        alike = np.flatnonzero(counts == count)
        step = max(1, (COMPILED_CHUNK if compiled else NODES_CHUNK) // count)
        for begin in range(0, alike.size, step):
            which = alike[begin : begin + step]
            objects = np.nonzero(batch.active[which])[1].reshape(-1, count)
            if compiled:
                yield _compiled_task(batch, which, objects)
            else:
                yield from _numpy_tasks(batch, which, objects)


def _compiled_task(batch: ProblemBatch, which: IntArray, objects: IntArray) -> Task:
    from echobeam.beamforming.direct.compiled.trials import CompiledTrials

    phases, mask = _phases(batch, which, objects)
    trials = CompiledTrials(
        phases=phases,
        reach=np.sum(mask, axis=-1) // 2,
        ripple=batch.ripple[objects] / batch.n_tx,
        loss=_loss(batch, which, objects),
        threshold=_threshold(batch, objects),
        n_tx=batch.n_tx,
    )
    return Task(which, objects, trials, _warm(batch, which, objects), batch.power)


def _numpy_tasks(batch: ProblemBatch, which: IntArray, objects: IntArray) -> Iterator[Task]:
    phases, _ = _phases(batch, which, objects)
    width = np.max(phases, axis=-1) - np.min(phases, axis=-1)
    nodes = node_count(np.max(width, axis=1) * batch.n_tx / (2.0 * np.pi))
    step = max(1, CHUNK // objects.shape[1])
    for count in sorted(set(nodes.tolist())):
        same = np.flatnonzero(nodes == count)
        for begin in range(0, same.size, step):
            part = same[begin : begin + step]
            yield _numpy_task(batch, which[part], objects[part], count)


def _numpy_task(batch: ProblemBatch, which: IntArray, objects: IntArray, nodes: int) -> Task:
    phases, mask = _phases(batch, which, objects)
    trials = Trials(
        beams=beam_set(phases, mask, batch.n_tx, batch.ripple[objects], nodes),
        loss=_loss(batch, which, objects),
        threshold=_threshold(batch, objects),
    )
    return Task(which, objects, trials, _warm(batch, which, objects), batch.power)


def _phases(batch: ProblemBatch, which: IntArray, objects: IntArray) -> tuple[Array, BoolArray]:
    place = which[:, np.newaxis], objects
    angles, halfwidths = batch.angles[place], batch.coverage_halfwidths[place]
    return cover_phases(angles, halfwidths, batch.resolution, batch.array)


def _loss(batch: ProblemBatch, which: IntArray, objects: IntArray) -> Array:
    loss: Array = batch.loss[which[:, np.newaxis], objects] / (batch.n_tx * batch.power)
    return loss


def _threshold(batch: ProblemBatch, objects: IntArray) -> Array:
    threshold: Array = np.expm1(batch.min_rate[objects] * np.log(2.0))
    return threshold


def _warm(batch: ProblemBatch, which: IntArray, objects: IntArray) -> ComplexArray | None:
    if batch.warm_start is None:
        return None
    return batch.warm_start[which[:, np.newaxis], objects]


def _solve(task: Task, result: DirectResult) -> None:
    """Solve trials from one start after the other and write what was found."""
    which, trials = task.which, task.trials
    warm = None if task.warm is None else task.warm.reshape(-1, task.warm.shape[-1])
    found = trials.climb(CHIRPS[0], warm)
    for chirp in CHIRPS[1:]:
        again = np.flatnonzero(~found.converged)
        if not again.size:
            break
        found.put(again, trials.taken(again).climb(chirp))
    cold = np.arange(which.size)
    if task.warm is not None:
        cold = np.flatnonzero(~np.all(np.isfinite(task.warm), axis=(1, 2)))
    settle(trials, found, cold, CHIRPS[0], CHUNK)
    result.beams[which[:, np.newaxis], task.objects] = found.beams * np.sqrt(task.power)
    result.objective[which] = found.objective
    result.converged[which] = found.converged
    result.floor_factor[which] = found.factor
    result.floors_infeasible[which] = found.converged & (found.factor < 1.0)
    result.iterations[which] = found.iterations
