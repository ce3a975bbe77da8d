"""The direct solver: beams of one or two columns for problem (38), a whole batch in one call.

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

from echobeam.beamforming.coverage import cover_size
from echobeam.beamforming.direct.layout import Layout, layouts
from echobeam.beamforming.direct.subsets import search_subsets
from echobeam.beamforming.problem import ProblemBatch
from echobeam.physics.planar import AntennaArray
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

if TYPE_CHECKING:
    from echobeam.beamforming.direct.trials import CompiledTrials

RATES = (0.6, 1.0, 0.3)
"""Rates of the chirp of the first start and of those after failures."""

PAIRS = ((0.6, 0.6), (1.3, 1.7), (0.6, -1.7), (0.8, 1.7))
"""The same along the two axes of a planar array's cover; the starts after the first are for beams
that are not proved the best, too. In 201 problems, 25 of them unproved after the first start, no
other of 72 pairs led to better beams than these."""

LEAST_ANTENNAS = 2
"""One antenna has one pattern: there is no shape to look for."""

CHUNK, MOST_POINTS = 4096, 2e6
"""Beams, and points of all their grids, that are laid out at a time."""

MOST_WORK = 1e10
"""Multiplications (`step_work`) up to which other sets of objects are tried: about a second for ten
objects under covers of thirty lobes. With a fifth of it 5 of 13 problems, chosen because they are
hard, were worse, by up to 19 %. In work and not in time, so that an answer does not depend on how
busy the machine is."""

PROBED = 256
"""Beams that are probed at a time in the search over sets of objects."""


@dataclass(frozen=True, slots=True, eq=False)
class DirectResult:
    """What the direct solver found for T trials.

    Attributes
    ----------
    beams
        ``(T, K, n)``, sqrt(power); zero for inactive objects and where nothing was found.
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

    def trial(self, place: int, active: BoolArray) -> DirectResult:
        """Return one trial alone, with its active objects ``(K,)`` only."""
        part = slice(place, place + 1)
        return DirectResult(
            beams=self.beams[part][:, active],
            objective=self.objective[part],
            converged=self.converged[part],
            floors_infeasible=self.floors_infeasible[part],
            floor_factor=self.floor_factor[part],
            iterations=self.iterations[part],
        )


def solve_batch(batch: ProblemBatch) -> DirectResult:
    """Solve problem (38) for every trial of a batch, by beams of one column a polarisation.

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
        ``(T, K, n)`` beams to start from, NaN where there are none.
    power
        P_T.
    most_steps
        Steps of a trial that `MOST_WORK` pays for.
    """

    which: IntArray
    objects: IntArray
    trials: CompiledTrials
    warm: ComplexArray | None
    power: float
    most_steps: float


def _tasks(batch: ProblemBatch) -> Iterator[Task]:
    """Give trials with equally many objects and nodes."""
    counts = np.sum(batch.active, axis=1)
    points = cover_size(batch.array, batch.coverage_halfwidths[batch.active], batch.resolution)
    for count in sorted(set(counts.tolist()) - {0}):
        alike = np.flatnonzero(counts == count)
        step = max(1, int(min(CHUNK, MOST_POINTS / points) / count))
        for begin in range(0, alike.size, step):
            which = alike[begin : begin + step]
            objects = np.nonzero(batch.active[which])[1].reshape(-1, count)
            place = which[:, np.newaxis], objects
            covers = batch.coverage_halfwidths[place]
            parts = layouts(batch.array, batch.angles[place], covers, batch.resolution)
            for part, layout in parts:
                yield _task(batch, which[part], objects[part], layout)


def _task(batch: ProblemBatch, which: IntArray, objects: IntArray, layout: Layout) -> Task:
    from echobeam.beamforming.direct.trials import CompiledTrials

    place, elements = (which[:, np.newaxis], objects), batch.array.elements
    trials = CompiledTrials(
        layout=layout,
        ripple=batch.ripple[objects] / elements,
        loss=batch.loss[place] / (elements * batch.power),
        threshold=np.expm1(batch.min_rate[objects] * np.log(2.0)),
        array=batch.array,
    )
    warm = None if batch.warm_start is None else batch.warm_start[place]
    most_steps = MOST_WORK / layout.step_work(elements, batch.array.polarisations)
    return Task(which, objects, trials, warm, batch.power, most_steps)


def chirps(array: AntennaArray) -> list[Array]:
    """Return the rates ``(r, d)`` of the chirps of all starts, one for each column and axis.

    Two columns bend in different ways.
    """
    if array.axes == 1:
        return [np.full((1, 1), rate) for rate in RATES]
    columns = array.polarisations
    return [np.array([[first, second], [first, -second]][:columns]) for first, second in PAIRS]


def _solve(task: Task, result: DirectResult) -> None:
    """Solve trials from one start after the other and write what was found."""
    which, trials = task.which, task.trials
    starts = chirps(trials.array)
    found = trials.climb(starts[0], task.warm)
    steps = found.iterations.copy()
    given: BoolArray = np.zeros(which.size, dtype=bool)
    if task.warm is not None:
        given = np.asarray(np.isfinite(task.warm).any(axis=(1, 2)))
    for number, chirp in enumerate(starts):
        wanting = ~(found.proved if trials.may_stay_unproved else found.converged)
        again = np.flatnonzero(wanting & (given | (number > 0)))  # cold began with the first
        if not again.size:
            continue
        other = trials.taken(again).climb(chirp)
        steps[again] += other.iterations
        found.put(again, other)
    left: Array = np.asarray(task.most_steps - steps)
    search_subsets(trials, found, starts[0], PROBED, left)
    result.beams[which[:, np.newaxis], task.objects] = found.beams * np.sqrt(task.power)
    result.objective[which] = found.objective
    result.converged[which] = found.converged
    result.floor_factor[which] = found.factor
    result.floors_infeasible[which] = found.converged & (found.factor < 1.0)
    result.iterations[which] = found.iterations
