"""What `posterior` costs, on one idle core: ``python benchmarks/posterior_costs.py``.

Microseconds of its tracker for each trial and object, by slot, and milliseconds of its decision for
each trial, both in blocks of 100 trials; then those of a decision for one trial alone.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any
from unittest import mock

import numpy as np

import echobeam as eb
from echobeam.schemes.ground import GroundTracker
from echobeam.schemes.posterior_beamer import PosteriorBeamer

TRIALS = 100

SETTINGS: tuple[tuple[str, str, dict[str, object]], ...] = (
    ("one object, 60 deg, 100 m", "paper-single", {}),
    (
        "one object, 75 deg, 140 m",
        "paper-single",
        {"objects.0.angle": "75 deg", "uav.height": "140 m"},
    ),
    ("two objects", "paper-multi", {"coverage.min_rate": 0}),
    ("two objects, floors", "paper-multi", {}),
    ("ground, three objects", "ground", {}),
)


def timed(method: Callable[..., Any], seconds: list[float]) -> Callable[..., Any]:
    """Return a method that writes down the CPU time of every call."""

    def call(*given: Any) -> Any:
        begun = time.process_time()
        answer = method(*given)
        seconds.append(time.process_time() - begun)
        return answer

    return call


def measured(scenario: eb.Scenario, trials: int) -> dict[str, np.ndarray]:
    """Return CPU seconds of each slot, by what was done."""
    seconds: dict[str, list[float]] = defaultdict(list)
    parts = [(GroundTracker, "predict"), (GroundTracker, "update"), (PosteriorBeamer, "beams")]
    patches = [
        mock.patch.object(owner, name, timed(getattr(owner, name), seconds[name]))
        for owner, name in parts
    ]
    for patch in patches:
        patch.start()
    eb.simulate(scenario, schemes=["posterior"], trials=trials, jobs=1)
    for patch in patches:
        patch.stop()
    return {name: np.array(each) for name, each in seconds.items()}


def main() -> None:
    """Print the three figures of each setting."""
    for label, name, changes in SETTINGS:
        scenario = eb.load_scenario(name, changes)
        measured(scenario, 1)
        block, alone = measured(scenario, TRIALS), measured(scenario, 1)
        tracker = (block["predict"] + block["update"]) / TRIALS / len(scenario.objects)
        decision, single = block["beams"][1:] / TRIALS, alone["beams"][1:]
        print(
            f"{label}: tracker, us: mean {1e6 * tracker.mean():.0f}, slots 1 to 10",
            *(f"{1e6 * each:.0f}" for each in tracker),
            f"| decision, ms: median {1e3 * np.median(decision):.2f}, "
            f"most {1e3 * decision.max():.2f}; alone {1e3 * np.median(single):.1f}, "
            f"{1e3 * single.max():.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
