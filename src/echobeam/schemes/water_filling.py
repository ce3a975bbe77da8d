"""The paper's second baseline: matched beams at the predicted angles, water-filling power."""

from __future__ import annotations

from echobeam.schemes.beamers import MatchedBeamer
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.trackers import ExtendedKalman

WATER_FILLING = SchemeOfParts("water-filling", ClockedFrame(), ExtendedKalman(), MatchedBeamer())
"""Frame and filter of the proposed scheme; the beams cover nothing."""
