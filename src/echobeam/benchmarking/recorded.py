"""Problems from real runs: what the temporal scheme asked its solver for, slot by slot."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from echobeam.beamforming.problem import ProblemBatch
from echobeam.benchmarking.problems import CaseProblems
from echobeam.scenario.load import load_scenario
from echobeam.schemes.base import Decision, View
from echobeam.schemes.temporal import Temporal
from echobeam.simulation.blocks import world_of
from echobeam.simulation.loop import run_slots
from echobeam.simulation.motion import plan_motion
from echobeam.values import ComplexArray, GaussianState

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
class Watched(Temporal):
    """The temporal scheme, which notes what it asks for."""

    asked: list[Asked] = field(default_factory=list)

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return the temporal scheme's decision."""
        decision = super().beamform(prior, view)
        before: ComplexArray | None = None
        if view.slot_in_frame > FIRST:
            before = np.asarray(view.memory, dtype=complex)
        batch = self.problems(prior, view)
        self.asked.append(Asked(view.slot_in_frame, batch, before, decision.beams))
        return decision


@cache
def asked_in(scenario: str, n_trials: int = TRIALS) -> tuple[Asked, ...]:
    """Return what the temporal scheme asked for in a run of a built-in scenario."""
    loaded, trials = load_scenario(scenario), range(n_trials)
    scheme = Watched()
    for _ in run_slots(
        loaded, scheme, world_of(loaded, SEED, trials, plan_motion(loaded, SEED, trials))
    ):
        pass
    return tuple(scheme.asked)


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
        distances=np.concatenate([batch.distances for batch in batches]),
        coverage_halfwidths=np.concatenate([batch.coverage_halfwidths for batch in batches]),
        active=np.concatenate([batch.active for batch in batches]),
    )
    order = np.random.default_rng(SEED).permutation(len(joined))
    starts = [slot.before for slot in asked if slot.before is not None]
    warm = np.concatenate(starts)[order] if len(starts) == len(asked) else None
    return CaseProblems(joined.taken(order), warm_start=warm)
