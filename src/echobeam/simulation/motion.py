"""What moves: the UAV's path and the objects' true states over all slots of a block of trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echobeam.physics.motion import UavPath, initial_distance, move_object, uav_path
from echobeam.scenario.load import trace_path
from echobeam.scenario.model import Scenario
from echobeam.simulation.randomness import Stream, standard_normals
from echobeam.traces import load_motion, road_between
from echobeam.values import Array, BoolArray, IntArray, UavMotion


@dataclass(frozen=True, slots=True)
class Motion:
    """The truth of a block of trials.

    Attributes
    ----------
    path
        The UAV's flight, one entry per slot.
    truth
        ``(T, n, K, S)``: true states; NaN where nobody is in the scene. The leading axis has
        length one when all trials share the same motion.
    present
        ``(n, K)``: whether somebody is there.
    identity
        ``(n, K)``: who; -1 for nobody. A change means that one object left.
    """

    path: UavPath
    truth: Array
    present: BoolArray
    identity: IntArray

    def uav(self, slot: int) -> UavMotion:
        """Return the UAV's own motion in a slot, counted from 0."""
        return UavMotion(float(self.path.speed[slot]), float(self.path.heading[slot]))

    def arrived(self, slot: int) -> BoolArray:
        """Return ``(K,)``: columns with another occupant than one slot before."""
        if slot == 0:
            return np.zeros(self.identity.shape[1], dtype=bool)
        changed: BoolArray = self.identity[slot] != self.identity[slot - 1]
        return changed


def plan_motion(scenario: Scenario, seed: int, trials: Sequence[int]) -> Motion:
    """Return the motion of a scenario's UAV and objects for some trials."""
    uav = scenario.uav
    path = uav_path(
        uav.height, uav.speed, uav.heading, scenario.frame.slot, scenario.n_slots, uav.floor
    )
    if scenario.trace is not None:
        return _traced(scenario, path)
    truth = _kinematic(scenario, path, seed, trials)
    shape = truth.shape[1:3]
    identity = np.broadcast_to(np.arange(shape[1]), shape)
    return Motion(path, truth, np.ones(shape, dtype=bool), identity)


def _kinematic(scenario: Scenario, path: UavPath, seed: int, trials: Sequence[int]) -> Array:
    """Return the exact motion at constant acceleration, plus process noise if asked for."""
    noise = _process_noise(scenario, seed, trials)
    angle = np.array([item.angle for item in scenario.objects])
    velocity = np.array([item.velocity for item in scenario.objects])
    acceleration = np.array([item.acceleration for item in scenario.objects])
    state = np.stack([angle, initial_distance(angle, scenario.uav.height), velocity], axis=-1)
    state = np.broadcast_to(state, (noise.shape[0], *state.shape))
    truth = [state]
    for slot in range(scenario.n_slots - 1):
        moved = move_object(
            state[..., 0],
            state[..., 1],
            state[..., 2],
            acceleration,
            path.speed[slot],
            path.heading[slot],
            scenario.frame.slot,
        )
        state = np.stack(moved, axis=-1) + noise[:, slot]
        truth.append(state)
    return np.stack(truth, axis=1)


def _process_noise(scenario: Scenario, seed: int, trials: Sequence[int]) -> Array:
    """Return eta of Eq. (35), ``(T, n, K, S)``; one trial of zeros if nature adds none."""
    shape = (scenario.n_slots, len(scenario.objects), 3)
    if not scenario.truth.process_noise:
        return np.zeros((1, *shape))
    std = [
        scenario.filter.angle_std,
        scenario.filter.distance_std,
        scenario.filter.velocity_std,
    ]
    noise: Array = standard_normals(seed, trials, Stream.PROCESS, shape) * np.array(std)
    return noise


def _traced(scenario: Scenario, path: UavPath) -> Motion:
    """Return the motion of the vehicles that a trace moves past the UAV."""
    table, file = scenario.trace, trace_path(scenario)
    assert table is not None
    assert file is not None
    trace = load_motion(
        file,
        scenario.frame.slot * np.arange(scenario.n_slots),
        uav_x=path.x,
        max_objects=table.max_objects,
        range_m=table.range,
        road=None if table.road is None else road_between(table.road[:2], table.road[2:]),
        origin=table.origin,
        start=table.start,
    )
    x = trace.position - path.x[:, None]
    height = np.where(trace.present, path.height[:, None], np.nan)
    state = np.stack([np.arctan2(height, x), np.hypot(height, x), trace.velocity], axis=-1)
    return Motion(path, state[None], trace.present, trace.identity)
