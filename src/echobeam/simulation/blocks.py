"""A run cut into blocks of trials: the unit of work, of memory and of recovery.

Where the cuts are depends on the scenario and the number of trials alone, and a block's numbers
on its trials alone. So a result is the same bit for bit however blocks are spread over processes
or machines, in whatever order they are done.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import ConfiguredScheme
from echobeam.simulation.decisions import SECONDS
from echobeam.simulation.loop import SlotRecord, run_slots
from echobeam.simulation.scene import Scene
from echobeam.simulation.world import World, begin

MOST_TRIALS = 128
MOST_BYTES = 64 * 2**20

FIXED = ("uav_position", "uav_velocity")
"""Arrays ``(slot, ...)``, the same in every trial."""

SHARED = ("truth", "present", "identity", "position")
"""Arrays ``(trial, slot, ...)``, the same for every scheme."""

PER_SCHEME = (
    "mode",
    "covered",
    "predicted",
    "predicted_cov",
    "estimated",
    "estimated_cov",
    "measured",
    "measured_var",
    "true_var",
    "beam",
    "sinr",
    "rate",
    "radar_snr",
    "fallback",
)
"""Arrays ``(scheme, trial, slot, ...)``."""

Advance = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Block:
    """Results of some trials: arrays named as in the result file.

    Attributes
    ----------
    first
        Number of the block's first trial.
    arrays
        `FIXED`, `SHARED` and `PER_SCHEME`, and the times of decisions (`SECONDS`) as
        ``(scheme, slot)``.
    """

    first: int
    arrays: dict[str, npt.NDArray[np.generic]]


def trial_axis(name: str) -> int | None:
    """Return which axis of a block's array counts trials; None if none does."""
    if name in SHARED:
        return 0
    return 1 if name in PER_SCHEME else None


def cut(scenario: Scenario, trials: int) -> list[range]:
    """Return the blocks of a run as ranges of trials, of nearly equal length."""
    per_trial = scenario.n_slots * max(scenario.n_objects, 1) * (16 * scenario.array.n_tx + 400)
    most = max(1, min(MOST_TRIALS, MOST_BYTES // per_trial))
    count = -(-trials // most)
    edges = [trials * index // count for index in range(count + 1)]
    return [range(first, end) for first, end in pairwise(edges)]


def run_block(
    scene: Scene,
    schemes: Sequence[ConfiguredScheme],
    seed: int,
    trials: range,
    advance: Advance = lambda slots: None,
) -> Block:
    """Run some trials of a scene with every scheme, on the same truth and luck.

    Parameters
    ----------
    advance
        Called with the number of trial-slots done since the last call.
    """
    world = begin(scene, seed, trials)
    runs = [_run_scheme(world, scheme, advance) for scheme in schemes]
    arrays: dict[str, npt.NDArray[np.generic]] = {
        name: np.stack([run[name] for run in runs]) for name in (*PER_SCHEME, SECONDS)
    }
    arrays |= {name: runs[0][name] for name in (*FIXED, *SHARED)}
    return Block(trials.start, arrays)


def _run_scheme(
    world: World, scheme: ConfiguredScheme, advance: Advance
) -> dict[str, npt.NDArray[np.generic]]:
    records: list[SlotRecord] = []
    for record in run_slots(world, scheme):
        records.append(record)
        advance(len(world.trials))
    arrays: dict[str, npt.NDArray[np.generic]] = {
        name: np.stack([getattr(record, name) for record in records], axis=1)
        for name in (*SHARED, *PER_SCHEME)
    }
    for name in FIXED:
        arrays[name] = np.stack([getattr(record, name) for record in records])
    beam = arrays["beam"]
    arrays["beam"] = np.stack([beam.real, beam.imag], axis=-1)
    arrays[SECONDS] = np.array([record.decision_seconds for record in records])
    return arrays
