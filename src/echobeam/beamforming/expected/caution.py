"""Shapes for a larger SNR than there is, so that no part of a belief is left dark.

At low SNR the rate is linear in the gain, and the beam of the largest expected rate has as little
power outside its main lobe as can be: an object in the tail of the belief has no echo, and stays
in the tail. At high SNR the rate is the logarithm of the gain, and the best beam is flat. So
shapes are designed as if the SNR of a matched beam were at least some number, and the power is
shared out at the SNR that there is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echobeam.beamforming.expected import starts
from echobeam.beamforming.expected.objective import received
from echobeam.beamforming.expected.places import Places
from echobeam.values import ComplexArray


def cautious(places: Places, least_snr: float) -> Places:
    """Return places with less noise where the SNR of a matched beam is below ``least_snr``."""
    snr = np.sum(places.weight / places.loss, axis=-1, keepdims=True)
    more = np.where(snr > 0.0, least_snr / np.where(snr > 0.0, snr, 1.0), 1.0)
    return replace(places, loss=places.loss / np.maximum(more, 1.0))


def shared_out(places: Places, beams: ComplexArray) -> ComplexArray:
    """Return cautious beams ``(T, K, r)`` with the better of their own and water-filling powers."""
    filled = starts.filled(places, starts.unit(beams))
    better = received(places, filled).value > received(places, beams).value
    return np.where(better[:, None, None], filled, beams)
