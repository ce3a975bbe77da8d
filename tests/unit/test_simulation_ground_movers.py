"""Motion on the ground: objects at constant acceleration and on paths, UAVs past waypoints."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics.flight import StraightFlight, Waypoints
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin

SLOT = 0.01


def positions(objects, slots=6, trials=1, seed=0, **changes):
    scenario = eb.load_scenario("ground").replace(
        {"objects": objects, "frame.slots_per_frame": slots, **changes}
    )
    world, found = begin(scene_of(scenario), seed, range(trials)), []
    for slot in range(slots):
        found.append((world.ground.position, world.ground.velocity, world.identity))
        if slot + 1 < slots:
            world = world.advance()
    return found


def test_constant_acceleration_is_that_of_the_closed_form():
    one = {"position": [1, 2], "velocity": [30, -4], "acceleration": [-3, 5]}
    for slot, (position, velocity, _) in enumerate(positions([one])):
        t = SLOT * slot
        expected = np.array([1 + 30 * t - 1.5 * t**2, 2 - 4 * t + 2.5 * t**2, 0.0])
        np.testing.assert_allclose(position[0, 0], expected, rtol=1e-12)
        np.testing.assert_allclose(velocity[0, 0], [30 - 3 * t, -4 + 5 * t, 0.0])


def test_a_path_is_straight_between_its_points_and_waits_at_its_ends():
    path = [["10 ms", 0, 0], ["30 ms", 2, 0], ["40 ms", 2, 5]]
    found = positions([{"path": path}])
    places = [position[0, 0, :2].tolist() for position, _, _ in found]
    np.testing.assert_allclose(places, [[0, 0], [0, 0], [1, 0], [2, 0], [2, 5], [2, 5]], atol=1e-12)
    for (here, velocity, _), (there, _, _) in pairwise(found):
        np.testing.assert_allclose(here + SLOT * velocity, there, atol=1e-12)


def test_objects_come_and_go():
    late = {"position": [5, 6], "velocity": [10, 0], "appears": "20 ms", "leaves": "40 ms"}
    path = {"path": [[0, 1, 1], [1, 2, 2]], "leaves": "30 ms"}
    found = positions([late, path])
    assert [identity.tolist() for _, _, identity in found] == [
        [-1, 1], [-1, 1], [0, 1], [0, -1], [-1, -1], [-1, -1],
    ]  # fmt: skip
    np.testing.assert_array_equal(found[2][0][0, 0], [5.0, 6.0, 0.0])
    assert np.isnan(found[0][0][0, 0]).all()
    assert np.isnan(found[4][0]).all()


def test_process_noise_is_a_white_acceleration_and_leaves_paths_alone():
    objects = [{"position": [0, 0], "velocity": [10, 0]}, {"path": [[0, 1, 1], [1, 2, 2]]}]
    noise = {"truth.process_noise": True, "filter.velocity_std": 2.0}
    found = positions(objects, slots=2, trials=4000, seed=3, **noise)
    change = found[1][1][:, 0, :2] - [10.0, 0.0]
    error = 5.0 * 2.0 / np.sqrt(2 * 4000)  # of a standard deviation: five of its own
    np.testing.assert_allclose(change.std(axis=0), 2.0, atol=error)
    moved = found[1][0][:, 0, :2] - [SLOT * 10.0, 0.0]
    np.testing.assert_allclose(moved, 0.5 * SLOT * change, atol=1e-12)
    np.testing.assert_allclose(found[1][0][:, 1, :2], 1.0 + SLOT)


def test_a_straight_flight_keeps_its_velocity():
    flight = StraightFlight((1.0, 2.0, 90.0), (3.0, -4.0, 5.0), SLOT)
    uav = flight.at(50)
    np.testing.assert_allclose(uav.position, [2.5, 0.0, 92.5])
    np.testing.assert_array_equal(uav.velocity, [3.0, -4.0, 5.0])


@pytest.mark.parametrize("slot", range(9))
def test_waypoints_are_passed_in_time_and_velocities_lead_from_slot_to_slot(slot):
    points = ((0.02, 0.0, 0.0, 100.0), (0.05, 3.0, 0.0, 100.0), (0.07, 3.0, 4.0, 90.0))
    flight = Waypoints(points, SLOT)
    here, there = flight.at(slot), flight.at(slot + 1)
    np.testing.assert_allclose(here.position + SLOT * here.velocity, there.position, atol=1e-12)
    expected = {0: (0, 0, 100), 2: (0, 0, 100), 5: (3, 0, 100), 6: (3, 2, 95), 8: (3, 4, 90)}
    if slot in expected:
        np.testing.assert_allclose(here.position, expected[slot], atol=1e-12)


def test_the_doppler_is_that_of_a_flying_uav():
    """Delays of slots that follow each other, against the Doppler: the mean of both ends."""
    scenario = eb.load_scenario("ground").replace(
        {"uav": {"waypoints": [[0, 0, 0, 100], [1, 30, -20, 70]]}}
    )
    world = begin(scene_of(scenario), 0, range(1))
    first, second = world.ideal(), world.advance().ideal()
    rate = (second[..., 2] - first[..., 2]) / SLOT
    middle = 0.5 * (first[..., 3] + second[..., 3])
    np.testing.assert_allclose(-rate * scenario.radio.carrier, middle, rtol=1e-4)
