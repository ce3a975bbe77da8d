"""The paper's proposed scheme: track by echoes, predict, and design beams that cover the doubt."""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.beamforming.design import design_batch
from echobeam.beamforming.problem import ProblemBatch
from echobeam.schemes.base import Decision, View
from echobeam.schemes.coverage_design import problems_for
from echobeam.schemes.frame import TrackingFrame
from echobeam.values import ComplexArray, GaussianState

COLD_EVERY = 8
"""Slots after which the beams are sought anew: what starts from the last slot's beams may stay on a
branch that has become the worse one while the uncertainty changed."""


@dataclass(frozen=True, slots=True)
class Temporal(TrackingFrame):
    """Problem (38) at the predicted state in every directional slot."""

    name: str = "temporal"

    def problems(self, prior: GaussianState, view: View) -> ProblemBatch:
        """Return what is designed, mostly started from the last slot's beams."""
        directional = view.slot_in_frame - 2  # The frame's first slot is omnidirectional.
        last = view.memory if directional % COLD_EVERY else None
        warm: ComplexArray | None = last  # type: ignore[assignment]
        return problems_for(prior, view, warm)

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return the optimised beams."""
        answer = design_batch(self.problems(prior, view))
        return Decision(answer.beams, answer.fallback, memory=answer.beams)
