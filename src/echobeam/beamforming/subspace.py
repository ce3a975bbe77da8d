"""The exact reduction: everything that problem (38) asks of a beam, in few real coordinates.

Two facts make the problem small. Counted from the middle of the array the steering vector is
``exp(j phi (m - (N-1)/2))``, and sums and differences of mirrored antennas turn it into a *real*
vector c(theta) of the same length: all data are real, only the beam stays complex. And beam k
matters only through its products with c at the K objects and in its own cover, and through its
power; so w_k may be projected on the span of those vectors, as long as the power that this loses
stays in the books. One spare direction, orthogonal to all of them, keeps it: the coverage (38f)
is relative to tr W_k, and a beam may have to waste power to be flat enough.
"""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, ComplexArray

SPAN_TOLERANCE = 1e-5
"""Directions with a smaller singular value (relative to the largest) are left out of the span.

A lifted beam lies inside the span, so its pattern in reduced coordinates is its true pattern
whatever this value; only optimality depends on it, and quadratically: 1e-4 was measured to cost
less than 1e-9 of the gain, and every dimension less saves a quarter of a semidefinite solve.
"""

SAMPLES = 12.0
"""Points of a cover, however many, count as so many next to the objects."""


def real_steering(phases: Array, shape: tuple[int, int]) -> Array:
    """Return the steering vector (4) in phase-centred real coordinates.

    Parameters
    ----------
    phases
        ``(..., 1)`` or ``(..., 2)`` rad: phase steps between neighbouring rows (planar arrays) and
        columns, `phases` of the array.
    shape
        Rows and columns of the array.

    Returns
    -------
    Array
        ``(..., N)``, of norm sqrt(N): ceil(N/2) cosines, then floor(N/2) sines.
    """
    n_tx = shape[0] * shape[1]
    row, column = np.divmod(np.arange(n_tx // 2, n_tx), shape[1])
    places = np.stack([row - 0.5 * (shape[0] - 1), column - 0.5 * (shape[1] - 1)])
    angle = phases @ places[-phases.shape[-1] :]
    cosines = np.sqrt(2.0) * np.cos(angle)
    if n_tx % 2:
        cosines[..., 0] = 1.0
    sines = np.sqrt(2.0) * np.sin(angle[..., n_tx % 2 :])
    return np.concatenate([cosines, sines], axis=-1)


def to_beams(coordinates: ComplexArray) -> ComplexArray:
    """Return antenna weights from phase-centred coordinates; unitary, `to_coordinates` undoes it.

    Parameters
    ----------
    coordinates
        ``(..., N)`` complex, such that ``|a^H(theta) w| = |c(theta)^T coordinates|``.

    Returns
    -------
    ComplexArray
        ``(..., N)``: w.
    """
    n_tx = coordinates.shape[-1]
    half = n_tx // 2
    even = coordinates[..., n_tx % 2 : n_tx - half]
    odd = coordinates[..., n_tx - half :]
    upper = (even + 1j * odd) / np.sqrt(2.0)
    lower = (even - 1j * odd) / np.sqrt(2.0)
    middle = coordinates[..., : n_tx % 2]
    beams: ComplexArray = np.concatenate([lower[..., ::-1], middle, upper], axis=-1)
    return beams


def to_coordinates(beams: ComplexArray) -> ComplexArray:
    """Return phase-centred coordinates of antenna weights, ``(..., N)``; see `to_beams`."""
    n_tx = beams.shape[-1]
    half = n_tx // 2
    lower = beams[..., :half][..., ::-1]
    middle = beams[..., half : n_tx - half]
    upper = beams[..., n_tx - half :]
    even = (upper + lower) / np.sqrt(2.0)
    odd = (upper - lower) / (1j * np.sqrt(2.0))
    coordinates: ComplexArray = np.concatenate([middle, even, odd], axis=-1)
    return coordinates


def beam_subspace(channels: Array, cover: Array) -> Array:
    """Return the span of the objects' and one cover's steering vectors, and one spare direction.

    Parameters
    ----------
    channels
        ``(K, N)``: real steering vectors of all objects.
    cover
        ``(G, N)``: those of the points of the cover.

    Returns
    -------
    Array
        ``(N, r)``: orthonormal columns. The last one is the spare direction, unless the span is
        the whole space.
    """
    n_tx = channels.shape[-1]
    vectors = np.concatenate([channels, cover * np.sqrt(SAMPLES / len(cover))])
    squares, directions = np.linalg.eigh(vectors.T @ vectors)
    span = int(np.sum(squares > SPAN_TOLERANCE**2 * squares[-1]))
    return directions[:, ::-1][:, : min(span + 1, n_tx)]
