"""Geometry of the ground: frames of the array, directions, measurements, and what is behind."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.plane import GROUND_GEOMETRY, GroundGeometry, facing, visible
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import UavState

UAV = UavState(np.array([5.0, -3.0, 100.0]), np.array([4.0, 2.0, -6.0]))
STATES = np.array([[45.0, 27.0, 20.0, 5.0], [85.0, -63.0, -4.0, 11.0], [5.0, -3.0, 1.0, 0.0]])
FACINGS = [(0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (3.0, 4.0, -5.0), (0.0, 0.0, 2.0), (-1.0, 0.0, -0.1)]


@pytest.mark.parametrize("direction", FACINGS)
def test_frames_are_orthonormal_and_the_normal_is_where_the_array_faces(direction):
    geometry = facing(direction)
    frame = np.array([geometry.along_rows, geometry.along_columns, geometry.normal])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(frame[2], np.array(direction) / np.linalg.norm(direction))
    np.testing.assert_allclose(np.cross(frame[2], frame[1]), frame[0], atol=1e-12)
    assert geometry.along_columns[2] == 0.0


def test_down_has_u_along_x_and_ahead_has_u_upwards():
    assert facing((0.0, 0.0, -3.0)) == GROUND_GEOMETRY
    ahead = facing((1.0, 0.0, 0.0))
    assert (ahead.along_rows, ahead.along_columns) == ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


@pytest.mark.parametrize("direction", FACINGS)
def test_a_place_is_the_projection_of_the_line_of_sight(direction):
    geometry = facing(direction)
    offset = np.column_stack([STATES[:, :2], np.zeros(3)]) - UAV.position
    distance = np.linalg.norm(offset, axis=-1)
    sight = offset / distance[:, None]
    behind = sight @ np.array(geometry.normal) <= 0.0
    place = geometry.place(STATES, UAV)
    np.testing.assert_allclose(place[:, 0], sight @ np.array(geometry.along_rows), atol=1e-14)
    np.testing.assert_allclose(place[:, 1], sight @ np.array(geometry.along_columns), atol=1e-14)
    np.testing.assert_array_equal(place[:, 2], np.where(behind, np.inf, distance))
    np.testing.assert_allclose(geometry.sight(place[~behind, :2]), sight[~behind], atol=1e-7)


def test_an_array_on_a_line_sees_all_around():
    assert np.isfinite(GroundGeometry(normal=None).place(STATES, UAV)).all()


def test_delay_and_doppler_are_those_of_the_distance_and_its_change():
    value = GROUND_GEOMETRY.ideal(STATES, UAV, 30e9)
    step = 1e-5

    def distance(time):
        moved = np.column_stack([STATES[:, :2] + time * STATES[:, 2:], np.zeros(3)])
        return np.linalg.norm(moved - UAV.position - time * UAV.velocity, axis=-1)

    np.testing.assert_allclose(value[:, 2], 2.0 * distance(0.0) / SPEED_OF_LIGHT)
    closing = (distance(-step) - distance(step)) / (2.0 * step)
    np.testing.assert_allclose(value[:, 3], 2.0 * 30e9 / SPEED_OF_LIGHT * closing, rtol=1e-6)


def test_a_measurement_beyond_the_visible_region_is_taken_at_its_edge():
    value = np.array([[0.9, 0.9, 1e-6, 0.0], [0.1, np.nan, 1e-6, 0.0], [0.3, -0.4, 1e-6, 0.0]])
    place = GROUND_GEOMETRY.measured_place(value)
    np.testing.assert_allclose(place[0, :2], np.sqrt(0.5))
    np.testing.assert_array_equal(place[1, :2], [0.1, 0.0])
    np.testing.assert_array_equal(place[2, :2], [0.3, -0.4])
    np.testing.assert_allclose(place[:, 2], 0.5 * SPEED_OF_LIGHT * 1e-6)
    np.testing.assert_array_equal(visible(np.zeros((1, 2))), np.zeros((1, 2)))


def test_absent_objects_have_no_place():
    assert np.isnan(GROUND_GEOMETRY.place(np.full((2, 4), np.nan), UAV)).all()
