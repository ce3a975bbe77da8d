"""Who is served, and in which column."""

import numpy as np
import pytest

from echobeam.traces.motion import Sightings
from echobeam.traces.service import serve


def sightings(positions):
    """Sightings from a table (slot, vehicle) of positions, NaN where a vehicle is not there."""
    table = np.array(positions, dtype=float)
    vehicle, slot = np.nonzero(~np.isnan(table.T))
    position = table[slot, vehicle]
    return Sightings(slot, vehicle, position, 10 * position)


def served(positions, max_objects=2, range_m=100.0, uav_x=0.0):
    slots, vehicles = np.shape(positions)
    names = tuple("abcdefgh"[:vehicles])
    ground = np.broadcast_to(np.asarray(uav_x, dtype=float), (slots,))
    return serve(sightings(positions), names, np.zeros((vehicles, 1)), ground, max_objects, range_m)


def test_nearest_are_served_and_the_rest_are_not():
    motion = served([[30.0, -10.0, 20.0]])
    assert set(motion.identity[0]) == {1, 2}
    assert motion.present.all()


def test_range_counts_both_ways_and_includes_its_end():
    motion = served([[100.0, -100.0, 100.1, np.nan]], max_objects=4)
    assert motion.identity[0].tolist() == [0, 1, -1, -1]


def test_ground_point_may_move():
    motion = served([[0.0, 50.0], [0.0, 50.0]], max_objects=1, uav_x=[10.0, 40.0])
    assert motion.identity[:, 0].tolist() == [0, 1]


def test_ties_are_settled_by_id():
    motion = served([[np.nan, 10.0, -10.0, 10.0]], max_objects=1)
    assert motion.names[motion.identity[0, 0]] == "b"


def test_position_and_velocity_are_the_occupants_own_and_nan_without_one():
    motion = served([[3.0, np.nan], [4.0, -1.0], [np.nan, -2.0]])
    np.testing.assert_array_equal(motion.identity, [[0, -1], [0, 1], [-1, 1]])
    np.testing.assert_array_equal(motion.position, [[3, np.nan], [4, -1], [np.nan, -2]])
    np.testing.assert_array_equal(motion.velocity, [[30, np.nan], [40, -10], [np.nan, -20]])
    np.testing.assert_array_equal(motion.present, motion.identity >= 0)


def test_vehicle_keeps_its_column_while_others_come_and_go():
    nan = np.nan
    motion = served([[1, 2, nan], [nan, 2, nan], [nan, 2, 3], [nan, 2, nan]])
    assert motion.identity[:, 1].tolist() == [1, 1, 1, 1]
    assert motion.identity[:, 0].tolist() == [0, -1, 2, -1]


def test_newcomer_that_pushes_another_out_shows_as_a_change_of_identity():
    motion = served([[10.0, 20.0, 30.0], [10.0, 20.0, 15.0]])
    assert motion.identity.tolist() == [[0, 1], [0, 2]]


def test_vehicle_that_comes_back_takes_the_first_free_column():
    nan = np.nan
    motion = served([[nan, 5.0], [4.0, nan], [4.0, 5.0]])
    assert motion.identity.tolist() == [[1, -1], [0, -1], [0, 1]]


@pytest.mark.parametrize("max_objects", [0, 3])
def test_nobody_there_gives_empty_columns(max_objects):
    motion = served(np.full((4, 2), np.nan), max_objects)
    assert motion.identity.shape == (4, max_objects)
    assert not motion.present.any()
    assert np.isnan(motion.position).all()


def test_zero_columns_serve_nobody():
    assert served([[1.0, 2.0]], max_objects=0).identity.shape == (1, 0)


def test_result_cannot_be_written_to():
    motion = served([[1.0]])
    for values in (motion.identity, motion.position, motion.velocity, motion.present):
        with pytest.raises(ValueError, match="read-only"):
            values[0, 0] = 0
