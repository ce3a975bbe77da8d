from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct import uplink


def _trial(rng: np.random.Generator, trials: int, objects: int) -> tuple[np.ndarray, ...]:
    power = 1.0 + rng.random((trials, objects))
    leak = 0.1 * rng.random((trials, objects, objects)) * ~np.eye(objects, dtype=bool)
    return power, leak, 0.02 * (1.0 + rng.random((trials, objects)))


def _settled(power: np.ndarray, leak: np.ndarray, loss: np.ndarray, floor: float) -> uplink.Uplink:
    powers = uplink.start_uplink(loss, np.full(loss.shape, floor))
    for _ in range(40):
        uplink.step(powers, power, leak)
    return powers


def test_downlink_powers_reach_the_uplink_sinr_and_spend_all_power() -> None:
    power, leak, loss = _trial(np.random.default_rng(0), 6, 3)
    powers = _settled(power, leak, loss, 0.0)
    sinr, received = uplink.downlink(powers, power, leak)
    heard = np.einsum("tk,tki->ti", received, leak)
    np.testing.assert_allclose(received / (loss + heard), sinr, rtol=1e-10)
    np.testing.assert_allclose(np.sum(received * power, axis=1), 1.0, rtol=1e-12)


def test_without_leaks_the_powers_are_those_of_water_filling() -> None:
    power, leak, loss = _trial(np.random.default_rng(1), 5, 4)
    powers = _settled(power, 0.0 * leak, loss, 0.0)
    _, received = uplink.downlink(powers, power, 0.0 * leak)
    for trial in range(5):
        ground = loss[trial] * power[trial]
        low, high = 0.0, 10.0
        for _ in range(100):
            level = 0.5 * (low + high)
            over = np.sum(np.maximum(level - ground, 0.0)) > 1.0
            low, high = (low, level) if over else (level, high)
        expected = np.maximum(low - ground, 0.0)
        np.testing.assert_allclose(received[trial] * power[trial], expected, atol=1e-7)


def test_floors_that_cannot_be_paid_are_scaled_alike() -> None:
    power, leak, loss = _trial(np.random.default_rng(2), 4, 3)
    powers = _settled(power, leak, loss, 1e4)
    sinr, _ = uplink.downlink(powers, power, leak)
    assert np.all(powers.factor < 1.0)
    rates = np.log1p(sinr) / np.log1p(1e4)
    np.testing.assert_allclose(rates, powers.factor[:, None] + 0.0 * rates, rtol=1e-6)
