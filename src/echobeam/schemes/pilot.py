"""The paper's first baseline: a pilot slot, then beams from that one estimate.

The paper does not define it further. Read here: the first slot of a frame is an omnidirectional
pilot without data, measured as well as the proposed scheme's omnidirectional slot; the beams of
the frame's other slots come from that estimate alone, since there is no radar in them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.design import design_batch
from echobeam.schemes import frame
from echobeam.schemes.base import Decision, View
from echobeam.schemes.coverage_design import problems_for
from echobeam.schemes.matched import matched_beams
from echobeam.values import BoolArray, GaussianState, Measurement, Phase


@dataclass(frozen=True, slots=True)
class Pilot:
    """One coverage beam per object from the pilot's estimate, held for the frame."""

    name: str = "pilot"

    @property
    def omniscient(self) -> bool:
        """Never: it sees what its pilot gives."""
        return False

    def phase(self, slot_in_frame: int) -> Phase:
        """Return "pilot" for a frame's first slot, "directional" for the others."""
        return "pilot" if slot_in_frame == 1 else "directional"

    def predict(self, view: View) -> GaussianState:
        """Return no prediction: this scheme makes none."""
        held = view.posterior
        return GaussianState(
            mean=np.full_like(held.mean, np.nan),
            cov=np.full_like(held.cov, np.nan),
            known=np.zeros_like(held.known),
        )

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return the beams designed in the frame's second slot."""
        if view.slot_in_frame == 2:
            return self._first_beams(view)
        held = view.memory
        assert isinstance(held, Decision)
        beams = np.where(view.posterior.known[..., None], held.beams, 0.0)
        return Decision(beams, held.fallback, memory=held)

    def _first_beams(self, view: View) -> Decision:
        answer = design_batch(problems_for(view.posterior, view))
        decision = Decision(answer.beams, answer.fallback)
        return Decision(answer.beams, answer.fallback, memory=decision)

    def listens(self, view: View) -> BoolArray:
        """Return all objects in the pilot slot, none after it."""
        known = view.posterior.known
        return np.full_like(known, view.phase == "pilot")

    def update(self, prior: GaussianState, measurement: Measurement, view: View) -> GaussianState:
        """Return the pilot's estimate, anew in every frame and held in between."""
        if view.phase != "pilot":
            return view.posterior
        fresh = frame.first_state(measurement, view)
        return frame.choose(fresh.known, fresh, view.posterior)


@dataclass(frozen=True, slots=True)
class PilotNeedle(Pilot):
    """Matched beams to the pilot's estimate, held for the frame."""

    name: str = "pilot-needle"

    def _first_beams(self, view: View) -> Decision:
        state = view.posterior
        beams = matched_beams(state.mean[..., 0], state.mean[..., 1], state.known, view.system)
        decision = Decision(beams, np.zeros(beams.shape[:-2], dtype=bool))
        return Decision(decision.beams, decision.fallback, memory=decision)


@dataclass(frozen=True, slots=True)
class PilotPredict(Pilot):
    """Dead reckoning: the pilot's estimate is predicted on, and the coverage follows it."""

    name: str = "pilot-predict"

    def predict(self, view: View) -> GaussianState:
        """Return the prediction from the last state, without any new measurement."""
        return frame.predict(view)

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return a coverage beam around each dead-reckoned angle."""
        answer = design_batch(problems_for(prior, view))
        return Decision(answer.beams, answer.fallback)

    def update(self, prior: GaussianState, measurement: Measurement, view: View) -> GaussianState:
        """Return the pilot's estimate in its slot, the prediction in the others."""
        if view.phase != "pilot":
            return prior
        fresh = frame.first_state(measurement, view)
        return frame.choose(fresh.known, fresh, prior)
