"""Sensing without beams: every slot is omnidirectional."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.schemes.base import Decision, View
from echobeam.schemes.frame import TrackingFrame
from echobeam.values import BoolArray, GaussianState, Phase


@dataclass(frozen=True, slots=True)
class Omni(TrackingFrame):
    """The omnidirectional phase for ever; every object's echo goes through the filter."""

    name: str = "omni"

    def phase(self, slot_in_frame: int) -> Phase:
        """Return "omni" always."""
        return "omni"

    def listens(self, view: View) -> BoolArray:
        """Return all objects: known ones are filtered, unknown ones detected."""
        return np.ones_like(view.posterior.known)

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return no beams; never asked for."""
        shape = (*prior.known.shape, view.system.array.n_tx)
        return Decision(np.zeros(shape, dtype=complex), np.zeros(shape[:-2], dtype=bool))
