"""Movers: the motion of the objects in ground coordinates, advanced slot by slot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from echobeam.physics.angles import exact_cosine
from echobeam.physics.flight import FlightPath
from echobeam.physics.geometry import along_road, polar_state
from echobeam.physics.motion import Flight, initial_distance, move_along_road
from echobeam.scenario.load import trace_path
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import TraceTable
from echobeam.simulation.randomness import Use, object_normals
from echobeam.traces import PLANE, TraceMotion, load_motion, road_between
from echobeam.values import NOBODY, Array, IntArray, UavState

LAST_SLOT = 2**62
"""Slot after all others, for objects that never leave."""


ALONG = (1.0, 0.0, 0.0)
"""Heading of an object that never moves: the road's direction."""


@dataclass(frozen=True, slots=True)
class Ground:
    """Objects in ground coordinates at the beginning of a slot.

    Attributes
    ----------
    position, velocity
        ``(T, K, 3)`` m, m/s: x along the road, y across it, z above ground; NaN where nobody is.
        T is 1 where all trials share one motion.
    identity
        ``(K,)``: who is in each column; `NOBODY` where it is empty.
    """

    position: Array
    velocity: Array
    identity: IntArray


class Mover(Protocol):
    """Motion of all objects of a scene."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objects, by identity."""

    def begin(self) -> Ground:
        """Return the objects in the first slot."""

    def advance(self, ground: Ground, slot: int, uav: UavState, seed: int, trials: range) -> Ground:
        """Return the objects one slot later.

        Parameters
        ----------
        ground, uav
            Objects and UAV in the slot that ends.
        slot
            That slot, counted from 0.
        seed, trials
            Key of nature's own noise.
        """

    def standing(self, slot: int) -> Array:
        """Return vectors ``(K, 3)``, or one for all, along the headings of objects at rest.

        That of the last motion, or of the first one to come; used where an object rests in the
        first slot in which it is there. Nature alone knows it.
        """


@dataclass(frozen=True, slots=True)
class Kinematic:
    """Objects at constant acceleration along the road, with nature's own noise if asked for.

    Attributes
    ----------
    x, velocity, acceleration
        ``(K,)`` m, m/s, m/s^2 at time 0.
    slot_duration
        s.
    noise
        Standard deviations of nature's noise for each slot, rad, m, m/s; None for none. Of the
        noise on angle and distance the part that leaves the object on the road acts
        (`along_road`).
    first, last
        ``(K,)``: slots, counted from 0, in which each object is there first and last.
    """

    x: Array
    velocity: Array
    acceleration: Array
    slot_duration: float
    noise: tuple[float, float, float] | None
    first: IntArray
    last: IntArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names by number, counted from 1."""
        return tuple(f"object {number}" for number in range(1, len(self.x) + 1))

    def begin(self) -> Ground:
        """Return the objects in the first slot."""
        return self._ground(self.x[None], self.velocity[None], 0)

    def advance(self, ground: Ground, slot: int, uav: UavState, seed: int, trials: range) -> Ground:
        """Return the objects one slot later, Eq. (27) with acceleration, plus noise."""
        x, velocity = ground.position[..., 0], ground.velocity[..., 0]
        moved, faster = move_along_road(x, velocity, self.acceleration, self.slot_duration)
        if self.noise is not None:
            eta = object_normals(seed, trials, slot, Use.PROCESS, ground.identity, 3)
            eta = eta * np.array(self.noise)
            seen = polar_state(ground.position, ground.velocity, uav)
            moved = moved + along_road(seen, eta[..., :2], self.noise[:2])
            faster = faster + eta[..., 2]
        enters = self.first == slot + 1
        if enters.any():
            moved = np.where(enters, self.x, moved)
            faster = np.where(enters, self.velocity, faster)
        return self._ground(moved, faster, slot + 1)

    def standing(self, slot: int) -> Array:
        """Return the road's direction, of an object without a velocity."""
        return np.array(ALONG)

    def _ground(self, x: Array, velocity: Array, slot: int) -> Ground:
        number = np.arange(x.shape[-1])
        there = (self.first <= slot) & (slot <= self.last)
        if not there.all():
            x, velocity = np.where(there, x, np.nan), np.where(there, velocity, np.nan)
        zero = np.where(there, np.zeros_like(x), np.nan)
        return Ground(
            position=np.stack([x, zero, zero], axis=-1),
            velocity=np.stack([velocity, zero, zero], axis=-1),
            identity=np.where(there, number, NOBODY),
        )


