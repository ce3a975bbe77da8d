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

from dataclasses import dataclass

import numpy as np

from echobeam.values import Array, ComplexArray, IntArray

SPAN_TOLERANCE = 1e-5
"""Directions with a smaller singular value (relative to the largest) are left out of the span.

A lifted beam lies inside the span, so its pattern in reduced coordinates is its true pattern
whatever this value; only optimality depends on it, and quadratically: 1e-4 was measured to cost
less than 1e-9 of the gain, and every dimension less saves a quarter of a semidefinite solve.
"""

SAMPLES_PER_LOBE = 4
EXTRA_SAMPLES = 12


def real_steering(phases: Array, n_tx: int) -> Array:
    """Return the steering vector (4) in phase-centred real coordinates.

    Parameters
    ----------
    phases
        ``(...)`` rad: phase step between neighbouring antennas, `LinearArray.phase`.
    n_tx
        N, number of antennas.

    Returns
    -------
    Array
        ``(..., N)``, of norm sqrt(N): ceil(N/2) cosines, then floor(N/2) sines.
    """
    half = n_tx // 2
    order = np.arange(n_tx - half) + (0.5 if n_tx % 2 == 0 else 0.0)
    cosines = np.sqrt(2.0) * np.cos(np.asarray(phases)[..., np.newaxis] * order)
    if n_tx % 2:
        cosines[..., 0] = 1.0
    sines = np.sqrt(2.0) * np.sin(np.asarray(phases)[..., np.newaxis] * order[n_tx % 2 :])
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


@dataclass(frozen=True, slots=True, eq=False)
class Subspace:
    """Where a beam may live without loss, and the way back.

    Attributes
    ----------
    basis
        ``(..., N, r)``: orthonormal columns, the spare direction among them; zero columns beyond
        ``dimension``, where members of a batch differ.
    dimension
        ``(...)``: number of columns in use.
    """

    basis: Array
    dimension: IntArray

    def reduce(self, vectors: Array) -> Array:
        """Return real steering vectors ``(..., J, N)`` in reduced coordinates, ``(..., J, r)``."""
        return vectors @ self.basis

    def lift(self, reduced: ComplexArray) -> ComplexArray:
        """Return antenna weights ``(..., N)`` of beams in reduced coordinates, ``(..., r)``."""
        return to_beams(np.einsum("...nr,...r->...n", self.basis, reduced))

    def project(self, beams: ComplexArray) -> ComplexArray:
        """Return beams ``(..., N)`` in reduced coordinates ``(..., r)``, keeping their power.

        What a beam has outside the span goes into the spare direction, as far as there is one.
        """
        coordinates = to_coordinates(beams)
        reduced: ComplexArray = np.einsum("...nr,...n->...r", self.basis, coordinates)
        power = np.sum(np.abs(coordinates) ** 2, axis=-1) - np.sum(np.abs(reduced) ** 2, axis=-1)
        spare = (self.dimension - 1)[..., np.newaxis]
        value = np.take_along_axis(reduced, spare, axis=-1)
        size = np.sqrt(np.abs(value) ** 2 + np.maximum(power, 0.0)[..., np.newaxis])
        np.put_along_axis(reduced, spare, size * np.exp(1j * np.angle(value)), axis=-1)
        return reduced


def beam_subspace(channels: Array, low: Array, high: Array) -> Subspace:
    """Return the span of the objects' and one cover's steering vectors, and one spare direction.

    Parameters
    ----------
    channels
        ``(..., J, N)``: real steering vectors of all objects.
    low, high
        ``(...)`` rad: smallest and largest antenna phase in the cover.

    Returns
    -------
    Subspace
        Of at most N dimensions. The last column in use is the spare direction, unless the span
        is the whole space.
    """
    n_tx = channels.shape[-1]
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    vectors = np.concatenate([channels, _samples(low, high, n_tx)], axis=-2)
    _, singular, rows = np.linalg.svd(vectors, full_matrices=vectors.shape[-2] < n_tx)
    span = np.sum(singular > SPAN_TOLERANCE * singular[..., :1], axis=-1)
    dimension = np.minimum(span + 1, n_tx)
    size = int(np.max(dimension, initial=1))
    used = np.arange(size) < dimension[..., np.newaxis]
    basis = np.swapaxes(rows[..., :size, :], -1, -2) * used[..., np.newaxis, :]
    return Subspace(basis=basis, dimension=dimension)


def _samples(low: Array, high: Array, n_tx: int) -> Array:
    """Return steering vectors that span those of an interval of phases; zero rows fill up a batch.

    Chebyshev nodes, so many as the interval has lobes for: a member's own, whatever the others'.
    """
    lobes = (high - low) * n_tx / (2.0 * np.pi)
    count = np.ceil(SAMPLES_PER_LOBE * lobes) + EXTRA_SAMPLES
    order = np.arange(int(np.max(count, initial=EXTRA_SAMPLES)))
    last = count[..., np.newaxis] - 1.0
    nodes = 0.5 - 0.5 * np.cos(np.pi * np.minimum(order / last, 1.0))
    phases = low[..., np.newaxis] + (high - low)[..., np.newaxis] * nodes
    return real_steering(phases, n_tx) * (order <= last)[..., np.newaxis]
