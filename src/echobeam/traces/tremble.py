"""Trembling positions: those of receivers and cameras, whose errors pass for motion.

Positions are taken at their word, so a metre of error at ten samples a second is a velocity that
jumps by 14 m/s. A trace whose vehicles accelerate as none does, in most of their steps, is run as
it is, and says so.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from echobeam.traces.breaks import HARDEST
from echobeam.traces.collect import RoadSamples
from echobeam.traces.motion import links, medians, road_speeds
from echobeam.values import Array

_FEWEST_STEPS = 5
"""Steps from which on a vehicle's habit shows."""


def trembling(samples: RoadSamples) -> Iterator[str]:
    """Yield a sentence about the vehicles whose positions tremble, if there are any."""
    if samples.time.size == 0:
        return
    typical = _typical_accelerations(samples)
    count = int(np.count_nonzero(typical > HARDEST))
    if count:
        worst = int(np.argmax(typical))
        yield (
            f"the positions of {count} of {len(samples.names)} vehicles tremble in the slots that "
            f"are run, most those of {samples.names[worst]!r}: they accelerate it by "
            f"{typical[worst]:.3g} m/s^2 in half of its steps, and the true velocities jump with "
            "them; smooth the positions first"
        )


def _typical_accelerations(samples: RoadSamples) -> Array:
    """Return the median over each vehicle's steps of the largest acceleration, m/s^2.

    Zero for a vehicle of few steps.
    """
    linked = links(samples)
    speed = road_speeds(samples, linked)
    h = np.where(linked, np.diff(samples.time), 1.0)
    chord = np.diff(samples.along) / h
    # the cubic's second derivative is linear in time, so its extremes are at the ends
    first = np.abs(6 * chord - 4 * speed[:-1] - 2 * speed[1:]) / h
    last = np.abs(6 * chord - 2 * speed[:-1] - 4 * speed[1:]) / h
    largest, owner = np.maximum(first, last)[linked], samples.vehicle[:-1][linked]
    steps = np.bincount(owner, minlength=len(samples.names))
    return np.where(steps < _FEWEST_STEPS, 0.0, medians(owner, largest, steps.size))
