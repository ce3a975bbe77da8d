"""Directions as arrays see them: spatial frequencies u, steering vectors, their slopes.

Of a linear array u is one number, ``(...)``; of a planar one it is two, ``(..., 2)``.
"""

from __future__ import annotations

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.planar import AntennaArray, PlanarArray
from echobeam.physics.plane import visible
from echobeam.values import Array, ComplexArray

PER_BEAM = 2
"""Directions of the search for each width 1 / n of a beam."""


def steering(array: AntennaArray, u: Array) -> ComplexArray:
    """Return exp(j 2 pi spacing m u), ``(..., n)``, for directions ``(...)`` or ``(..., 2)``."""
    if isinstance(array, PlanarArray):
        return array.steering(u)
    vector: ComplexArray = np.exp(1j * rates(array) * np.asarray(u)[..., None])
    return vector


def rates(array: LinearArray) -> Array:
    """Return the phase slopes 2 pi spacing m of the elements, ``(n,)``."""
    slopes: Array = 2.0 * np.pi * array.spacing * np.arange(array.n, dtype=np.float64)
    return slopes


def slopes_of(array: AntennaArray) -> Array:
    """Return the phase slopes of the elements by each component of u, ``(A, n)``."""
    if isinstance(array, LinearArray):
        return rates(array)[None]
    row, column = np.divmod(np.arange(array.elements), array.columns)
    return 2.0 * np.pi * array.spacing * np.stack([row, column]).astype(np.float64)


def beam_sizes(array: AntennaArray) -> Array:
    """Return the lengths of the array in wavelengths, ``(A,)``: 1 / width of its beams in u."""
    counts = array.shape if isinstance(array, PlanarArray) else (array.n,)
    return np.array(counts, dtype=np.float64) * array.spacing


def search_grid(transmitter: AntennaArray, receiver: AntennaArray) -> Array:
    """Return the directions ``(G,)`` or ``(G, 2)`` of a search, denser than the beams of either.

    Of a planar array they are half as dense along either axis: a cell of the search loses up to
    0.9 dB for each axis and array.
    """
    if isinstance(receiver, LinearArray):
        assert isinstance(transmitter, LinearArray)
        low, high = receiver.visible
        elements = max(transmitter.n * transmitter.spacing, receiver.n * receiver.spacing)
        return np.linspace(low, high, int(np.ceil((high - low) * PER_BEAM * 2.0 * elements)) + 1)
    size = np.maximum(beam_sizes(transmitter), beam_sizes(receiver))
    both = np.maximum(transmitter.shape, receiver.shape)
    # one element sees no difference along its axis
    many = np.where(both > 1, np.ceil(2.0 * PER_BEAM * size) + 1.0, 1.0).astype(int)
    lines = [np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1) for n in many.tolist()]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    margin = 0.5 * np.hypot(*(2.0 / max(n - 1, 1) * (n > 1) for n in many.tolist()))
    near: Array = grid[np.hypot(grid[:, 0], grid[:, 1]) <= 1.0 + margin]
    return visible(near)


def within(array: AntennaArray, u: Array) -> Array:
    """Return directions with those beyond the visible region moved to its edge."""
    return np.clip(u, *array.visible) if isinstance(array, LinearArray) else visible(u)


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
