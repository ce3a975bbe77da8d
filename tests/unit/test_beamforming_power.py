from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from echobeam.beamforming.power import least_powers, repair_powers, spend, water_filling


@pytest.mark.parametrize("seed", range(6))
def test_water_filling_is_the_constrained_maximum_that_scipy_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(1, 5))
    gains, loss = rng.uniform(1, 30, size), 10.0 ** rng.uniform(-2, 2, size)
    least = rng.uniform(0, 1, size) * rng.uniform(0, 0.9) / size
    powers, level = water_filling(gains, loss, least)
    assert powers.sum() == pytest.approx(1.0, abs=1e-12)
    assert np.all(powers >= least)

    def lost(q: np.ndarray) -> float:
        return -float(np.sum(np.log1p(gains * q / loss)))

    found = minimize(
        lost,
        np.maximum(least, (1 - least.sum()) / size),
        bounds=[(float(a), 1.0) for a in least],
        constraints={"type": "eq", "fun": lambda q: q.sum() - 1},
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert -lost(powers) >= -found.fun - 1e-9
    assert level >= np.min(least + loss / gains)


def test_weak_channels_get_nothing_when_water_is_low() -> None:
    powers, _ = water_filling(np.array([1.0, 1.0]), np.array([0.1, 5.0]), np.zeros(2))
    np.testing.assert_allclose(powers, [1.0, 0.0])


def test_least_powers_meet_every_floor_with_equality_and_no_powers_are_smaller() -> None:
    gains = np.array([[20.0, 0.4, 0.1], [0.2, 15.0, 0.3], [0.5, 0.1, 25.0]])
    loss, threshold = np.array([0.3, 0.5, 0.2]), np.array([2.0, 1.0, 0.0])
    powers = least_powers(gains, loss, threshold)
    assert powers is not None
    own = np.diagonal(gains) * powers
    np.testing.assert_allclose(
        own / (gains @ powers - own + loss), threshold, rtol=1e-12, atol=1e-12
    )
    weight = threshold[:, None] * (gains - np.diag(np.diagonal(gains)))
    programme = linprog(
        np.ones(3), A_ub=weight - np.diag(np.diagonal(gains)), b_ub=-threshold * loss
    )
    assert powers.sum() == pytest.approx(programme.fun, rel=1e-9)


def test_floors_that_interference_forbids_have_no_powers() -> None:
    # SINR of both above one in the same direction: impossible at any power.
    assert least_powers(np.full((2, 2), 3.0), np.ones(2), np.full(2, 1.5)) is None
    assert least_powers(np.full((2, 2), 3.0), np.ones(2), np.full(2, 1.0)) is None


def test_spend_uses_the_whole_budget_and_meets_the_floors() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        gains = rng.uniform(0, 0.3, (3, 3)) + np.diag(rng.uniform(5, 20, 3))
        loss, threshold = rng.uniform(0.01, 1, 3), rng.uniform(0, 2, 3)
        powers = spend(gains, loss, threshold)
        least = least_powers(gains, loss, threshold)
        if powers is None:
            assert least is None or least.sum() > 1.0
            continue
        own = np.diagonal(gains) * powers
        assert powers.sum() == pytest.approx(1.0, rel=1e-9)
        assert np.all(own / (gains @ powers - own + loss) >= threshold * (1 - 1e-9))


def test_settle_mends_last_digits_without_exceeding_the_budget() -> None:
    gains = np.array([[20.0, 0.4], [0.2, 15.0]])
    loss = np.array([0.3, 0.5])
    threshold = np.array([2.0, 1.0])
    least = least_powers(gains, loss, threshold)
    assert least is not None
    rest = 1.0 - least.sum()
    powers = repair_powers(
        gains, loss, threshold, np.array([least[0] * (1 - 1e-7), least[1] + rest])
    )
    own = np.diagonal(gains) * powers
    assert powers.sum() <= 1.0
    assert np.all(own / (gains @ powers - own + loss) >= threshold * (1 - 1e-13))


def test_settle_of_floors_out_of_reach_ends_and_stays_in_the_budget() -> None:
    powers = repair_powers(np.full((2, 2), 3.0), np.ones(2), np.full(2, 9.0), np.array([0.5, 0.5]))
    assert np.all(np.isfinite(powers))
    assert powers.sum() <= 1.0 + 1e-12


def test_water_filling_keeps_its_digits_however_strong_the_noise() -> None:
    powers, _ = water_filling(np.array([4.0, 4.0, 2.0]), np.full(3, 1e18), np.zeros(3))
    np.testing.assert_allclose(powers, [0.5, 0.5, 0.0], rtol=1e-12)
