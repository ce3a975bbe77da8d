"""Directions as linear arrays see them: the spatial frequency u, steering vectors, their slopes."""

from __future__ import annotations

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.values import Array, ComplexArray

PER_BEAM = 2
"""Directions of the search for each width 1 / n of a beam."""


def steering(array: LinearArray, u: Array) -> ComplexArray:
    """Return exp(j 2 pi spacing m u), ``(..., n)``, and so for directions ``(...)``."""
    vector: ComplexArray = np.exp(1j * rates(array) * np.asarray(u)[..., None])
    return vector


def rates(array: LinearArray) -> Array:
    """Return the phase slopes 2 pi spacing m of the elements, ``(n,)``."""
    slopes: Array = 2.0 * np.pi * array.spacing * np.arange(array.n, dtype=np.float64)
    return slopes


def search_grid(transmitter: LinearArray, receiver: LinearArray) -> Array:
    """Return the directions ``(G,)`` of a search, denser than the beams of either array."""
    low, high = receiver.visible
    elements = max(transmitter.n * transmitter.spacing, receiver.n * receiver.spacing)
    return np.linspace(low, high, int(np.ceil((high - low) * PER_BEAM * 2.0 * elements)) + 1)


def angle_of(array: LinearArray, u: Array) -> Array:
    """Return the angle ``(...)`` rad of a direction; of a vertical array that below 90 degrees."""
    angle: Array = np.arcsin(u) if array.axis == "vertical" else np.arccos(u)
    return angle


def mirrored(array: LinearArray, angle: Array, near: Array) -> Array:
    """Return the angle or its mirror image, whichever is nearer to another angle.

    A vertical array cannot tell theta from pi - theta; where ``near`` is NaN the angle stays.
    """
    if array.axis != "vertical":
        return angle
    behind = np.abs(np.pi - angle - near) < np.abs(angle - near)
    return np.where(behind, np.pi - angle, angle)
