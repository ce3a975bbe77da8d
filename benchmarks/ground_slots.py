"""Decision of each slot of the scenario `ground`, one and two polarisations:
``python benchmarks/ground_slots.py``. CPU ms of a single warm decision, and its gap: to the
bound that comes with it, and to that of branch and bound."""

from __future__ import annotations

import time

import numpy as np

import echobeam as eb
from echobeam.benchmarking.asked import Asked, asked_in

TRIALS = 8
REPEATS = 3
PROVED = 1e-6


def measured(slot: Asked, trial: int) -> tuple[float, float, float]:
    """Return CPU ms, best of some, and the gaps of one trial's decision to the two bounds."""
    problem = slot.batch.problem(trial)
    if slot.before is not None:
        problem = problem.replace(warm_start=slot.before[trial])
    best = np.inf
    for _ in range(REPEATS):
        begun = time.process_time()
        answer = eb.design_beams(problem)
        best = min(best, time.process_time() - begun)
    proved = eb.design_beams(problem, certify=True, gap=PROVED).upper_bound
    return 1e3 * best, answer.gap, proved / answer.objective - 1.0


def main() -> None:
    """Print a line for each slot: median and largest time, median and largest gaps."""
    print("polarisations  slot  widest half-axis  ms median, most  gap median, most  proved gap")
    for polarisations in (1, 2):
        scenario = eb.load_scenario("ground", {"array.polarisations": polarisations})
        for number, slot in enumerate(asked_in(scenario, TRIALS), start=2):
            found = np.array([measured(slot, trial) for trial in range(TRIALS)])
            widest = np.sqrt(np.linalg.eigvalsh(slot.batch.coverage_halfwidths).max())
            median, most = np.median(found, axis=0), found.max(axis=0)
            print(
                f"{polarisations:13}  {number:4}  {widest:16.3f}  {median[0]:7.2f} {most[0]:7.2f}"
                f"  {median[1]:8.2g} {most[1]:7.2g}  {median[2]:8.2g} {most[2]:7.2g}",
                flush=True,
            )


if __name__ == "__main__":
    main()
