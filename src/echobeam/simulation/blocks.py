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
from echobeam.schemes.base import Scheme, SchemeError
from echobeam.simulation.decisions import SECONDS
from echobeam.simulation.loop import SlotRecord, run_slots
from echobeam.simulation.motion import Motion, plan_motion
from echobeam.simulation.randomness import Stream, standard_normals
from echobeam.simulation.world import World

MOST_TRIALS = 128
MOST_BYTES = 64 * 2**20

SHARED = ("truth", "present")
PER_SCHEME = (
    "predicted",
    "predicted_cov",
    "estimated",
    "estimated_cov",
    "measured",
    "measured_var",
    "beam",
    "sinr",
    "rate",
    "radar_snr",
    "fallback",
)

Advance = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Block:
    """Results of some trials: arrays named as in the result file.

    Attributes
    ----------
    first
        Number of the block's first trial.
    arrays
        ``truth`` and ``present`` as ``(trial, slot, ...)``, the others as
        ``(scheme, trial, slot, ...)``; ``phase`` and the times of decisions (`SECONDS`) as
        ``(scheme, slot)``.
    """

    first: int
    arrays: dict[str, npt.NDArray[np.generic]]


def cut(scenario: Scenario, trials: int) -> list[range]:
    """Return the blocks of a run as ranges of trials, of nearly equal length."""
    per_trial = scenario.n_slots * max(scenario.n_objects, 1) * (16 * scenario.array.n_tx + 400)
    most = max(1, min(MOST_TRIALS, MOST_BYTES // per_trial))
    count = -(-trials // most)
    edges = [trials * index // count for index in range(count + 1)]
    return [range(first, end) for first, end in pairwise(edges)]


def world_of(scenario: Scenario, seed: int, trials: Sequence[int], motion: Motion) -> World:
    """Return nature for some trials: their truth and their luck."""
    shape = (*motion.present.shape, 3)
    return World(scenario, motion, standard_normals(seed, trials, Stream.MEASUREMENT, shape))


def run_block(
    scenario: Scenario,
    schemes: Sequence[Scheme],
    seed: int,
    trials: range,
    advance: Advance = lambda slots: None,
) -> Block:
    """Run some trials of a scenario with every scheme, on the same truth and luck.

    Parameters
    ----------
    advance
        Called with the number of trial-slots done since the last call.
    """
    motion = plan_motion(scenario, seed, trials)
    world = world_of(scenario, seed, trials, motion)
    runs = [_run_scheme(scenario, scheme, world, advance) for scheme in schemes]
    arrays: dict[str, npt.NDArray[np.generic]] = {
        name: np.stack([run[name] for run in runs]) for name in (*PER_SCHEME, "phase", SECONDS)
    }
    slots = range(scenario.n_slots)
    arrays["truth"] = np.stack([world.truth(slot) for slot in slots], axis=1)
    arrays["present"] = np.stack([world.present(slot) for slot in slots], axis=1)
    return Block(trials.start, arrays)


def _run_scheme(
    scenario: Scenario, scheme: Scheme, world: World, advance: Advance
) -> dict[str, npt.NDArray[np.generic]]:
    records: list[SlotRecord] = []
    for record in run_slots(scenario, scheme, world):
        records.append(record)
        advance(world.luck.shape[0])
    arrays = {
        name: np.stack([getattr(record, name) for record in records], axis=1) for name in PER_SCHEME
    }
    beam = arrays["beam"]
    arrays["beam"] = np.stack([beam.real, beam.imag], axis=-1)
    arrays["phase"] = np.array([record.phase for record in records])
    arrays[SECONDS] = np.array([record.decision_seconds for record in records])
    return arrays


def check_names(schemes: Sequence[Scheme]) -> None:
    """Refuse two schemes of the same name: results are told apart by it.

    Raises
    ------
    SchemeError
        Names the doubled scheme.
    """
    names = [scheme.name for scheme in schemes]
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise SchemeError(f"scheme {doubled[0]!r} is asked for twice; give each one once")
    if not names:
        raise SchemeError("no scheme is asked for; give at least one")
