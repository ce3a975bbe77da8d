"""Motion between samples: monotone piecewise cubic interpolation with continuous speed.

Between two samples the distance along the road is the cubic with the positions and the speeds of
both (Hermite). The speed at a sample is the one in the trace, projected on the road, or else the
slope of the parabola through the sample and its neighbours. Both are then limited so that the cubic
is monotone (de Boor and Swartz 1977): in the direction of travel, and at most three times the mean
speed of the interval on either side. So a vehicle that stops does not roll back, and one that turns
round does so at a sample. Speeds consistent with the positions are unchanged: motion at constant
velocity or acceleration is reproduced exactly. In a plane this is done along each axis, from the
positions alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echobeam.traces.collect import RoadSamples
from echobeam.traces.sample import SHORTEST_STEP
from echobeam.values import Array, BoolArray, IntArray

GAP_PERIODS = 5.0
"""Longest gap, in sample periods, that is interpolated; in a longer one the vehicle is absent.

The period of a vehicle is the median of the times between its samples.
"""

_STEEPEST = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Positions of vehicles at slots; one entry per vehicle and slot, ordered by vehicle.

    Attributes
    ----------
    slot, vehicle
        ``(n,)``: indices of the slot (from 0) and the vehicle.
    position
        ``(n,)`` m along the road, or ``(n, 2)`` in a plane.
    velocity
        ``(n,)`` m/s along the road, or ``(n, 2)``: the derivative of the position.
    """

    slot: IntArray
    vehicle: IntArray
    position: Array
    velocity: Array


def both_axes(samples: RoadSamples) -> list[RoadSamples]:
    """Return motions along the x and the y axis of a plane, each as if along a road.

    Speeds are of the whole motion, so that those along an axis follow from the positions.
    """
    unknown, zero = np.full(samples.time.size, np.nan), np.zeros(samples.time.size)
    places = (samples.along, samples.across)
    return [replace(samples, along=place, across=zero, speed=unknown) for place in places]


def sight_on_plane(samples: RoadSamples, clock: Array) -> Sightings:
    """Return positions and velocities ``(n, 2)`` in a plane, each axis as by `sight`."""
    x, y = (sight(each, clock) for each in both_axes(samples))
    return Sightings(
        slot=x.slot,
        vehicle=x.vehicle,
        position=np.stack([x.position, y.position], axis=-1),
        velocity=np.stack([x.velocity, y.velocity], axis=-1),
    )


def sight(samples: RoadSamples, clock: Array) -> Sightings:
    """Return the vehicles' positions and velocities at the slots' times.

    A vehicle is present from its first to its last sample, without extrapolation; a gap of more
    than `GAP_PERIODS`, a time off the road or a jump interrupts its presence for at least one
    slot.

    Parameters
    ----------
    samples
        The vehicles' samples.
    clock
        ``(slots,)`` s, increasing: times of the slots on the trace's clock.
    """
    linked = links(samples)
    slope = road_speeds(samples, linked)
    stretch, slot = _slots_in(samples.time, linked, clock)
    gone = _back_at_once(samples.vehicle[stretch], stretch, slot, linked)
    stretch, slot = stretch[~gone], slot[~gone]
    h = np.diff(samples.time)[stretch]
    chord = np.diff(samples.along)[stretch] / h
    v0, v1 = slope[:-1][stretch], slope[1:][stretch]
    u = np.clip((clock[slot] - samples.time[stretch]) / h, 0.0, 1.0)
    c2, c3 = 3.0 * chord - 2.0 * v0 - v1, v0 + v1 - 2.0 * chord
    return Sightings(
        slot=slot,
        vehicle=samples.vehicle[stretch],
        position=samples.along[stretch] + h * u * (v0 + u * (c2 + u * c3)),
        velocity=v0 + u * (2.0 * c2 + 3.0 * u * c3),
    )


def road_speeds(samples: RoadSamples, linked: BoolArray) -> Array:
    """Return the vehicles' velocities along the road at their samples.

    Parameters
    ----------
    samples
        ``n`` samples.
    linked
        ``(n - 1,)``: whether a sample and the next belong to one unbroken motion.

    Returns
    -------
    Array
        ``(n,)`` m/s. The sign follows from the positions, whatever the sign of the speeds.
    """
    h = np.diff(samples.time)
    chord = _ratio(np.diff(samples.along), h, linked)
    left, right = np.append(0.0, chord), np.append(chord, 0.0)
    has_left, has_right = np.append(False, linked), np.append(linked, False)
    direction = np.sign(np.sign(left) + np.sign(right))
    steepest = _STEEPEST * np.minimum(
        np.where(has_left, np.abs(left), np.inf), np.where(has_right, np.abs(right), np.inf)
    )
    raw = np.where(
        np.isnan(samples.speed),
        direction * _parabola_slopes(h, chord, linked),
        np.abs(samples.speed) * road_share(samples, linked),
    )
    speeds: Array = direction * np.clip(raw, 0.0, steepest)
    return speeds


