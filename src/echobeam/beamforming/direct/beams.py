"""The data of the beams of many trials: reduced real steering vectors on nodes of each cover.

A beam is sought in the span of the steering vectors of its own object, of the other objects, and
of Chebyshev nodes of the phase interval of its cover, plus one spare direction. A householder
factorisation gives that span and the vectors' coordinates at once; vectors that depend on others
leave arbitrary orthogonal directions, which do no harm. Since the beam lies in the span, its
pattern is exact; that the nodes stand for the whole interval costs optimality only, quadratically.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.subspace import real_steering, to_beams
from echobeam.physics.array import LinearArray
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

WIDE = 2.0
"""Cover, in Nyquist lobes, from which on one node more is taken."""

EXTRA_NODES = 4


@dataclass(frozen=True, slots=True, eq=False)
class BeamSet:
    """S beams of N antennas, L other objects each; the batch leads.

    Attributes
    ----------
    basis
        ``(S, N, r)``: orthonormal; the first column is the own steering vector of unit norm.
    phases
        ``(S, G)`` rad: the full grid of (38f); what is beyond a beam's own cover repeats the
        centre.
    own
        ``(S,)`` rad: phase of the own object.
    others
        ``(S, L)`` rad: phases of the other objects.
    low, high
        ``(S,)`` rad: phase interval of the cover.
    points
        ``(S, m)``: grid points imposed. The first ones stay as long as they can, the last ``spare``
        are for what turns out to be missed. Those not needed are the centre.
    ripple
        ``(S,)``: B_k / N.
    spare
        Number of points that may be replaced.
    """

    basis: Array
    phases: Array
    own: Array
    others: Array
    low: Array
    high: Array
    points: IntArray
    ripple: Array
    spare: int

    @property
    def n_tx(self) -> int:
        """N."""
        return int(self.basis.shape[1])

    def taken(self, index: IntArray) -> BeamSet:
        """Return some of the beams."""
        arrays = (field.name for field in fields(self) if field.name != "spare")
        return replace(self, **{name: getattr(self, name)[index] for name in arrays})

    def reduced(self, phases: Array) -> tuple[Array, Array]:
        """Return unit steering vectors at ``(S, J)`` as ``(J, r - 1, S)`` and offset ``(J, S)``."""
        vectors = unit_steering(phases, self.n_tx) @ self.basis
        return np.ascontiguousarray(vectors[:, :, 1:].transpose(1, 2, 0)), vectors[:, :, 0].T.copy()

    def lift(self, coordinates: Array) -> ComplexArray:
        """Return antenna weights ``(S, N)`` of unit own response from z, ``(2, r - 1, S)``."""
        z = (coordinates[0] + 1j * coordinates[1]).T
        full = np.concatenate([np.ones((z.shape[0], 1)), z], axis=1)
        return to_beams((self.basis @ full[:, :, np.newaxis])[:, :, 0])


def unit_steering(phases: Array, n_tx: int) -> Array:
    """Return real steering vectors of unit norm, ``(..., N)``, see `real_steering`."""
    unit: Array = real_steering(phases, n_tx) / np.sqrt(n_tx)
    return unit


def other_objects(n_objects: int) -> IntArray:
    """Return ``(K, K - 1)``: for each object the indices of the others."""
    index = [[i for i in range(n_objects) if i != k] for k in range(n_objects)]
    return np.array(index, dtype=np.int64).reshape(n_objects, n_objects - 1)


def node_count(lobes: Array) -> IntArray:
    """Return how many nodes stand for a cover that is so many Nyquist lobes 2 pi / N wide."""
    count: IntArray = np.ceil(lobes).astype(np.int64) + EXTRA_NODES + (lobes > WIDE)
    return count


def point_counts(nodes: int) -> tuple[int, int]:
    """Return how many points of a cover are imposed first, and how many are kept to spare.

    Over very wide covers a pattern touches its limits at so many places that too few spare points
    are passed from one to the other without end.
    """
    return max(2 * nodes + 1, 6 * nodes - 23), max(nodes + 1, 4 * nodes - 35)


def cover_phases(
    angles: Array, halfwidths: Array, resolution: float, array: LinearArray
) -> tuple[Array, BoolArray]:
    """Return antenna phases of the coverage grids, ``(..., G)``, and which points are imposed."""
    grid, mask = coverage_grid(angles, halfwidths, resolution)
    return array.phase(grid), mask


def beam_set(phases: Array, mask: BoolArray, n_tx: int, ripple: Array, nodes: int) -> BeamSet:
    """Return the beams of trials with K objects each, trial by trial.

    Parameters
    ----------
    phases, mask
        ``(T, K, G)``: `cover_phases`; the own angle in the middle.
    n_tx
        N.
    ripple
        ``(T, K)``: B_k.
    nodes
        Nodes per cover.
    """
    n_objects, size = phases.shape[1:]
    centre = phases[:, :, size // 2]
    others = centre[:, other_objects(n_objects)].reshape(len(centre) * n_objects, n_objects - 1)
    phases, mask, own = phases.reshape(-1, size), mask.reshape(-1, size), centre.reshape(-1)
    low, high = np.min(phases, axis=1), np.max(phases, axis=1)
    sites = 0.5 - 0.5 * np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
    sites = (sites - sites[0]) / (sites[-1] - sites[0])
    between = low[:, np.newaxis] + (high - low)[:, np.newaxis] * sites
    spare = (0.5 * (low + high) + np.pi)[:, np.newaxis]
    span = np.concatenate([own[:, np.newaxis], others, between, spare], axis=1)
    vectors = unit_steering(span, n_tx)
    basis, upper = np.linalg.qr(np.swapaxes(vectors, 1, 2))
    basis[:, :, 0] *= np.sign(upper[:, 0, 0])[:, np.newaxis]
    if (
        n_tx == 1
    ):  # No other direction exists; an idle coordinate keeps the shapes from being empty.
        basis = np.concatenate([basis, np.zeros_like(basis)], axis=2)
    even, spare_points = point_counts(nodes)
    return BeamSet(
        basis=basis,
        phases=phases,
        own=own,
        others=others,
        low=low,
        high=high,
        points=_first_points(mask, even, spare_points),
        ripple=ripple.reshape(-1) / n_tx,
        spare=spare_points,
    )


def _first_points(mask: BoolArray, count: int, spare: int) -> IntArray:
    """Choose ``count`` grid points evenly, ends among them; repeated and spare ones the centre."""
    centre = mask.shape[1] // 2
    reach = (np.sum(mask, axis=1) - 1) // 2
    fraction = np.linspace(-1.0, 1.0, count)
    chosen = np.rint(reach[:, np.newaxis] * fraction).astype(np.int64)
    chosen[:, 1:] = np.where(chosen[:, 1:] == chosen[:, :-1], 0, chosen[:, 1:])
    points: IntArray = np.pad(chosen, ((0, 0), (0, spare))) + centre
    return points
