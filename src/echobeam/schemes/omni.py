"""Sensing without beams: every slot is omnidirectional."""

from __future__ import annotations

from echobeam.schemes.beamers import MatchedBeamer
from echobeam.schemes.frames import OmniFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.trackers import ExtendedKalman

OMNI = SchemeOfParts("omni", OmniFrame(), ExtendedKalman(), MatchedBeamer())
"""The omnidirectional mode for ever; its beamer is never asked."""
