"""Scores of tracks: pairs that persist, who goes first, and mirror images of a vertical array."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.array import LinearArray
from echobeam.physics.measurement import measure
from echobeam.simulation.scoring import (
    CUTOFF,
    Score,
    about_objects,
    distances,
    place,
    scored,
    unscored,
)
from echobeam.tracking.measurement import measurement_jacobian
from echobeam.values import NOBODY, Status, Tracks, UavState

HEIGHT = 100.0
UAV = UavState(np.array([0.0, 0.0, HEIGHT]), np.array([12.0, 0.0, -3.0]))
CONFIRMED, TENTATIVE, COASTING = Status.CONFIRMED, Status.TENTATIVE, Status.COASTING


def state_at(x, velocity=0.0):
    """Polar states of places along the road, m from below the UAV."""
    x = np.asarray(x, dtype=float)
    return np.stack([np.arctan2(HEIGHT, x), np.hypot(HEIGHT, x), velocity + 0.0 * x], axis=-1)


def tracks_at(places, status=CONFIRMED, ids=None) -> Tracks:
    """Tracks of one trial, NaN for an empty column."""
    x = np.array(places, dtype=float)[None]
    known = np.isfinite(x)
    status = np.where(known, np.broadcast_to(np.array(status), x.shape), 0).astype(np.int8)
    numbers = np.arange(x.size) + 50 if ids is None else np.array(ids)
    cov = np.where(known[..., None, None], np.eye(3), np.nan)
    return Tracks(state_at(x), cov, status, np.where(known, numbers, NOBODY))


def story(slots, axis="horizontal"):
    """Return the object of each track after each slot of (tracks, places of the objects)."""
    score, found = unscored(1), []
    for tracks, objects in slots:
        x = np.array(objects, dtype=float)
        identity = np.where(np.isfinite(x), np.arange(x.size), NOBODY)
        score = scored(tracks, state_at(x)[None], identity, score, axis)
        found.append(score.identity[0].tolist())
    return found


def test_a_pair_stays_while_it_is_within_the_cutoff_though_others_are_nearer():
    """Two tracks drift on to each other's objects: within 10 m each keeps its own."""
    objects = [0.0, 8.0]
    slots = [(tracks_at([start, 8.0 - start]), objects) for start in (0.0, 3.0, 5.0, 8.0)]
    assert story(slots) == [[0, 1]] * 4
    slots += [(tracks_at([10.5, -2.5]), objects)]
    assert story(slots)[-1] == [1, 0]  # beyond it each is about the other object
    slots += [(tracks_at([6.0, 2.0]), objects)]
    assert story(slots)[-1] == [1, 0]


def test_beyond_the_cutoff_a_track_is_about_nobody():
    assert story([(tracks_at([CUTOFF - 0.01]), [0.0]), (tracks_at([CUTOFF + 0.01]), [0.0])]) == [
        [0],
        [NOBODY],
    ]


def test_a_pair_that_stays_is_worth_more_than_two_new_ones():
    """The object of track 50 is nearest to a new track, whose other object is near 50."""
    before = (tracks_at([0.0, np.nan]), [1.0, np.nan])
    assert story([before, (tracks_at([9.0, 0.5]), [0.0, 9.5])])[1] == [0, 1]
    assert story([before, (tracks_at([9.0, 0.5]), [0.0, 14.0])])[1] == [0, NOBODY]


def test_confirmed_and_coasting_tracks_go_before_tentative_ones():
    for status in (CONFIRMED, COASTING):
        assert story([(tracks_at([0.1, 9.0], [TENTATIVE, status]), [0.0])]) == [[NOBODY, 0]]
    assert story([(tracks_at([0.1, 9.0], [TENTATIVE, TENTATIVE]), [0.0])]) == [[0, NOBODY]]
    assert story([(tracks_at([0.1], [TENTATIVE]), [0.0])]) == [[0]]


def test_the_nearest_of_confirmed_tracks_is_an_objects():
    assert story([(tracks_at([3.0, 1.0, -2.0]), [0.0])]) == [[NOBODY, 0, NOBODY]]
    assert story([(tracks_at([3.0, 6.0]), [4.0, 1.0])]) == [[1, 0]]


def test_an_identity_is_remembered_by_track_and_not_by_column():
    first = (tracks_at([0.0, 8.0], ids=[4, 7]), [0.0, 8.0])
    swapped = (tracks_at([5.0, 3.0], ids=[7, 4]), [0.0, 8.0])
    assert story([first, swapped]) == [[0, 1], [1, 0]]
    new = (tracks_at([5.0, 3.0], ids=[8, 9]), [0.0, 8.0])  # others: the nearest are theirs
    assert story([first, new]) == [[0, 1], [1, 0]]


