"""Movers on the ground in two dimensions: at constant acceleration, or along a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.physics.flight import FlightPath, Waypoints
from echobeam.physics.motion import move_along_road
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import ObjectTable
from echobeam.simulation.movers import ALONG, Ground, Mover, slot_at, traced
from echobeam.simulation.randomness import Use, object_normals
from echobeam.values import NOBODY, Array, IntArray, UavState


@dataclass(frozen=True, slots=True)
class OnGround:
    """Objects on the ground, with nature's own noise if asked for.

    Attributes
    ----------
    position, velocity, acceleration
        ``(K, 2)`` m, m/s, m/s^2 at time 0.
    paths
        Paths of the objects that have one, by number; these have no noise.
    slot_duration
        s.
    noise
        Standard deviation of the change of either velocity in a slot, m/s, by an acceleration that
        is constant within it; None for none.
    first, last
        ``(K,)``: slots, counted from 0, in which each object is there first and last.
    """

    position: Array
    velocity: Array
    acceleration: Array
    paths: dict[int, Waypoints]
    slot_duration: float
    noise: float | None
    first: IntArray
    last: IntArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names by number, counted from 1."""
        return tuple(f"object {number}" for number in range(1, len(self.position) + 1))

    def begin(self) -> Ground:
        """Return the objects in the first slot."""
        return self._ground(self.position[None], self.velocity[None], 0)

    def advance(self, ground: Ground, slot: int, uav: UavState, seed: int, trials: range) -> Ground:
        """Return the objects one slot later."""
        place, velocity = ground.position[..., :2], ground.velocity[..., :2]
        moved, faster = move_along_road(place, velocity, self.acceleration, self.slot_duration)
        if self.noise is not None:
            eta = object_normals(seed, trials, slot, Use.PROCESS, ground.identity, 2) * self.noise
            moved = moved + 0.5 * self.slot_duration * eta
            faster = faster + eta
        enters = (self.first == slot + 1)[:, None]
        if enters.any():
            moved = np.where(enters, self.position, moved)
            faster = np.where(enters, self.velocity, faster)
        return self._ground(moved, faster, slot + 1)

    def standing(self, slot: int) -> Array:
        """Return the headings of objects that wait on their paths; the others have velocities."""
        heading = np.tile(ALONG, (len(self.position), 1))
        for index, path in self.paths.items():
            heading[index] = _next_step(path, slot * self.slot_duration, heading[index])
        return heading

    def _ground(self, place: Array, velocity: Array, slot: int) -> Ground:
        number = np.arange(len(self.position))
        there = (self.first <= slot) & (slot <= self.last)
        flat = np.where(there[:, None], 0.0, np.nan)
        position = np.concatenate([place + flat, np.zeros_like(place[..., :1]) + flat], axis=-1)
        motion = np.concatenate([velocity + flat, np.zeros_like(place[..., :1]) + flat], axis=-1)
        for index, path in self.paths.items():
            if there[index]:
                along = path.at(slot)
                position[..., index, :] = along.position
                motion[..., index, :] = along.velocity
        return Ground(position, motion, np.where(there, number, NOBODY))


def ground_mover(scenario: Scenario, flight: FlightPath) -> Mover:
    """Return the mover of a scenario on the ground; this is where a trace is read.

    Raises
    ------
    TraceError
        If the trace cannot be used.
    """
    if scenario.trace is not None:
        return traced(scenario, flight)
    slot, objects = scenario.frame.slot, scenario.objects
    ends = [np.inf if item.leaves is None else item.leaves for item in objects]
    return OnGround(
        position=_pairs([_start(item) for item in objects]),
        velocity=_pairs([item.velocity for item in objects]),
        acceleration=_pairs([item.acceleration for item in objects]),
        paths={
            number: Waypoints(tuple((*point, 0.0) for point in item.path), slot)
            for number, item in enumerate(objects)
            if item.path is not None
        },
        slot_duration=slot,
        noise=scenario.truth_stds[2] if scenario.truth.process_noise else None,
        first=slot_at([item.appears for item in objects], slot),
        last=slot_at(ends, slot) - 1,
    )


def _next_step(path: Waypoints, time: float, otherwise: Array) -> Array:
    """Return the next straight piece ``(3,)`` of a path after a time, s, or else its last one."""
    points = np.array(path.points)
    pieces = np.diff(points[:, 1:], axis=0)
    moves = np.flatnonzero((pieces != 0.0).any(axis=-1))
    if not moves.size:
        return otherwise
    coming = moves[points[1:, 0][moves] > time]
    step: Array = pieces[coming[0] if coming.size else moves[-1]]
    return step


def _start(item: ObjectTable) -> tuple[float, float]:
    if item.path is not None:
        return item.path[0][1:]
    assert item.position is not None
    return item.position


def _pairs(values: list[tuple[float, float]] | list[float | tuple[float, float]]) -> Array:
    """Return vectors ``(K, 2)``; a zero stands for none."""
    pairs = [value if isinstance(value, tuple) else (0.0, 0.0) for value in values]
    return np.array(pairs, dtype=float).reshape(-1, 2)
