"""The paper's proposed scheme: track by echoes, predict, and design beams that cover the doubt."""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.schemes.base import Decision, View
from echobeam.schemes.coverage_design import design_for
from echobeam.schemes.frame import TrackingFrame
from echobeam.values import ComplexArray, GaussianState


@dataclass(frozen=True, slots=True)
class Temporal(TrackingFrame):
    """Problem (38) at the predicted state in every directional slot."""

    name: str = "temporal"

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return the optimised beams, started from the last slot's."""
        last = view.memory if view.slot_in_frame > 2 else None
        warm: ComplexArray | None = last  # type: ignore[assignment]
        answer = design_for(prior, view, warm)
        return Decision(answer.beams, answer.fallback, memory=answer.beams)
