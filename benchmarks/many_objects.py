"""Time of the compiled direct solver over N and K, objects spread over the road, sigma 1 degree:
``python benchmarks/many_objects.py``. CPU ms per design, best of 5, cold and from the beams
themselves, and the largest violation on the full grid."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.direct.batch import DirectResult, solve_batch
from echobeam.beamforming.problem import ProblemBatch
from echobeam.physics.array import LinearArray

SIZES = ((30, 2), (64, 2), (64, 4), (64, 8), (64, 16), (128, 8))
TRIALS, REPEATS = 8, 5


def spread(n_tx: int, count: int, power: float) -> ProblemBatch:
    """Return trials whose objects lie at even steps of the sine, on either side in turn."""
    rng = np.random.default_rng(0)
    angles = np.arcsin(np.linspace(0.15, 0.97, count))
    angles = np.where(np.arange(count) % 2, np.pi - angles, angles)
    shape = (TRIALS, count)
    return ProblemBatch(
        angles=angles + np.radians(0.3) * rng.standard_normal(shape),
        loss=rng.uniform(100.0, 180.0, shape) ** 2,
        coverage_halfwidths=np.full(shape, np.radians(3.0)),
        active=np.ones(shape, dtype=bool),
        ripple=np.full(count, 3.0),
        min_rate=np.zeros(count),
        power=power,
        array=LinearArray(n_tx),
    )


def timed(batch: ProblemBatch) -> tuple[float, DirectResult]:
    seconds = np.inf
    for _ in range(REPEATS):
        begun = time.process_time()
        result = solve_batch(batch)
        seconds = min(seconds, time.process_time() - begun)
    return 1e3 * seconds / len(batch), result


def main() -> None:
    print("P_T      N    K     cold     warm  converged  violation")
    for power in (1.0, 1e3):
        for n_tx, count in SIZES:
            batch = spread(n_tx, count, power)
            cold, result = timed(batch)
            warm, again = timed(replace(batch, warm_start=result.beams))
            missed = max(
                violation(batch.problem(trial), again.beams[trial]).largest
                for trial in np.flatnonzero(again.converged)
            )
            print(
                f"{power:<6g} {n_tx:3d} {count:4d} {cold:8.2f} {warm:8.2f}"
                f"  {again.converged.mean():9.3f}  {missed:9.1e}"
            )


if __name__ == "__main__":
    main()
