"""Time per design of the direct solver, beside its objective against the relaxation's, and its
violation: ``python benchmarks/beam_design.py [trials]``."""

from __future__ import annotations

import sys
import time

import numpy as np

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.direct import solve_batch
from echobeam.beamforming.problem import ProblemBatch
from echobeam.physics.array import LinearArray

COMPARED = 3


def cases(trials: int) -> dict[str, ProblemBatch]:
    far = ([75.0, 135.0], [103.5, 141.4])
    return {
        "N=30 K=2 sigma 1, P_T 1": batch(trials, 30, *far, 3.0, 3.0, 1.0, 4e-4),
        "N=30 K=2 sigma 1, P_T 1e4": batch(trials, 30, *far, 3.0, 2.0, 1e4, 0.0),
        "N=30 K=2 sigma 3, P_T 1e4": batch(trials, 30, *far, 9.0, 2.0, 1e4, 0.0),
        "N=30 K=2 first slot, P_T 1": batch(trials, 30, *far, [16.0, 11.0], 3.0, 1.0, 3e-4),
        "N=30 K=1 sigma 1, P_T 1": batch(trials, 30, [60.0], [115.5], 3.0, 3.0, 1.0, 0.0),
    }


def batch(trials, n_tx, angles, distances, halfwidth, ripple, power, floor) -> ProblemBatch:
    rng = np.random.default_rng(0)
    shape = (trials, len(angles))
    return ProblemBatch(
        angles=np.radians(np.array(angles) + rng.standard_normal(shape)),
        loss=(np.array(distances) * (1.0 + 0.01 * rng.standard_normal(shape))) ** 2,
        coverage_halfwidths=np.radians(
            np.broadcast_to(halfwidth, shape) * (1.0 + 0.05 * rng.standard_normal(shape))
        ),
        active=np.ones(shape, dtype=bool),
        ripple=np.full(shape[1], ripple),
        min_rate=np.full(shape[1], floor),
        power=power,
        array=LinearArray(n_tx),
    )


def main() -> None:
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 256
    print(f"batch of {trials}; ms of CPU per design, best of 3")
    for name, problems in cases(trials).items():
        seconds = np.inf
        for _ in range(3):
            begun = time.process_time()
            result = solve_batch(problems)
            seconds = min(seconds, time.process_time() - begun)
        worst = max(violation(problems.problem(t), result.beams[t]).largest for t in range(trials))
        below = 0.0
        for trial in range(COMPARED):
            answer = design_beams(problems.problem(trial), method="sdp")
            below = max(below, 1.0 - result.objective[trial] / answer.objective)
        print(
            f"{name:28s} {1e3 * seconds / trials:7.3f} ms  converged {result.converged.mean():.3f}"
            f"  steps {result.iterations.mean():5.1f} (most {result.iterations.max()})"
            f"  violation {worst:.1e}  below the relaxation {below:.1e}"
        )


if __name__ == "__main__":
    main()
