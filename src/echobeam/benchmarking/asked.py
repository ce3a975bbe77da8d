"""Problems from real runs: what the temporal scheme asked its solver for, slot by slot."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from echobeam.beamforming.problem import ProblemBatch
from echobeam.benchmarking.problems import CaseProblems
from echobeam.scenario.load import Source, load_scenario
from echobeam.schemes.base import View
from echobeam.schemes.beamers import Aim, Beams, CoverBeamer
from echobeam.schemes.configure import configure
from echobeam.schemes.temporal import TEMPORAL
from echobeam.simulation.loop import run_slots
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.values import ComplexArray

TRIALS = 32
SEED = 0

FIRST = 2
"""The slot of a frame after the omnidirectional one: the first with beams, and with wide cover."""


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """One slot of a block of trials: its problems and the beams that the scheme sent.

    Attributes
    ----------
    slot_in_frame
        Counted from 1.
    batch
        The problems, with the warm start that the scheme gave.
    before
        ``(T, K, n_tx)``: the beams of the slot before, None in a frame's first directional slot.
    beams
        ``(T, K, n_tx)``.
    """

    slot_in_frame: int
    batch: ProblemBatch
    before: ComplexArray | None
    beams: ComplexArray


@dataclass(frozen=True)
class Watched:
    """The beamer of the temporal scheme, which notes what it asks for."""

    beamer: CoverBeamer
    asked: list[Asked] = field(default_factory=list)

    def beams(self, aim: Aim, view: View) -> Beams:
        """Return the beamer's beams."""
        made = self.beamer.beams(aim, view)
        before: ComplexArray | None = None
        if view.slot_in_frame > FIRST:
            before = np.asarray(view.memory, dtype=complex)
        batch = self.beamer.problems(aim, view)
        self.asked.append(Asked(view.slot_in_frame, batch, before, made.beams))
        return made


@cache
def asked_in(scenario: Source, n_trials: int = TRIALS) -> tuple[Asked, ...]:
    """Return what the temporal scheme asked for in a run of a scenario."""
    loaded = load_scenario(scenario)
    watched = Watched(CoverBeamer())
    scheme = configure(loaded, replace(TEMPORAL, beamer=watched))
    for _ in run_slots(begin(scene_of(loaded), SEED, range(n_trials)), scheme):
        pass
    return tuple(watched.asked)


def first_slots(scenario: str) -> CaseProblems:
    """Return the problems of first slots after an omnidirectional one."""
    asked = [slot for slot in asked_in(scenario) if slot.slot_in_frame == FIRST]
    return _joined(asked)


def later_slots(scenario: str) -> CaseProblems:
    """Return the problems of all other slots, shuffled, with the beams of the slots before."""
    return _joined([slot for slot in asked_in(scenario) if slot.slot_in_frame > FIRST])


def _joined(asked: list[Asked]) -> CaseProblems:
    """Return several slots' problems as one batch; shuffled, so that any part stands for all."""
    batches = [slot.batch for slot in asked]
    joined = replace(
        batches[0],
        warm_start=None,
        angles=np.concatenate([batch.angles for batch in batches]),
        loss=np.concatenate([batch.loss for batch in batches]),
        coverage_halfwidths=np.concatenate([batch.coverage_halfwidths for batch in batches]),
        active=np.concatenate([batch.active for batch in batches]),
    )
    order = np.random.default_rng(SEED).permutation(len(joined))
    starts = [slot.before for slot in asked if slot.before is not None]
    warm = np.concatenate(starts)[order] if len(starts) == len(asked) else None
    return CaseProblems(joined.taken(order), warm_start=warm)
