"""Plan of traffic: geometry, speeds, and the place and time at which vehicles enter.

A part of the vehicles is on the road at time 0, the others enter at its beginning over the time, in
the ratio of a steady flow: a vehicle takes length / speed to pass, so that many seconds of the flow
are on the road at once. So the density is the same from the first slot to the last, without a
warm-up.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

CAR = 5.0
"""Length of a vehicle, m (SUMO's default for cars)."""

GAP = 2.5
"""Distance to a standing vehicle ahead, m (SUMO's default)."""

HEADWAY = 1.0
"""Time gap of a driver to the vehicle ahead, s (SUMO's default)."""

SPREAD, SLOWEST, FASTEST = 0.15, 0.6, 1.4
"""Standard deviation and limits of the desired speeds, relative to their mean."""

_USUAL = 0.015
"""Density of medium traffic, vehicles per metre of a lane."""

_FULLEST = 0.8
"""Largest flow, relative to that of vehicles that follow each other at `HEADWAY`. Above it drivers
of different speeds queue at the entrance: of 72 roads (1 to 4 lanes, 5 to 50 m/s, 0.2 to 1 km) none
left a vehicle out at 0.7, two did at 0.8, and 54 at 1."""

_FLOWING = 0.75
"""Largest flow of medium traffic, relative to the largest one."""

SAMPLES = 4
"""Smallest number of samples of a vehicle."""

GREEN = 0.4
"""Part of the time in which an arm of an intersection has a green light, about."""

TURNS = ("right", "straight", "left")
SHARES = (0.25, 0.5, 0.25)
"""Ways through an intersection, and how many vehicles take each."""

Kind = Literal["road", "intersection"]


class Entry(NamedTuple):
    """Entry of a vehicle.

    Attributes
    ----------
    name
        Id of the vehicle.
    road
        Index of its direction: 0 towards growing x, 1 against it; at an intersection 2 towards
        growing y and 3 against it.
    lane
        Lane, from the right; None for the one with most room.
    time
        Time of entry, ms.
    position
        Distance from the beginning of the road in its direction, m.
    turn
        Index of its way through an intersection in `TURNS`.
    """

    name: str
    road: int
    lane: int | None
    time: int
    position: float
    turn: int = 1


@dataclass(frozen=True, slots=True)
class Plan:
    """Traffic on a straight road from x = -length / 2 to length / 2, or on two that cross.

    At an intersection both roads have the same length and cross at (0, 0), where lights let them
    go in turns.

    Attributes
    ----------
    vehicles
        Number of vehicles in the trace.
    length
        Length of the road, m.
    speed
        Mean desired speed, m/s.
    lanes
        Number of lanes in each direction.
    duration, step
        Time of the trace and time between samples, ms.
    seed
        Seed of all randomness.
    both_directions
        Whether half of the vehicles drive against the x axis, on lanes of their own; at an
        intersection they always do.
    kind
        ``"road"`` or ``"intersection"``.
    """

    vehicles: int
    length: float
    speed: float
    lanes: int
    duration: int
    step: int
    seed: int
    both_directions: bool = False
    kind: Kind = "road"

    def with_vehicles(self, vehicles: int) -> Plan:
        """Return the plan with another number of vehicles."""
        return replace(self, vehicles=vehicles)

    @property
    def roads(self) -> int:
        """Number of directions."""
        if self.kind == "intersection":
            return 4
        return 2 if self.both_directions else 1

    @property
    def entrance(self) -> float:
        """Length of the road on which vehicles are at time 0, m: up to an intersection."""
        return self.length / 2 if self.kind == "intersection" else self.length

    @property
    def passage(self) -> float:
        """Time of a vehicle of the mean speed on the road, s."""
        return self.entrance / self.speed

    @property
    def on_road(self) -> float:
        """Share of the vehicles that are on the road at time 0."""
        return self.passage / (self.passage + self.duration / 1e3)

    @property
    def usual(self) -> int:
        """Number of vehicles of medium traffic."""
        at_once = _USUAL * self.entrance * self.lanes * self.roads
        return max(1, min(int(_FLOWING * self.fullest), round(at_once / self.on_road)))

    @property
    def fullest(self) -> int:
        """Largest number of vehicles that enter without queues."""
        space = self.speed * HEADWAY + CAR + GAP
        open_for = GREEN if self.kind == "intersection" else 1.0
        way = self.entrance + open_for * self.speed * self.duration / 1e3
        return max(self.roads, int(_FULLEST * self.lanes * self.roads * way / space))

    @property
    def shortest(self) -> float:
        """Length on which the fastest vehicle has `SAMPLES` samples, m."""
        return SAMPLES * self.step / 1e3 * FASTEST * self.speed


def entries(plan: Plan) -> list[Entry]:
    """Return the entries of all vehicles, those at one time from the front to the back.

    Positions and times are drawn evenly: one in each of equal stretches of a lane, one in each of
    equal intervals.
    """
    draw = random.Random(plan.seed)
    found = [entry for road in range(plan.roads) for entry in _of_road(plan, road, draw)]
    found.sort(key=lambda entry: (entry.time, entry.road, -entry.position))
    digits = len(str(len(found) - 1))
    found = [entry._replace(name=f"car.{i:0{digits}}") for i, entry in enumerate(found)]
    if plan.kind == "road":
        return found
    turns = draw.choices(range(len(TURNS)), SHARES, k=len(found))
    return [entry._replace(turn=turn) for entry, turn in zip(found, turns, strict=True)]


def _of_road(plan: Plan, road: int, draw: random.Random) -> Iterator[Entry]:
    """Yield the entries into one direction, without names."""
    count = plan.vehicles // plan.roads + (road < plan.vehicles % plan.roads)
    if count == 0:
        return
    first = max(1, round(count * plan.on_road))
    for lane in range(plan.lanes):
        number = first // plan.lanes + (lane < first % plan.lanes)
        cell = (plan.entrance - plan.shortest) / max(1, number)
        for i in range(number):
            position = i * cell + min(CAR + GAP, cell) + draw.random() * max(0, cell - CAR - GAP)
            yield Entry("", road, lane, 0, round(position, 3))
    # a vehicle that waits for a gap is in the trace all the same
    last = plan.duration - max(SAMPLES * plan.step, min(3000, plan.duration // 5))
    interval = last / max(1, count - first)
    for i in range(count - first):
        time = interval * (i + draw.random())
        yield Entry("", road, None, int(time // plan.step) * plan.step, 0.0)
