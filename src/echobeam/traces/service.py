"""Service: at each slot the nearest vehicles in range, each in its own column."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from echobeam.traces.motion import Sightings
from echobeam.values import Array, BoolArray, IntArray, freeze


@dataclass(frozen=True, slots=True, eq=False)
class TraceMotion:
    """Vehicles that a UAV serves, slot by slot; a column holds one of them or none.

    Attributes
    ----------
    identity
        ``(slots, columns)``: index into ``names``, -1 for an empty column. A change from one slot
        to the next means another vehicle in the column.
    position
        ``(slots, columns)`` m along the road from its origin, or ``(slots, columns, 2)`` in a
        plane; NaN for an empty column.
    velocity
        ``(slots, columns)`` m/s along the road, or ``(slots, columns, 2)``; NaN for an empty
        column.
    present
        ``(slots, columns)``: whether the column holds a vehicle.
    names
        The ids of the vehicles.
    standing
        ``(names, 1)``, or ``(names, 2)`` in a plane: vector along the heading of each vehicle if it
        stands when it is first served, see `standing`; zero where it never moves in the trace.
    dropped
        Number of vehicles of the trace with a single sample, which determines no motion.
    """

    identity: IntArray
    position: Array
    velocity: Array
    present: BoolArray
    names: tuple[str, ...]
    standing: Array
    dropped: int = 0

    def __post_init__(self) -> None:
        freeze(self.identity, self.position, self.velocity, self.present, self.standing)


def serve(
    sightings: Sightings,
    names: tuple[str, ...],
    standing: Array,
    uav_x: Array,
    max_objects: int,
    range_m: float,
    dropped: int = 0,
) -> TraceMotion:
    """Return the served vehicles and their columns.

    A vehicle stays in its column while it is served without interruption; a new one gets the first
    free column, several of one slot in the order of their ids.

    Parameters
    ----------
    sightings
        Positions of vehicles at slots, with the same origin as ``uav_x``.
    names
        Ids of the vehicles, sorted; ties are resolved in this order.
    standing
        Value for the result.
    uav_x
        ``(slots,)`` m along the road: the point below the UAV; ``(slots, 2)`` in a plane.
    max_objects
        Number of columns.
    range_m
        Range of service, m along the road on either side of the point below the UAV, or around it.
    dropped
        Value for the result.
    """
    chosen = _nearest(sightings, uav_x, max_objects, range_m)
    slot, vehicle = sightings.slot[chosen], sightings.vehicle[chosen]
    column = _columns(slot, vehicle, max_objects)
    shape = (len(uav_x), max_objects)
    identity = np.full(shape, -1, dtype=np.int64)
    position, velocity = np.full((2, *shape, *uav_x.shape[1:]), np.nan)
    identity[slot, column] = vehicle
    position[slot, column] = sightings.position[chosen]
    velocity[slot, column] = sightings.velocity[chosen]
    return TraceMotion(identity, position, velocity, identity >= 0, names, standing, dropped)


def _nearest(sightings: Sightings, uav_x: Array, max_objects: int, range_m: float) -> IntArray:
    """Return the indices of the served sightings, ordered by vehicle and slot."""
    off = sightings.position - uav_x[sightings.slot]
    distance = np.abs(off) if off.ndim == 1 else np.hypot(off[:, 0], off[:, 1])
    near = np.flatnonzero(distance <= range_m)
    slot, vehicle = sightings.slot[near], sightings.vehicle[near]
    order = np.lexsort((vehicle, distance[near], slot))
    rank = np.arange(near.size) - np.searchsorted(slot[order], slot[order])
    served = near[order[rank < max_objects]]
    return served[np.lexsort((sightings.slot[served], sightings.vehicle[served]))]


def _columns(slot: IntArray, vehicle: IntArray, max_objects: int) -> IntArray:
    """Return a column for each sighting, the same throughout an uninterrupted service."""
    new = np.append(True, (np.diff(vehicle) != 0) | (np.diff(slot) != 1))[: slot.size]
    first = np.flatnonzero(new)
    length = np.diff(np.append(first, slot.size))
    begin, end = slot[first], slot[first] + length
    column = np.zeros(first.size, dtype=np.int64)
    free = list(range(max_objects))
    busy: list[tuple[int, int]] = []  # (end of the service, column)
    for spell in np.lexsort((vehicle[first], begin)):
        while busy and busy[0][0] <= begin[spell]:
            heapq.heappush(free, heapq.heappop(busy)[1])
        column[spell] = heapq.heappop(free)
        heapq.heappush(busy, (int(end[spell]), int(column[spell])))
    return np.repeat(column, length)
