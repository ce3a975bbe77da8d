"""The paper's proposed scheme: track by echoes, predict, and cover the uncertainty."""

from __future__ import annotations

from echobeam.schemes.beamers import CoverBeamer
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.trackers import ExtendedKalman

TEMPORAL = SchemeOfParts("temporal", ClockedFrame(), ExtendedKalman(), CoverBeamer())
"""Problem (38) at the predicted state in every directional slot."""