def test_nobody_is_scored_where_there_is_nobody():
    assert story([(tracks_at([0.0, np.nan]), [np.nan, np.nan])]) == [[NOBODY, NOBODY]]
    assert story([(tracks_at([np.nan]), [0.0])]) == [[NOBODY]]
    empty = unscored(3)
    np.testing.assert_array_equal(empty.of(np.array([[1], [2], [NOBODY]])), NOBODY)
    score = Score(np.array([[5, NOBODY]]), np.array([[2, NOBODY]]))
    assert score.of(np.array([[5, 6, NOBODY]])).tolist() == [[2, NOBODY, NOBODY]]


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_a_mirror_image_is_the_object_of_a_vertical_array_alone(axis):
    found = story([(tracks_at([-40.0]), [40.0])], axis)
    assert found == [[0 if axis == "vertical" else NOBODY]]


def test_distances_are_those_on_the_ground():
    rng = np.random.default_rng(2)
    tracks, objects = rng.uniform(-80.0, 80.0, (2, 5))
    away = distances(state_at(tracks), state_at(objects), "horizontal")
    np.testing.assert_allclose(away, np.abs(tracks[:, None] - objects), atol=1e-10)
    away = distances(state_at(tracks), state_at(objects), "vertical")
    direct, mirrored = np.abs(tracks[:, None] - objects), np.abs(tracks[:, None] + objects)
    np.testing.assert_allclose(away, np.minimum(direct, mirrored), atol=1e-10)
    np.testing.assert_allclose(
        place(state_at(tracks), "horizontal"),
        np.stack([tracks, np.full(5, HEIGHT)], axis=-1),
        atol=1e-10,
    )


def seen(state):
    """What a vertical array can measure of a state: sine of the angle, delay and Doppler shift."""
    value = measure(*np.moveaxis(state, -1, 0), UAV.speed, UAV.heading, 30e9)
    return np.stack([np.sin(value[..., 0]), value[..., 1], value[..., 2]], axis=-1)


def test_a_mirrored_track_is_recorded_as_the_state_that_measures_alike():
    x = np.array([40.0, -25.0])
    truth = np.concatenate([state_at(x[:1], 8.0), state_at(x[1:], -6.0)])
    tracks = tracks_at(-x)
    array = LinearArray(8)
    for column in range(2):
        # The velocity with which the image is measured alike, found without the code's formula.
        mean = tracks.mean[0, column]
        slope = (
            seen(np.array([mean[0], mean[1], 1.0]))[2] - seen(np.array([mean[0], mean[1], 0]))[2]
        )
        mean[2] = (seen(truth[column])[2] - seen(np.array([mean[0], mean[1], 0.0]))[2]) / slope
    np.testing.assert_allclose(seen(tracks.mean[0]), seen(truth), rtol=1e-9)
    np.testing.assert_allclose(
        array.steering(tracks.mean[0, :, 0]), array.steering(truth[:, 0]), atol=1e-9
    )
    identity = np.array([0, 1])
    score = scored(tracks, truth[None], identity, unscored(1), "vertical")
    assert score.identity.tolist() == [[0, 1]]
    recorded = about_objects(tracks, score, truth[None], identity, UAV, "vertical")
    np.testing.assert_allclose(recorded.mean[0], truth, rtol=1e-9)
    assert recorded.id.tolist() == [[0, 1]]


def test_the_covariance_of_a_mirrored_track_explains_the_same_measurements():
    """H P H^T of the image is that of the track with the angle's sign turned."""
    root = np.random.default_rng(1).normal(size=(3, 3)) * np.array([[1e-3], [0.3], [2.0]])
    truth = state_at(np.array([40.0]), 8.0)
    tracks = tracks_at([-40.0])
    tracks.mean[0, 0, 2] = 2.0 * 12.0 - 8.0
    tracks.cov[0, 0] = root @ root.T
    identity = np.array([0])
    score = scored(tracks, truth[None], identity, unscored(1), "vertical")
    recorded = about_objects(tracks, score, truth[None], identity, UAV, "vertical")
    jacobians = [
        measurement_jacobian(one, UAV.speed, UAV.heading, 30e9)
        for one in (tracks.mean[0, 0], recorded.mean[0, 0])
    ]
    turn = np.diag([-1.0, 1.0, 1.0])
    one = turn @ jacobians[0] @ tracks.cov[0, 0] @ jacobians[0].T @ turn
    other = jacobians[1] @ recorded.cov[0, 0] @ jacobians[1].T
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_track_on_the_right_side_is_left_as_it_is_and_one_of_nobody_left_out():
    tracks = tracks_at([40.0, 70.0])
    truth, identity = state_at(np.array([41.0]), 8.0), np.array([3])
    score = scored(tracks, truth[None], identity, unscored(1), "vertical")
    recorded = about_objects(tracks, score, truth[None], identity, UAV, "vertical")
    np.testing.assert_array_equal(recorded.mean[0, 0], tracks.mean[0, 0])
    np.testing.assert_array_equal(recorded.cov[0, 0], tracks.cov[0, 0])
    assert recorded.id.tolist() == [[3, NOBODY]]
    assert recorded.known.tolist() == [[True, False]]
