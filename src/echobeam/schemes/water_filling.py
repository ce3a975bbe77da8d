"""The paper's second baseline: matched beams at the predicted angles, water-filling power."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.schemes.base import Decision, View
from echobeam.schemes.frame import TrackingFrame
from echobeam.schemes.matched import matched_beams
from echobeam.values import GaussianState


@dataclass(frozen=True, slots=True)
class WaterFilling(TrackingFrame):
    """Same frame and filter as the proposed scheme; the beams cover nothing."""

    name: str = "water-filling"

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return w_k = sqrt(p_k / N_t) a(theta_k) at the prediction."""
        beams = matched_beams(prior.mean[..., 0], prior.mean[..., 1], prior.known, view.system)
        return Decision(beams, np.zeros(beams.shape[:-2], dtype=bool))
