"""The direct solver: rank-one beams for problem (38), a whole batch of trials in one call.

A trial's beams are found in the dual uplink (`powers`), where their shapes separate: each shape
takes its Newton steps (`step`), with the powers improved in between (`climb`). The first rounds
impose a few points of each cover, later ones those that violate it on the full grid (`grid`). A
trial that does not converge starts again from another chirp (`start`); one that still does not
says so. Where interference matters, other sets of objects to serve are tried (`subsets`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.direct.sizes import step_work
from echobeam.beamforming.direct.subsets import settle
from echobeam.beamforming.problem import ProblemBatch
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

if TYPE_CHECKING:
    from echobeam.beamforming.direct.trials import CompiledTrials

CHIRPS = (0.6, 1.0, 0.3)
"""Rates of the chirp of the first start and of those after failures."""

LEAST_ANTENNAS = 2
"""One antenna has one pattern: there is no shape to look for."""

CHUNK = 4096
"""Beams whose grids are laid out at a time."""

MOST_WORK = 6e9
"""Multiplications (`step_work`) up to which other sets of objects are tried: some four seconds, for
ten objects under covers of thirty lobes. With 4e8, half a second, 10 of 100 random problems of up
to 12 objects and 128 antennas were worse, by up to 18 %. In work and not in time, so that an answer
does not depend on how busy the machine is."""

PROBED = 256
"""Beams that are probed at a time in the search over sets of objects."""


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
        T trials with up to K objects. A trial's answer does not depend on the others. Those with
        objects and a single antenna are left, as not converged.
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
    if batch.n_tx < LEAST_ANTENNAS:
        result.converged[:] = ~batch.active.any(axis=1)
        return result
    for task in _tasks(batch):
        _solve(task, result)
    return result


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
    most_steps
        ``(T,)``: steps that `MOST_WORK` pays for.
    """

    which: IntArray
    objects: IntArray
    trials: CompiledTrials
    warm: ComplexArray | None
    power: float
    most_steps: Array


def _tasks(batch: ProblemBatch) -> Iterator[Task]:
    """Give trials with equally many objects."""
    counts = np.sum(batch.active, axis=1)
    for count in sorted(set(counts.tolist()) - {0}):
        alike = np.flatnonzero(counts == count)
        step = max(1, CHUNK // count)
        for begin in range(0, alike.size, step):
            which = alike[begin : begin + step]
            objects = np.nonzero(batch.active[which])[1].reshape(-1, count)
            yield _task(batch, which, objects)


def _task(batch: ProblemBatch, which: IntArray, objects: IntArray) -> Task:
    from echobeam.beamforming.direct.trials import CompiledTrials

    phases, mask = _phases(batch, which, objects)
    trials = CompiledTrials(
        phases=phases,
        reach=np.sum(mask, axis=-1) // 2,
        ripple=batch.ripple[objects] / batch.n_tx,
        loss=_loss(batch, which, objects),
        threshold=_threshold(batch, objects),
        n_tx=batch.n_tx,
    )
    width = np.max(phases, axis=-1) - np.min(phases, axis=-1)
    lobes = np.ceil(np.max(width, axis=1) * batch.n_tx / (2.0 * np.pi))
    each, place = np.unique(lobes, return_inverse=True)
    work = np.array([step_work(objects.shape[1], batch.n_tx, one) for one in each.tolist()])
    most_steps = MOST_WORK / work[place]
    return Task(which, objects, trials, _warm(batch, which, objects), batch.power, most_steps)


def _phases(batch: ProblemBatch, which: IntArray, objects: IntArray) -> tuple[Array, BoolArray]:
    place = which[:, np.newaxis], objects
    angles, halfwidths = batch.angles[place], batch.coverage_halfwidths[place]
    grid, mask = coverage_grid(angles, halfwidths, batch.resolution)
    return batch.array.phase(grid), mask


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
    steps = found.iterations.copy()
    given: BoolArray = np.zeros(which.size, dtype=bool)
    if task.warm is not None:
        given = np.asarray(np.isfinite(task.warm).any(axis=(1, 2)))
    for number, chirp in enumerate(CHIRPS):
        again = np.flatnonzero(
            ~found.converged & (given | (number > 0))
        )  # cold began with the first
        if not again.size:
            continue
        other = trials.taken(again).climb(chirp)
        steps[again] += other.iterations
        found.put(again, other)
    left: Array = np.asarray(task.most_steps - steps)
    settle(trials, found, CHIRPS[0], PROBED, left)
    result.beams[which[:, np.newaxis], task.objects] = found.beams * np.sqrt(task.power)
    result.objective[which] = found.objective
    result.converged[which] = found.converged
    result.floor_factor[which] = found.factor
    result.floors_infeasible[which] = found.converged & (found.factor < 1.0)
    result.iterations[which] = found.iterations
