"""Channels at the nodes of all beliefs, in few real coordinates.

Counted from the middle of the array, steering vectors are real (`echobeam.beamforming.subspace`),
and only the part of a beam in their span is received by anybody. A narrow belief spans two to
four dimensions: singular directions below `TOLERANCE` of the largest are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.expected.beliefs import NEAREST, BeliefBatch
from echobeam.beamforming.expected.directions import (
    Size,
    longer,
    nodes_of,
    phases,
    shift,
    visible_weight,
)
from echobeam.beamforming.subspace import real_steering, to_beams, to_coordinates
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

TOLERANCE = 1e-3
"""Relative singular value, of nodes weighted by the root of their probability, that is left out:
a loss of gain of its square."""

DIMENSIONS = (1, 2, 4, 6, 9, 12, 16, 22, 30, 45, 64, 90, 128)
"""Numbers of coordinates; trials are brought together by it, so that none depends on the others,
not even in its last digits."""


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Nodes of K beliefs in T trials; total power 1, largest gain 1.

    Attributes
    ----------
    channel
        ``(T, K, Q, r)``: steering vectors over sqrt(N), in the basis; zero where not active.
    weight
        ``(T, K, Q)``: probabilities, zero where not active.
    loss
        ``(T, K, Q)``: noise over path gain, N and P_T.
    centre
        ``(T, K, r)``: the channel at the mean angle.
    basis
        ``(T, N, r)``: orthonormal columns, zero ones where a trial needs fewer.
    active
        ``(T, K)``.
    """

    channel: Array
    weight: Array
    loss: Array
    centre: Array
    basis: Array
    active: BoolArray

    def __len__(self) -> int:
        """T."""
        return int(self.loss.shape[0])

    def taken(self, trials: IntArray) -> Places:
        """Return some of the trials, in the order given."""
        return Places(
            self.channel[trials],
            self.weight[trials],
            self.loss[trials],
            self.centre[trials],
            self.basis[trials],
            self.active[trials],
        )

    @property
    def dimensions(self) -> IntArray:
        """``(T,)``: dimensions that a trial is given, those that it needs rounded up."""
        needed = np.any(self.basis != 0.0, axis=1).sum(axis=-1)
        place = np.minimum(np.searchsorted(DIMENSIONS, needed), len(DIMENSIONS) - 1)
        most = np.asarray(DIMENSIONS, dtype=np.int64)[place]
        given: IntArray = np.minimum(np.maximum(most, needed), self.basis.shape[-1])
        return given

    def narrowed(self, dimensions: int) -> Places:
        """Return the same places in the last coordinates only, which have all that matters."""
        return Places(
            np.ascontiguousarray(self.channel[..., -dimensions:]),
            self.weight,
            self.loss,
            np.ascontiguousarray(self.centre[..., -dimensions:]),
            np.ascontiguousarray(self.basis[..., -dimensions:]),
            self.active,
        )

    def coordinates(self, beams: ComplexArray) -> ComplexArray:
        """Return beams ``(T, K, N)`` in the basis, ``(T, K, r)``; the rest reaches nobody."""
        inside: ComplexArray = to_coordinates(beams) @ self.basis
        return inside

    def beams(self, coordinates: ComplexArray, power: float) -> ComplexArray:
        """Return antenna weights of exactly the power, zero where not active, ``(T, K, P N)``."""
        made = to_beams(coordinates @ np.swapaxes(self.basis, -1, -2))
        made = made.reshape(*self.active.shape, -1)
        made = np.where(self.active[..., None], made, 0.0)
        norm = np.sqrt(np.sum(np.abs(made) ** 2, axis=(-2, -1), keepdims=True))
        scaled: ComplexArray = made * (np.sqrt(power) / np.where(norm > 0.0, norm, 1.0))
        return scaled


def places_of(
    beliefs: BeliefBatch, active: BoolArray, z: Array, weight: Array, basis: Array | None = None
) -> Places:
    """Return the places of beliefs at nodes of standard normal numbers.

    Parameters
    ----------
    beliefs
        Of T trials.
    active
        ``(T, K)``: the objects that are served, whose numbers are sound.
    z, weight
        ``(Q,)``; z of two direction cosines ``(Q, 2)``, along the principal axes.
    basis
        ``(T, N, r)``; that of the weighted nodes if None.
    """
    array = beliefs.array
    moved = shift(beliefs, active, z)
    loss = np.where(active, beliefs.loss, beliefs.power * array.elements)[..., None]
    far = np.maximum(longer(beliefs, active, moved), NEAREST)
    loss = loss * far**2 / (beliefs.power * array.elements)
    scale = active[..., None, None] / np.sqrt(array.elements)
    full = real_steering(phases(beliefs, active, moved), array.shape) * scale
    centre = real_steering(phases(beliefs, active), array.shape) * scale[..., 0]
    weights = visible_weight(beliefs, active, moved, weight)
    if basis is None:
        basis = _span(full, centre, weight)
    return Places(
        channel=full @ basis[:, None],
        weight=weights,
        loss=loss,
        centre=centre @ basis,
        basis=basis,
        active=active,
    )


def places_at_nodes(beliefs: BeliefBatch, active: BoolArray, size: Size) -> Places:
    """Return the places at the nodes of an expectation."""
    return places_of(beliefs, active, *nodes_of(size))


def _span(full: Array, centre: Array, weight: Array) -> Array:
    """Return ``(T, N, r)``: what the weighted nodes ``(T, K, Q, N)`` and the centres span."""
    trials, _, _, n = full.shape
    nodes = (full * np.sqrt(weight)[:, None]).reshape(trials, -1, n)
    vectors = np.concatenate([nodes, centre * np.sqrt(np.max(weight))], axis=1)
    few = vectors.shape[1] < n
    flipped = np.swapaxes(vectors, -1, -2)
    squares, directions = np.linalg.eigh(vectors @ flipped if few else flipped @ vectors)
    kept = squares > TOLERANCE**2 * np.maximum(squares[..., -1:], np.finfo(float).tiny)
    if few:
        directions = flipped @ (directions / np.sqrt(np.where(kept, squares, 1.0))[:, None])
    return np.where(kept[:, None], directions, 0.0)
