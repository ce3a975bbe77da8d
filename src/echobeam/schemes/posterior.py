"""The scheme beyond the paper's: position on the ground, beams for the belief, looks that pay."""

from __future__ import annotations

from echobeam.schemes.adaptive_frames import ProbingFrame
from echobeam.schemes.ground import GroundTracker
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.posterior_beamer import PosteriorBeamer

POSTERIOR = SchemeOfParts("posterior", ProbingFrame(), GroundTracker(), PosteriorBeamer())
"""The largest expected sum rate over what echoes and the known height say together."""