@dataclass(frozen=True, slots=True)
class Traced:
    """Vehicles of a recorded trace; the motion is looked up.

    Attributes
    ----------
    motion
        Of the vehicles that are served.
    heading
        ``(slots, K, 3)``: headings, see `standing_headings`.
    """

    motion: TraceMotion
    heading: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the vehicles in the trace."""
        return self.motion.names

    def begin(self) -> Ground:
        """Return the vehicles in the first slot."""
        return self._ground(0)

    def advance(self, ground: Ground, slot: int, uav: UavState, seed: int, trials: range) -> Ground:
        """Return the vehicles one slot later."""
        return self._ground(slot + 1)

    def standing(self, slot: int) -> Array:
        """Return the headings in a slot."""
        heading: Array = self.heading[slot]
        return heading

    def _ground(self, slot: int) -> Ground:
        place, velocity = self.motion.position[slot], self.motion.velocity[slot]
        flat = np.where(self.motion.present[slot], 0.0, np.nan)[:, None]
        if place.ndim == 1:  # along a road
            place, velocity = (np.hstack([each[:, None], flat]) for each in (place, velocity))
        return Ground(
            position=np.hstack([place, flat])[None],
            velocity=np.hstack([velocity, flat])[None],
            identity=self.motion.identity[slot].copy(),  # of this slot alone: the rest is future
        )


def mover_of(scenario: Scenario, flight: Flight) -> Mover:
    """Return the mover of a scenario along a road; this is where a trace is read.

    Raises
    ------
    TraceError
        If the trace cannot be used.
    """
    if scenario.trace is not None:
        return traced(scenario, flight)
    starts = np.array([item.along_road for item in scenario.objects], dtype=float).reshape(-1, 3)
    angle, velocity, acceleration = np.ascontiguousarray(starts.T)
    slot = scenario.frame.slot
    ends = [np.inf if item.leaves is None else item.leaves for item in scenario.objects]
    return Kinematic(
        x=initial_distance(angle, scenario.uav.height) * exact_cosine(angle),
        velocity=velocity,
        acceleration=acceleration,
        slot_duration=scenario.frame.slot,
        noise=scenario.truth_stds if scenario.truth.process_noise else None,
        first=slot_at([item.appears for item in scenario.objects], slot),
        last=slot_at(ends, slot) - 1,
    )


def slot_at(times: list[float], slot: float) -> IntArray:
    """Return the first slots ``(K,)`` that begin at some times or later, counted from 0."""
    number = np.ceil(np.array(times, dtype=float) / slot - 1e-6)
    return np.minimum(number, LAST_SLOT).astype(np.int64)


def traced(scenario: Scenario, flight: FlightPath) -> Traced:
    """Return the mover of a scenario with a trace; this is where the trace is read.

    Raises
    ------
    TraceError
        If the trace cannot be used.
    """
    table, file = scenario.trace, trace_path(scenario)
    assert table is not None
    assert file is not None
    changed = file.stat().st_mtime_ns if file.is_file() else 0
    plane = scenario.geometry == "ground"
    return _traced(file, changed, table, flight, scenario.n_slots, plane)


def standing_headings(motion: TraceMotion) -> Array:
    """Return the headings of a trace's vehicles, ``(slots, K, 3)``: those of their velocities.

    A vehicle at rest has that of its last motion while it was served; before, that in which it
    stands by the whole trace, and the road's direction if it never moves there.
    """
    heading = np.tile(ALONG, (motion.identity.size, 1))
    axes = motion.standing.shape[-1]
    velocity = motion.velocity.reshape(motion.identity.size, axes)
    there = np.flatnonzero(motion.present)
    order = there[np.argsort(motion.identity.ravel()[there], kind="stable")]  # then by slot
    who, moves = motion.identity.ravel()[order], (velocity[order] != 0.0).any(axis=-1)
    last = np.maximum.accumulate(np.where(moves, np.arange(order.size), -1))
    own = np.append(who, NOBODY)[last] == who  # -1, no motion, leads to nobody
    heading[order, :axes] = motion.standing[who]
    heading[order[own], :axes] = velocity[order[last[own]]]
    heading[~heading.any(axis=-1)] = ALONG
    return heading.reshape(*motion.identity.shape, len(ALONG))


@lru_cache(maxsize=4)
def _traced(
    file: Path, changed: int, table: TraceTable, flight: FlightPath, n_slots: int, plane: bool
) -> Traced:
    """Return a trace's vehicles; scenarios of a sweep that share them read them once."""
    road = None if table.road is None else road_between(table.road[:2], table.road[2:])
    below = np.array([flight.at(slot).position[:2] for slot in range(n_slots)])
    motion = load_motion(
        file,
        flight.slot_duration * np.arange(n_slots),
        uav_x=below if plane else below[:, 0],
        max_objects=table.max_objects,
        range_m=table.range,
        road=PLANE if plane else road,
        origin=table.origin,
        start=table.start,
    )
    return Traced(motion, standing_headings(motion))
