"""Repair of samples on a road: even times, consistent speeds, thinning to the positions' digits.

The findings of the survey on the whole trace are applied to the collected samples. Two faults are
visible only in single samples: a speed that is inconsistent with the positions on both sides, which
is then unknown, and a jump that is too short for `breaks` to detect from the positions alone,
during which the vehicle is absent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from echobeam.traces.breaks import HARDEST, SLACK
from echobeam.traces.clock import evened
from echobeam.traces.collect import RoadSamples, taken
from echobeam.traces.motion import links, road_share
from echobeam.traces.road import Road
from echobeam.traces.survey import Survey
from echobeam.values import Array, BoolArray, IntArray

_SLOWEST_NOISE = 0.02
"""Error of speeds from the positions of thinned samples, m/s."""

_LONGEST_SPACING = 1.0
"""Longest time between thinned samples, s."""

_COARSEST = 0.1
"""Coarsest last digit of rounded positions, m: coarser ones are exact, not rounded."""

_ALIKE = 0.7
"""Smallest ratio of two speeds to their mean in steady motion between them."""

_SAME, _OTHER = 0.1, 0.3
"""Relative differences of paths: the largest of equal ones, and the smallest of different ones."""

_LITTLE = 0.2
"""Further tolerated difference of paths, m."""


@dataclass(frozen=True, slots=True, eq=False)
class Repaired:
    """Repaired samples, ready for interpolation.

    Attributes
    ----------
    samples
        Repaired samples.
    notes
        Sentences on the unusable speeds and the short jumps.
    """

    samples: RoadSamples
    notes: tuple[str, ...]


def spacing(survey: Survey) -> float:
    """Return the shortest time between samples for the digits of their positions, s.

    SUMO writes two digits: at 40 samples a second a car of 14 m/s then goes 0.34 or 0.35 m from
    one to the next, and its speed would jump by three per cent.
    """
    digit = 10.0**-survey.position_digits
    if digit > _COARSEST:
        return 0.0
    return min(digit / _SLOWEST_NOISE, _LONGEST_SPACING)


def repair(samples: RoadSamples, survey: Survey) -> Repaired:
    """Return samples repaired for interpolation.

    Parameters
    ----------
    samples
        Collected samples.
    survey
        Findings on the whole trace.
    """
    if samples.time.size == 0:
        return Repaired(samples, ())
    if survey.step is not None:
        time = evened(samples.time, links(samples), survey.step)
        samples = replace(samples, time=time)
    speed = np.where(_vehicles_in(survey.marked, samples), np.nan, samples.speed)
    linked = links(samples)
    dropouts = _dropouts(samples, speed, linked, _way(samples, survey.road))
    speed = np.where(dropouts, np.nan, speed)
    odd = _contradictions(samples, speed, linked, survey.speed_share)
    outliers = _outliers(samples, speed, odd)
    speed = np.where(outliers, np.nan, speed)
    jumps = _contradictions(samples, speed, linked, survey.speed_share)
    visit = samples.visit + np.append(0, np.cumsum(jumps))
    useless = _vehicles_in(survey.inexact, samples) | (not survey.speeds_at_samples)
    speed = np.where(useless, np.nan, speed)
    samples = replace(samples, speed=speed, visit=visit)
    unknown = (dropouts | outliers) & survey.speeds_at_samples
    notes = (
        *_note(
            samples, unknown, "speed(s) contradict the positions on both sides", "read as unknown"
        ),
        *_note(
            samples, np.append(False, jumps), "short jump(s) contradict the speeds", "absent then"
        ),
    )
    knots = _knots(samples, spacing(survey))
    if knots is not None:
        samples = taken(samples if survey.road.plane else _projected(samples), knots)
    return Repaired(samples, notes)


Way = Callable[[int], Array]
"""Paths between samples and those so many later, m, ``(n - step,)``."""


def _way(samples: RoadSamples, road: Road) -> Way:
    """Return the lengths of paths: along the road, where a change of lane is none, or straight."""

    def length(step: int) -> Array:
        along = samples.along[step:] - samples.along[:-step]
        if not road.plane:
            return np.abs(along)
        return np.hypot(along, samples.across[step:] - samples.across[:-step])

    return length


def _note(samples: RoadSamples, found: BoolArray, fault: str, consequence: str) -> Iterator[str]:
    """Yield a sentence on the samples found, if there are any."""
    if found.any():
        first = int(np.argmax(found))
        name, time = samples.names[samples.vehicle[first]], samples.time[first]
        yield (
            f"{np.count_nonzero(found)} {fault} in the slots that are run, first of vehicle "
            f"{name!r} at t = {time:.6g} s: {consequence}"
        )


def _vehicles_in(names: frozenset[str], samples: RoadSamples) -> BoolArray:
    """Return whether samples belong to one of the named vehicles."""
    chosen = np.array([name in names for name in samples.names], dtype=bool)
    found: BoolArray = chosen[samples.vehicle]
    return found


def _dropouts(samples: RoadSamples, speed: Array, linked: BoolArray, length: Way) -> BoolArray:
    """Return whether a speed of zero or less is a mark for unknown while the vehicle moves on.

    It is a mark if no vehicle could have stopped and started so fast, or if the speeds before and
    after it agree with the path between them; at the ends of a motion, if the neighbouring speed
    agrees with the path to it. A vehicle with one negative mark has no other negative speeds.
    """
    found = np.zeros(speed.size, dtype=bool)
    size = np.abs(speed)
    suspect = speed <= 0
    step, way = np.diff(samples.time), length(1)
    steady = (
        _alike(size[:-1] * step, way),
        _alike(size[1:] * step, way),
    )  # by the speed at either end
    other = np.abs((size[:-1] + size[1:]) / 2 * step - way) > _OTHER / 2 * way
    first, last = ~np.append(False, linked), ~np.append(linked, False)
    found[:-1] |= first[:-1] & linked & steady[1] & other
    found[1:] |= last[1:] & linked & steady[0] & other

    both = linked[:-1] & linked[1:]
    time = samples.time[2:] - samples.time[:-2]
    net = length(2)
    off = np.abs(size[1:-1] * time - net)
    mean = (size[:-2] + size[2:]) / 2
    alike = np.minimum(size[:-2], size[2:]) > _ALIKE * mean
    too_fast = off > _LITTLE + HARDEST * (time / 2) ** 2
    found[1:-1] |= both & (too_fast | (alike & _alike(mean * time, net) & (off > _OTHER * net)))
    found &= suspect
    marks = np.bincount(samples.vehicle[found & (speed < 0)], minlength=len(samples.names)) > 0
    return found | (marks[samples.vehicle] & (speed < 0))


def _alike(one: Array, other: Array) -> BoolArray:
    """Return whether two paths are equal and not zero."""
    same: BoolArray = (np.abs(one - other) <= _SAME * other + _LITTLE) & (other > _LITTLE)
    return same


def _contradictions(
    samples: RoadSamples, speed: Array, linked: BoolArray, share: float
) -> BoolArray:
    """Return whether path and speeds between two samples differ by more than acceleration."""
    h = np.diff(samples.time)
    way = np.hypot(np.diff(samples.along), np.diff(samples.across))
    mean = share * np.abs(speed[1:]) + (1 - share) * np.abs(speed[:-1])
    odd: BoolArray = linked & (np.abs(way - mean * h) > SLACK + HARDEST * h**2 / 4)
    return odd


def _outliers(samples: RoadSamples, speed: Array, odd: BoolArray) -> BoolArray:
    """Return whether a speed contradicts the paths on both sides, or on the only side.

    At the ends of a motion, with one side, this speed must be wrong and not the neighbouring one.
    """
    h = np.diff(samples.time)
    way = np.hypot(np.diff(samples.along), np.diff(samples.across))
    room = SLACK + HARDEST * h**2 / 4
    linked = links(samples)
    left, right = np.append(False, odd), np.append(odd, False)
    has_left, has_right = np.append(False, linked), np.append(linked, False)
    by_other_left = np.append(False, np.abs(way - np.abs(speed[:-1]) * h) <= room)
    by_other_right = np.append(np.abs(way - np.abs(speed[1:]) * h) <= room, False)
    found: BoolArray = (
        (left & right) | (left & ~has_right & by_other_left) | (right & ~has_left & by_other_right)
    )
    return found


def _knots(samples: RoadSamples, width: float) -> BoolArray | None:
    """Return which samples, at least ``width`` seconds apart, to keep, with all ends of motions.

    None where that is no change.
    """
    linked = links(samples)
    if width == 0 or not linked.any() or np.diff(samples.time)[linked].min() >= width:
        return None
    run = np.append(0, np.cumsum(~linked))
    first = np.flatnonzero(np.append(True, ~linked))
    last = np.flatnonzero(np.append(~linked, True))
    bin_: IntArray = np.floor(samples.time / width + 1e-6).astype(np.int64)
    knot = np.append(True, np.diff(bin_) != 0)
    knot &= samples.time - samples.time[first][run] >= width
    knot &= samples.time[last][run] - samples.time >= width
    knot[first] = knot[last] = True
    return knot


def _projected(samples: RoadSamples) -> RoadSamples:
    """Return samples along the road alone: a change of lane takes longer from here on."""
    speed = samples.speed * road_share(samples, links(samples))
    return replace(samples, across=np.zeros(samples.across.size), speed=speed)
