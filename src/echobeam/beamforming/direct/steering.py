"""Real steering vectors of unit norm, and antenna weights: see `subspace`, one beam at a time."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.compiling import compiled
from echobeam.values import Array, ComplexArray


@compiled
def fill_steering(phase: Array, columns: int, vector: Array) -> None:
    """Fill ``(N,)`` with the real steering vector of unit norm, `subspace.real_steering`.

    Parameters
    ----------
    phase
        ``(1,)`` or ``(2,)`` rad: phase steps between neighbouring rows (planar arrays) and columns.
    columns
        Number of elements in a row.
    vector
        Filled.
    """
    n_tx = vector.size
    half = n_tx // 2
    odd = n_tx % 2
    along, across = phase[phase.size - 1], phase[0] if phase.size > 1 else 0.0
    middle_row, middle_column = 0.5 * (n_tx // columns - 1), 0.5 * (columns - 1)
    scale = np.sqrt(2.0 / n_tx)
    turn = complex(np.cos(along), np.sin(along))
    value = 0.0j
    if odd:
        vector[0] = 1.0 / np.sqrt(n_tx)
    for place in range(half):
        row, column = (half + odd + place) // columns, (half + odd + place) % columns
        if place == 0 or column == 0:
            start = (row - middle_row) * across + (column - middle_column) * along
            value = scale * complex(np.cos(start), np.sin(start))
        vector[odd + place] = value.real
        vector[odd + half + place] = value.imag
        value *= turn


@compiled
def to_antennas(coordinates: ComplexArray, weights: ComplexArray) -> None:
    """Fill ``(N,)`` antenna weights from phase-centred coordinates, `subspace.to_beams`."""
    n_tx = weights.size
    half = n_tx // 2
    odd = n_tx % 2
    scale = np.sqrt(0.5)
    if odd:
        weights[half] = coordinates[0]
    for place in range(half):
        even = coordinates[odd + place]
        turned = 1j * coordinates[odd + half + place]
        weights[half + odd + place] = scale * (even + turned)
        weights[half - 1 - place] = scale * (even - turned)


@compiled
def from_antennas(weights: ComplexArray, coordinates: ComplexArray) -> None:
    """Fill ``(N,)`` phase-centred coordinates, `subspace.to_coordinates`."""
    n_tx = weights.size
    half = n_tx // 2
    odd = n_tx % 2
    scale = np.sqrt(0.5)
    if odd:
        coordinates[0] = weights[half]
    for place in range(half):
        upper = weights[half + odd + place]
        lower = weights[half - 1 - place]
        coordinates[odd + place] = scale * (upper + lower)
        coordinates[odd + half + place] = -1j * scale * (upper - lower)


@compiled
def lift(basis: Array, z: Array, weights: ComplexArray) -> None:
    """Fill ``(r N,)`` antenna weights of unit own response from z, `shape.Shape`, r columns."""
    size, n_tx = basis.shape[0] - 1, basis.shape[1]
    real, imaginary = np.empty(n_tx), np.empty(n_tx)
    coordinates = np.empty(n_tx, dtype=np.complex128)
    for column in range(weights.size // n_tx):
        own = 1.0 if column == 0 else 0.0
        for antenna in range(n_tx):
            real[antenna], imaginary[antenna] = own * basis[0, antenna], 0.0
        for place in range(size):
            line = basis[1 + place]
            right, up = z[2 * column * size + place], z[(2 * column + 1) * size + place]
            for antenna in range(n_tx):
                real[antenna] += line[antenna] * right
                imaginary[antenna] += line[antenna] * up
        for antenna in range(n_tx):
            coordinates[antenna] = complex(real[antenna], imaginary[antenna])
        to_antennas(coordinates, weights[column * n_tx : (column + 1) * n_tx])
