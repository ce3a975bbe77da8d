"""Jitter of positions, as of receivers and cameras, whose errors look like motion.

Positions are taken as exact, so an error of a metre at ten samples a second is a velocity that
jumps by 14 m/s. Vehicles that accelerate in most of their steps as none can are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.traces.breaks import HARDEST
from echobeam.traces.collect import RoadSamples, taken
from echobeam.traces.motion import both_axes, links, medians, road_speeds
from echobeam.values import Array

_FEWEST_STEPS = 5
"""Smallest number of steps for a decision about a vehicle."""


class Smooth(NamedTuple):
    """Samples of the vehicles without jitter, and what is left out.

    Attributes
    ----------
    samples
        The others' samples.
    note
        Sentence about those left out; empty if there are none.
    nobody
        Whether nobody is left.
    """

    samples: RoadSamples
    note: str
    nobody: bool


def without_jitter(samples: RoadSamples, *, plane: bool = False) -> Smooth:
    """Return the samples without those of vehicles whose positions jitter.

    Parameters
    ----------
    samples
        The vehicles' samples.
    plane
        Whether along and across are coordinates of a plane.
    """
    if samples.time.size == 0:
        return Smooth(samples, "", False)
    axes = both_axes(samples) if plane else [samples]
    typical = np.max([_typical_accelerations(each) for each in axes], axis=0)
    jittering = typical > HARDEST
    count = int(np.count_nonzero(jittering))
    if not count:
        return Smooth(samples, "", False)
    worst = int(np.argmax(typical))
    note = (
        f"the positions of {count} of {len(samples.names)} vehicles jitter, most those of "
        f"{samples.names[worst]!r}: they would accelerate it by {typical[worst]:.3g} m/s^2 in half "
        "of its steps; smooth the positions first"
    )
    kept = ~jittering[samples.vehicle]
    return Smooth(taken(samples, kept), note, not kept.any())


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
