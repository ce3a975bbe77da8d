"""Problems made for timing, the same ones on every machine: a seed, a formula, no simulation."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from echobeam.beamforming.design import design_batch
from echobeam.beamforming.problem import ProblemBatch
from echobeam.physics.array import LinearArray
from echobeam.values import Array, ComplexArray, IntArray

BATCH = 256
"""Problems of a case: the batch that a block of trials makes."""

HEIGHT = 100.0
"""m: of the array above the road."""

ROAD = 200.0
"""m: objects stand up to here on both sides, uniformly."""

WIDTH = 3.0
"""l of (38f): half-width of the coverage in standard deviations."""

RIPPLE = 0.1
"""B_k relative to n_tx."""

POWER = 1e4
"""P_T with noise 1: beams disturb each other, which at the paper's power they hardly do."""

STEP = 0.3
"""m: what an object of 30 m/s moves along the road in a slot of 10 ms."""

PREPARED_TOGETHER = 16
"""Problems of the slot before that are designed in one call."""

DEGREES_APART = (3.0, 6.0)
"""Least and largest angle between neighbours in the hard cases."""


@dataclass(frozen=True, slots=True, eq=False)
class CaseProblems:
    """The problems of a case and what a warm start may know.

    Attributes
    ----------
    batch
        T problems without a warm start.
    warm_start
        ``(W, K, n_tx)``: the beams of the slot before for the first W problems.
    before
        The same objects' problems one slot earlier, where beams are yet to be designed for them.
    """

    batch: ProblemBatch
    warm_start: ComplexArray | None = None
    before: ProblemBatch | None = None

    @property
    def has_warm_start(self) -> bool:
        """Whether there is a slot before."""
        return self.warm_start is not None or self.before is not None

    def with_warm_start(self, seconds: float) -> CaseProblems:
        """Return the same problems with the slot before designed for as many as time allows."""
        if self.before is None:
            return self
        beams: list[ComplexArray] = []
        begun = time.perf_counter()
        for first in range(0, len(self.before), PREPARED_TOGETHER):
            part = np.arange(first, min(first + PREPARED_TOGETHER, len(self.before)))
            beams.append(design_batch(self.before.taken(part)).beams)
            if time.perf_counter() - begun > seconds:
                break
        return replace(self, warm_start=np.concatenate(beams), before=None)

    def cold(self, trials: IntArray) -> ProblemBatch:
        """Return some of the problems, to be solved from nothing."""
        return self.batch.taken(trials)

    def warm(self, trials: IntArray) -> ProblemBatch:
        """Return some of the problems with the beams of the slot before."""
        assert self.warm_start is not None
        return replace(self.cold(trials), warm_start=self.warm_start[trials])


def on_the_road(n_tx: int, n_objects: int, sigma: float) -> CaseProblems:
    """Return problems with objects anywhere on the road; some of them close, some mirrored.

    Parameters
    ----------
    n_tx, n_objects
        N and K.
    sigma
        Degrees: sigma_theta of every object; the coverage is 3 of it to both sides.
    """
    rng = np.random.default_rng([n_tx, n_objects])
    road = rng.uniform(-ROAD, ROAD, size=(BATCH, n_objects))
    step = STEP * rng.choice([-1.0, 1.0], size=road.shape)
    return CaseProblems(
        _above_the_road(road, n_tx, sigma), before=_above_the_road(road - step, n_tx, sigma)
    )


def close_together(n_tx: int, n_objects: int, sigma: float) -> CaseProblems:
    """Return problems whose objects stand 3 to 6 degrees apart, right of the array.

    There sine and angle grow together, so that neighbours are the only ones that are hard to tell
    apart. Parameters as in `on_the_road`.
    """
    rng = np.random.default_rng([n_tx, n_objects, 1])
    apart = rng.uniform(*DEGREES_APART, size=(BATCH, n_objects))
    first = rng.uniform(30.0, 50.0, size=(BATCH, 1))
    road = HEIGHT / np.tan(np.radians(first + np.cumsum(apart, axis=1) - apart[:, :1]))
    step = STEP * rng.choice([-1.0, 1.0], size=(BATCH, 1))
    return CaseProblems(
        _above_the_road(road, n_tx, sigma), before=_above_the_road(road - step, n_tx, sigma)
    )


def test_point() -> CaseProblems:
    """Return the one problem that older figures are about: N = 30, 75 and 135 degrees, +-3."""
    road = HEIGHT / np.tan(np.radians([[75.0, 135.0]]))
    step = np.array([[STEP, -STEP]])
    return CaseProblems(
        replace(_above_the_road(road, 30, 1.0), ripple=np.full(2, 2.0)),
        before=replace(_above_the_road(road - step, 30, 1.0), ripple=np.full(2, 2.0)),
    )


def _above_the_road(road: Array, n_tx: int, sigma: float) -> ProblemBatch:
    """Return the problems of objects at ``(T, K)`` m along the road, without floors."""
    n_objects = road.shape[1]
    return ProblemBatch(
        angles=np.arctan2(HEIGHT, road),
        loss=np.hypot(HEIGHT, road) ** 2,
        coverage_halfwidths=np.full(road.shape, WIDTH * np.radians(sigma)),
        active=np.ones(road.shape, dtype=bool),
        ripple=np.full(n_objects, RIPPLE * n_tx),
        min_rate=np.zeros(n_objects),
        power=POWER,
        array=LinearArray(n_tx),
    )
