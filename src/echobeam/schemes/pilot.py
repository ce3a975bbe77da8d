"""The paper's first baseline: a pilot slot, then beams from that one estimate.

The paper does not define it further. Read here: the first slot of a frame is an omnidirectional
pilot without data, measured as well as the proposed scheme's omnidirectional slot; the beams of
the frame's other slots come from that estimate alone, since there is no radar in them.
"""

from __future__ import annotations

from echobeam.schemes.beamers import CoverBeamer, HeldBeams, MatchedBeamer
from echobeam.schemes.frames import PilotFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.trackers import DeadReckoning, HeldEstimate

PILOT = SchemeOfParts("pilot", PilotFrame(), HeldEstimate(), HeldBeams(CoverBeamer(aim="last")))
"""One coverage beam per object from the pilot's estimate, held for the frame."""

PILOT_NEEDLE = SchemeOfParts(
    "pilot-needle", PilotFrame(), HeldEstimate(), HeldBeams(MatchedBeamer(aim="last"))
)
"""Matched beams to the pilot's estimate, held for the frame."""

PILOT_PREDICT = SchemeOfParts(
    "pilot-predict", PilotFrame(), DeadReckoning(), CoverBeamer(cold_every=1)
)
"""Dead reckoning: the pilot's estimate is predicted on, and the coverage follows it."""
