import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from echobeam.schemes.matched import water_filling


def test_water_filling_spends_no_more_than_there_is_however_high_the_floors():
    for scale in np.logspace(0, 20, 21):
        floors = scale * np.array([1.0, 1.0 + 1e-15, 3.0])
        powers = water_filling(floors, np.ones(3, dtype=bool), 1e-3)
        assert powers.sum() == pytest.approx(1e-3, rel=1e-12)


@given(
    st.lists(st.floats(0.01, 100.0), min_size=1, max_size=6),
    st.floats(0.01, 100.0),
)
def test_water_filling_meets_its_conditions(floors, power):
    """Powers add up; wet objects stand at one level, dry ones have their floor above it."""
    floor = np.array(floors)
    p = water_filling(floor, np.ones(floor.shape, dtype=bool), power)
    assert p.min() >= 0
    assert p.sum() == pytest.approx(power)
    level = (p + floor)[p > 0]
    assert np.ptp(level) <= 1e-9 * level.max()
    assert (floor[p == 0] >= level.min() * (1 - 1e-9)).all()


def test_water_filling_maximises_the_sum_of_logs():
    floor = np.array([0.3, 1.0, 2.5])
    best = minimize(
        lambda p: -np.log1p(p / floor).sum(),
        np.full(3, 0.5),
        bounds=[(0, None)] * 3,
        constraints={"type": "eq", "fun": lambda p: p.sum() - 1.5},
    )
    p = water_filling(floor, np.ones(3, dtype=bool), 1.5)
    assert np.log1p(p / floor).sum() == pytest.approx(-best.fun, abs=1e-7)
    np.testing.assert_allclose(p, best.x, atol=1e-4)


def test_inactive_objects_get_nothing_and_none_at_all_is_fine():
    floor = np.array([[0.1, 5.0], [0.1, 5.0], [np.nan, 5.0]])
    active = np.array([[True, True], [False, False], [False, True]])
    p = water_filling(floor, active, 1.0)
    np.testing.assert_allclose(p, [[1, 0], [0, 0], [0, 1]])
    assert water_filling(np.zeros((2, 0)), np.zeros((2, 0), dtype=bool), 1.0).shape == (2, 0)
