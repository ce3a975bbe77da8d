"""The upper reference: the truth is known, and every slot is optimal for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.design import design_batch
from echobeam.schemes.base import Decision, View
from echobeam.schemes.coverage_design import problems_at
from echobeam.values import BoolArray, GaussianState, Measurement, Phase


@dataclass(frozen=True, slots=True)
class Genie:
    """Maximum sum rate at the true channel: no omnidirectional slot, no coverage, no floors."""

    name: str = "genie"

    @property
    def omniscient(self) -> bool:
        """Always: that is its point."""
        return True

    def phase(self, slot_in_frame: int) -> Phase:
        """Return "directional" always."""
        return "directional"

    def predict(self, view: View) -> GaussianState:
        """Return the truth, without doubt."""
        assert view.truth is not None
        assert view.present is not None
        zero = np.where(view.present[..., None, None], np.zeros((3, 3)), np.nan)
        return GaussianState(mean=view.truth, cov=zero, known=view.present)

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return the beams of largest sum rate, Eq. (38a) under (38b) alone."""
        problems = problems_at(
            prior.mean[..., 0],
            prior.mean[..., 1],
            np.zeros(prior.known.shape),
            prior.known,
            view.system,
            min_rate=0.0,
        )
        answer = design_batch(problems)
        return Decision(answer.beams, answer.fallback)

    def listens(self, view: View) -> BoolArray:
        """Return none: it need not listen."""
        return np.zeros_like(view.posterior.known)

    def update(self, prior: GaussianState, measurement: Measurement, view: View) -> GaussianState:
        """Return the prior, which is the truth."""
        return prior
