"""Which states a track may have, and what happens to one that may not."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.plane import GROUND
from echobeam.physics.polar import POLAR, physical
from echobeam.tracking.life import living
from echobeam.values import StateSpace

INSIDE = [1.0, 100.0, 3.0]


@pytest.mark.parametrize(
    ("state", "possible"),
    [
        (INSIDE, True),
        ([1.0, 100.0, -3e8], True),
        ([0.0, 100.0, 3.0], False),
        ([np.pi, 100.0, 3.0], False),
        ([np.nextafter(np.pi, 0.0), 100.0, 3.0], True),
        ([-0.1, 100.0, 3.0], False),
        ([1.0, 0.0, 3.0], False),
        ([1.0, -5.0, 3.0], False),
        ([1.0, np.inf, 3.0], False),
        ([1.0, 100.0, np.nan], False),
        ([np.nan, 100.0, 3.0], False),
    ],
)
def test_physical_states_are_finite_and_below_the_uav(state: list[float], possible: bool) -> None:
    assert physical(np.array(state)) == possible


def test_impossible_and_unknown_objects_are_given_up_and_others_kept() -> None:
    mean = np.array([INSIDE, [-0.1, 100.0, 3.0], INSIDE, INSIDE])
    cov = np.broadcast_to(np.eye(3), (4, 3, 3)).copy()
    cov[3, 1, 1] = np.inf
    known = np.array([True, True, False, True])
    state = living(mean.copy(), cov.copy(), known, POLAR)
    np.testing.assert_array_equal(state.known, [True, False, False, False])
    np.testing.assert_array_equal(state.mean[0], INSIDE)
    np.testing.assert_array_equal(state.cov[0], np.eye(3))
    assert np.isnan(state.mean[1:]).all()
    assert np.isnan(state.cov[1:]).all()


def test_every_variance_of_a_space_counts_and_its_own_rule_alone() -> None:
    """Four components without an angle; negative states, which the paper's space excludes."""
    line = StateSpace(tuple("abcd"), ("m",) * 4, (), lambda state: state[..., 3] < 5.0)
    mean = np.full((3, 4), -7.0)
    mean[1, 3] = 6.0
    cov = np.broadcast_to(np.eye(4), (3, 4, 4)).copy()
    cov[2, 3, 3] = np.inf
    state = living(mean, cov, np.ones(3, dtype=bool), line)
    np.testing.assert_array_equal(state.known, [True, False, False])


def test_no_objects_are_no_trouble() -> None:
    state = living(np.empty((5, 0, 3)), np.empty((5, 0, 3, 3)), np.empty((5, 0), dtype=bool), POLAR)
    assert state.mean.shape == (5, 0, 3)


def test_a_variance_that_rounding_made_negative_ends_its_track():
    mean, cov = np.zeros((2, 4)), np.tile(np.eye(4), (2, 1, 1))
    cov[1, 1, 1] = -1e-3
    found = living(mean, cov, np.array([True, True]), GROUND)
    assert found.known.tolist() == [True, False]
    assert np.isnan(found.mean[1]).all()
