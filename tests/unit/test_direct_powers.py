"""Powers of given shapes: duality, water-filling and floors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ..interpreted import interpreted

uplink = interpreted().powers


def _trial(seed: int, objects: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    power = 1.0 + rng.random(objects)
    leak = 0.1 * rng.random((objects, objects)) * ~np.eye(objects, dtype=bool)
    return power, leak, 0.02 * (1.0 + rng.random(objects))


def _settled(power: np.ndarray, leak: np.ndarray, loss: np.ndarray, floor: float) -> Any:
    share = np.full(loss.size, 1.0 / loss.size)
    powers = uplink.start_powers(loss, np.full(loss.shape, floor), share)
    for _ in range(40):
        uplink.improve(powers, power, leak, False)
    return powers


def _downlink(powers: Any, power: np.ndarray, leak: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    ratio, received = np.empty(power.size), np.empty(power.size)
    assert uplink.downlink(powers, power, leak, ratio, received)
    return ratio, received


def test_downlink_powers_reach_the_uplink_sinr_and_spend_all_power() -> None:
    for seed in range(6):
        power, leak, loss = _trial(seed, 3)
        powers = _settled(power, leak, loss, 0.0)
        sinr, received = _downlink(powers, power, leak)
        np.testing.assert_allclose(received / (loss + received @ leak), sinr, rtol=1e-10)
        np.testing.assert_allclose(np.sum(received * power), 1.0, rtol=1e-12)


def test_without_leaks_the_powers_are_those_of_water_filling() -> None:
    for seed in range(5):
        power, leak, loss = _trial(10 + seed, 4)
        powers = _settled(power, 0.0 * leak, loss, 0.0)
        _, received = _downlink(powers, power, 0.0 * leak)
        ground = loss * power
        low, high = 0.0, 10.0
        for _ in range(100):
            level = 0.5 * (low + high)
            over = np.sum(np.maximum(level - ground, 0.0)) > 1.0
            low, high = (low, level) if over else (level, high)
        expected = np.maximum(low - ground, 0.0)
        np.testing.assert_allclose(received * power, expected, atol=1e-7)


@pytest.mark.slow
def test_floors_that_cannot_be_paid_are_scaled_alike() -> None:
    for seed in range(4):
        power, leak, loss = _trial(20 + seed, 3)
        powers = _settled(power, leak, loss, 1e4)
        sinr, _ = _downlink(powers, power, leak)
        factor = powers.scalars[uplink.FACTOR]
        assert factor < 1.0
        np.testing.assert_allclose(np.log1p(sinr) / np.log1p(1e4), factor, rtol=1e-6)
