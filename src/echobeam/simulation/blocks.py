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
from echobeam.schemes.base import SchemeRunError
from echobeam.schemes.configure import ConfiguredScheme
from echobeam.sensing.threads import one_thread
from echobeam.simulation.decisions import SECONDS
from echobeam.simulation.loop import SlotRecord, run_slots
from echobeam.simulation.scene import Scene
from echobeam.simulation.world import World, begin
from echobeam.values import NOBODY

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

PER_TRACK = ("track_id", "track_status", "track_object", "track_state")
"""Arrays ``(scheme, trial, slot, track, ...)`` of unlabelled runs."""

EMPTY = dict(zip(PER_TRACK, (NOBODY, 0, NOBODY, np.nan), strict=True))
"""Values of these arrays in a column without a track."""

UNLABELLED = ("shared", *PER_TRACK)
"""Arrays that only unlabelled runs have."""

Advance = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Block:
    """Results of some trials: arrays named as in the result file.

    Attributes
    ----------
    first
        Number of the block's first trial.
    arrays
        `FIXED`, `SHARED` and those of `per_scheme`, and the times of decisions (`SECONDS`) as
        ``(scheme, slot)``.
    """

    first: int
    arrays: dict[str, npt.NDArray[np.generic]]


def per_scheme(scenario: Scenario) -> tuple[str, ...]:
    """Return the arrays ``(scheme, trial, slot, ...)`` of a scenario's run."""
    of_all: tuple[str, ...] = PER_SCHEME
    if scenario.geometry == "ground":
        of_all = tuple("cover" if name == "covered" else name for name in of_all)
    return (*of_all, *UNLABELLED) if scenario.unlabelled else of_all


def trial_axis(name: str) -> int | None:
    """Return which axis of a block's array counts trials; None if none does."""
    if name in SHARED:
        return 0
    return 1 if name in (*PER_SCHEME, "cover", *UNLABELLED) else None


def cut(scenario: Scenario, trials: int) -> list[range]:
    """Return the blocks of a run as ranges of trials, of nearly equal length."""
    per_trial = scenario.n_slots * max(scenario.n_objects, 1) * (16 * scenario.array.weights + 400)
    if scenario.unlabelled:
        per_trial += scenario.n_slots * scenario.tracks.capacity * 48
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
    unlabelled = scene.scenario.unlabelled
    names = per_scheme(scene.scenario)
    with one_thread():  # the arrays are small, and processes share the cores
        runs = [_run_scheme(world, scheme, names, advance) for scheme in schemes]
    if unlabelled:
        columns = track_columns(scene.scenario, schemes)
        runs = [_in_columns(run, columns, one.name) for run, one in zip(runs, schemes, strict=True)]
    arrays: dict[str, npt.NDArray[np.generic]] = {
        name: np.stack([run[name] for run in runs]) for name in (*names, SECONDS)
    }
    arrays |= {name: runs[0][name] for name in (*FIXED, *SHARED)}
    return Block(trials.start, arrays)


def track_columns(scenario: Scenario, schemes: Sequence[ConfiguredScheme]) -> int:
    """Return the number of tracks that a result has columns for: the largest capacity.

    A scheme that sees the truth has a track for each object, whatever the capacity of others.
    """
    seen = [scenario.n_objects for one in schemes if one.scheme.omniscient]
    capacities = [one.system.tracks.capacity for one in schemes]
    return max([scenario.tracks.capacity, *capacities, *seen])


def _in_columns(
    run: dict[str, npt.NDArray[np.generic]], columns: int, name: str
) -> dict[str, npt.NDArray[np.generic]]:
    """Return a run whose tracks have a number of columns, the rest empty.

    Raises
    ------
    SchemeRunError
        If a scheme of a user's has tracks in more columns than that.
    """
    used = int(np.flatnonzero((run["track_id"] != NOBODY).any(axis=(0, 1))).max(initial=-1)) + 1
    if used > columns:
        raise SchemeRunError(
            f"scheme {name!r} has tracks in {used} columns; expected at most tracks.capacity, "
            f"{columns}"
        )
    wider = dict(run)
    for key, empty in EMPTY.items():
        wider[key] = _widened(run[key][:, :, :columns], 2, columns, empty)
    return wider


def _widened(
    values: npt.NDArray[np.generic], axis: int, columns: int, empty: float
) -> npt.NDArray[np.generic]:
    """Return values with more columns of tracks along an axis, which are empty."""
    missing = columns - values.shape[axis]
    if missing == 0:
        return values
    shape = (*values.shape[:axis], missing, *values.shape[axis + 1 :])
    return np.concatenate([values, np.full(shape, empty, dtype=values.dtype)], axis=axis)


def _run_scheme(
    world: World, scheme: ConfiguredScheme, names: Sequence[str], advance: Advance
) -> dict[str, npt.NDArray[np.generic]]:
    records: list[SlotRecord] = []
    for record in run_slots(world, scheme):
        records.append(record)
        advance(len(world.trials))
    tracks = [record.track_id for record in records]
    # A scheme of a user's may have more tracks in one slot than in another.
    columns = max((each.shape[-1] for each in tracks if each is not None), default=0)

    def of_slot(record: SlotRecord, name: str) -> npt.NDArray[np.generic]:
        values: npt.NDArray[np.generic] = getattr(record, name)
        return _widened(values, 1, columns, EMPTY[name]) if name in EMPTY else values

    arrays: dict[str, npt.NDArray[np.generic]] = {
        name: np.stack([of_slot(record, name) for record in records], axis=1)
        for name in (*SHARED, *names)
    }
    for name in FIXED:
        arrays[name] = np.stack([getattr(record, name) for record in records])
    beam = arrays["beam"]
    arrays["beam"] = np.stack([beam.real, beam.imag], axis=-1)
    arrays[SECONDS] = np.array([record.decision_seconds for record in records])
    return arrays