def links(samples: RoadSamples) -> BoolArray:
    """Return whether each sample and the next belong to one unbroken motion."""
    step = np.diff(samples.time)
    same = (np.diff(samples.vehicle) == 0) & (np.diff(samples.visit) == 0)
    limit = GAP_PERIODS * medians(samples.vehicle[:-1][same], step[same], len(samples.names))
    linked: BoolArray = same & (step <= limit[samples.vehicle[:-1]])
    return linked


def medians(vehicle: IntArray, value: Array, n_vehicles: int) -> Array:
    """Return the (lower) median of each vehicle's values; NaN where it has none."""
    ordered = value[np.lexsort((value, vehicle))]
    count = np.bincount(vehicle, minlength=n_vehicles)
    middle = np.cumsum(count) - count + (count - 1) // 2
    median = np.full(n_vehicles, np.nan)
    median[count > 0] = ordered[middle[count > 0]]
    return median


def _parabola_slopes(h: Array, chord: Array, linked: BoolArray) -> Array:
    """Return the slopes at the samples of the parabola through the three nearest ones.

    At the first and last sample of a motion, the slope is that of the end of the first or last
    parabola; a motion of two samples is a straight line.
    """
    both = linked[:-1] & linked[1:]
    bend = _ratio(np.diff(chord), h[:-1] + h[1:], both)  # half the acceleration
    slope = np.zeros(h.size + 1)
    # From the interval on the right, with the bend at its left end or, at a start, at its right.
    bend_at = np.pad(bend, 1)
    has_left = np.append(False, linked[:-1])
    at_left = chord - h * np.where(has_left, bend_at[:-1], bend_at[1:])
    slope[:-1] = np.where(linked, at_left, 0.0)
    ends = linked & ~np.append(linked[1:], False)
    slope[1:][ends] = (chord + h * bend_at[:-1])[ends]
    return slope


def road_share(samples: RoadSamples, linked: BoolArray) -> Array:
    """Return the cosine between the vehicle's path around a sample and the road, 0 to 1.

    It is the largest of the cosines at the sample and its neighbours: simulators change lanes by a
    sideways jump in a single step, during which the vehicle continues along the road.
    """
    index = np.arange(samples.time.size)
    before, after = index - np.append(False, linked), index + np.append(linked, False)
    along = np.abs(samples.along[after] - samples.along[before])
    way = np.hypot(along, samples.across[after] - samples.across[before])
    share = _ratio(along, way, way > 0)
    largest: Array = np.maximum(share, np.maximum(share[before], share[after]))
    return largest


def _back_at_once(
    vehicle: IntArray, stretch: IntArray, slot: IntArray, linked: BoolArray
) -> BoolArray:
    """Return whether a vehicle is present in the slot right after an absence, hiding it."""
    run = np.append(0, np.cumsum(~linked))[stretch]
    back = np.zeros(slot.size, dtype=bool)
    back[1:] = (np.diff(vehicle) == 0) & (np.diff(slot) == 1) & (np.diff(run) != 0)
    return back


def _ratio(numerator: Array, denominator: Array, where: BoolArray) -> Array:
    """Return a quotient, and zero elsewhere."""
    return np.divide(numerator, denominator, out=np.zeros_like(denominator), where=where)


def _slots_in(time: Array, linked: BoolArray, clock: Array) -> tuple[IntArray, IntArray]:
    """Return the pairs of an interval between linked samples and a slot in it, as two lists.

    A slot that misses the first or last sample by rounding (0.07 against 7 * 0.01) counts as at it.
    """
    starts = ~np.append(False, linked[:-1])
    ends = ~np.append(linked[1:], False)
    first = np.searchsorted(clock, time[:-1] - starts * SHORTEST_STEP, "left")
    stop = np.searchsorted(clock, time[1:] + ends * SHORTEST_STEP, "left")
    count = np.where(linked, stop - first, 0)
    stretch = np.repeat(np.arange(count.size), count)
    offset = np.arange(stretch.size) - np.repeat(np.cumsum(count) - count, count)
    return stretch, first[stretch] + offset
