"""Matched ("needle") beams with water-filling power."""

from __future__ import annotations

import numpy as np

from echobeam.schemes.base import System
from echobeam.values import Array, BoolArray, ComplexArray


def water_filling(floor: Array, active: BoolArray, power: float) -> Array:
    """Return the powers p_k = max(0, nu - floor_k) with sum ``power`` over the active objects.

    Parameters
    ----------
    floor
        ``(..., K)``: noise over gain of each object.
    active
        ``(..., K)``: the objects that may get power; none active gives no power.
    power
        The total.
    """
    if floor.shape[-1] == 0:
        return np.zeros(floor.shape)
    # From the lowest floor up: where floors are many times the power, digits would be lost.
    lowest = np.min(np.where(active, floor, np.inf), axis=-1, keepdims=True)
    heights = np.where(active, floor, np.inf) - np.where(np.isfinite(lowest), lowest, 0.0)
    order = np.sort(heights, axis=-1)
    finite = np.isfinite(order)
    count = np.arange(1, order.shape[-1] + 1)
    level = (power + np.cumsum(np.where(finite, order, 0.0), axis=-1)) / count
    wet = finite & (level > np.where(finite, order, np.inf))
    n_wet = wet.sum(axis=-1, keepdims=True)
    surface = np.take_along_axis(level, np.maximum(n_wet - 1, 0), axis=-1)
    return np.where(active, np.maximum(surface - np.where(active, heights, 0.0), 0.0), 0.0)


def matched_beams(angle: Array, loss: Array, active: BoolArray, system: System) -> ComplexArray:
    """Return ``(..., K, N)`` beams w_k = sqrt(p_k / N) a(theta_k), interference ignored.

    Parameters
    ----------
    angle
        ``(..., K)`` rad: where the objects are believed to be; ignored where not active.
    loss
        ``(..., K)``: noise over path gain, see `echobeam.physics.link.channel_loss`.
    """
    array = system.transmitter
    power = water_filling(np.where(active, loss, 1.0) / array.n, active, system.radio.power)
    steering = array.steering(np.where(active, angle, 0.0))
    return np.sqrt(power / array.n)[..., None] * steering
