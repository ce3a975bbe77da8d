"""Matched ("needle") beams with water-filling power."""

from __future__ import annotations

import numpy as np

from echobeam.physics.coordinates import direction_of, distance_of
from echobeam.schemes.base import System
from echobeam.values import Array, BoolArray, ComplexArray, aligned


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


def matched_beams(
    place: Array, active: BoolArray, system: System, share: Array | None = None
) -> ComplexArray:
    """Return ``(..., K, N)`` beams w_k = sqrt(p_k / N) a(theta_k), interference ignored.

    Of two polarisations the first has all the power: any division of it gives the same.

    Parameters
    ----------
    place
        ``(..., K, A + 1)`` or more: where the objects are believed to be; ignored where not active.
    active, system
        Objects to be served, and the equipment.
    share
        ``(...)``: part of the power in all directions, see `System.loss`.
    """
    array = system.transmitter
    loss = np.where(active, system.loss(distance_of(place, array.axes), share), 1.0)
    seen = active & np.isfinite(loss)
    power = water_filling(loss / array.elements, seen, system.radio.power)
    direction = direction_of(place, array.axes)
    steering = array.steering(np.where(aligned(active, direction), direction, 0.0))
    beams = np.zeros((*active.shape, array.n), dtype=np.complex128)
    beams[..., : array.elements] = np.sqrt(power / array.elements)[..., None] * steering
    return beams
