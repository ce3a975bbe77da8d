"""The trials of a `ProblemBatch`: which are alike, which make sense, which are small enough."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.checking import LEAST, MOST, fitting_directions, fitting_loss
from echobeam.beamforming.coverage import cover_points, has_cover
from echobeam.beamforming.direct import LEAST_ANTENNAS
from echobeam.beamforming.fast import LEAST_RIPPLE
from echobeam.beamforming.problem import ProblemBatch, only_active
from echobeam.values import BoolArray, IntArray

MOST_POINTS = 4000
"""Grid points of a cover up to which a trial is designed together with others: a batch has as many
for every trial as the widest cover takes."""


def distinct_trials(batch: ProblemBatch) -> tuple[IntArray, IntArray]:
    """Return the first trial of each distinct problem, and for every trial which of them it is."""
    known: dict[bytes, int] = {}
    first: list[int] = []
    same_as = np.zeros(len(batch), dtype=np.int64)
    for trial in range(len(batch)):
        key = _key(batch, trial)
        if key not in known:
            known[key] = len(first)
            first.append(trial)
        same_as[trial] = known[key]
    return np.array(first, dtype=np.int64), same_as


def _key(batch: ProblemBatch, trial: int) -> bytes:
    """Return what tells one trial's problem from another's."""
    active = batch.active[trial]
    parts = [active, *(a[trial, active] for a in (batch.angles, batch.loss))]
    parts.append(batch.coverage_halfwidths[trial, active])
    if batch.warm_start is not None:
        parts.append(batch.warm_start[trial, active])
    return b"".join(np.ascontiguousarray(part).tobytes() for part in parts)


def sound_trials(batch: ProblemBatch) -> BoolArray:
    """Return the trials that can be designed together: values and grids that the solver takes.

    The ranges are those of `BeamProblem`, which says in words what is wrong with the others.
    """
    numbers = {
        "power": batch.power,
        "spacing": batch.array.spacing,
        "resolution": batch.resolution,
    }
    fits = all(LEAST <= number <= MOST[name] for name, number in numbers.items())
    if not fits or batch.array.elements < LEAST_ANTENNAS:
        return np.zeros(len(batch), dtype=bool)
    covers = batch.coverage_halfwidths
    good = fitting_directions(batch.array, batch.angles, covers)
    good &= fitting_loss(batch.loss, batch.power)
    for name, each in (("ripple", batch.ripple), ("min_rate", batch.min_rate)):
        good &= (each == 0.0) | ((each >= LEAST) & (each <= MOST[name]))
    good &= (batch.ripple >= LEAST_RIPPLE) | ~has_cover(batch.array, covers)
    narrow = only_active(good, covers)
    good &= cover_points(batch.array, narrow, batch.resolution) <= MOST_POINTS
    sound: BoolArray = np.all(good | ~batch.active, axis=-1)
    return sound
