"""Problem (38) in normalised, reduced form: what a solver needs and nothing else.

Power is counted in units of P_T. Then only loss_k = sigma_C^2 d_k^2 / (P_T alpha0^2) and
2^Gamma_k - 1 are left of the radio, and nothing depends on the scale of P_T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.coverage import (
    cover_grid,
    cover_lobes,
    cover_neighbours,
    sparse_cover,
)
from echobeam.beamforming.ellipse import spread_points
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation.conic import Block
from echobeam.beamforming.subspace import beam_subspace, real_steering
from echobeam.physics.planar import PlanarArray
from echobeam.values import Array, BoolArray, IntArray

START_PER_LOBE = 8
"""Cover points per Nyquist lobe to start with: they are cheap, a further round of cuts is not."""

EXTRA_DEGREE = 4
"""The same over an ellipse: points for polynomials of twice this degree and the lobes' number."""

FLATNESS = 1e-10
"""Excess of the ripple, relative to the power, that counts as none: what rounding leaves open."""


SPARE = 1e-4
"""Coordinates of all steering vectors below this, relative to N, are those of a spare one."""


@dataclass(frozen=True, slots=True, eq=False)
class BeamModel:
    """One beam in its own reduced coordinates, see `subspace`.

    Attributes
    ----------
    basis
        ``(N, r)``: orthonormal.
    own
        ``(r,)``: real steering vector c_0 of the object it serves.
    channels
        ``(K, r)``: those of all objects.
    cover
        ``(G, r)``: those of its full coverage grid.
    start
        ``(G,)``: points to impose from the start; cuts add others.
    ripple
        B_k.
    steering
        ``(G + 1, N)``: real steering vectors of the object, then of its grid, for what has to be
        judged outside the reduced coordinates.
    near
        ``(G, n)``: neighbours of each grid point; -1 for none.
    """

    basis: Array
    own: Array
    channels: Array
    cover: Array
    start: BoolArray
    ripple: float
    steering: Array
    near: IntArray

    @property
    def block(self) -> Block:
        """Form of its covariance: the last coordinate stands alone where no data reach it."""
        reach = max(np.max(np.abs(v[:, -1])) for v in (self.channels, self.cover))
        return Block(self.size, spare=self.size > 1 and bool(reach <= SPARE * self.basis.shape[0]))

    @property
    def size(self) -> int:
        """Number of coordinates, r."""
        return int(self.basis.shape[-1])


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """All beams, and what is left of the radio.

    Attributes
    ----------
    beams
        One per object.
    loss
        ``(K,)``: sigma_C^2 d_k^2 / (P_T alpha0^2).
    threshold
        ``(K,)``: 2^Gamma_k - 1, the SINR that the floor (38e) asks for.
    channels
        ``(K, N)``: real steering vectors of the objects, not reduced.
    """

    beams: list[BeamModel]
    loss: Array
    threshold: Array
    channels: Array


def build_model(problem: BeamProblem) -> Model:
    """Return the normalised, reduced form of a problem with K >= 1 objects."""
    array, covers = problem.array, problem.coverage_halfwidths
    grid, mask = cover_grid(array, problem.angles, covers, problem.resolution)
    near = cover_neighbours(array, covers, problem.resolution, mask.shape[-1])
    channels = real_steering(array.phases(problem.angles), array.shape)
    beams = []
    for k in range(problem.n_objects):
        steering = real_steering(array.phases(grid[k, mask[k]]), array.shape)
        basis = beam_subspace(channels, steering)
        reduced = channels @ basis
        beams.append(
            BeamModel(
                basis=basis,
                own=reduced[k],
                channels=reduced,
                cover=steering @ basis,
                start=_start(problem, grid[k], mask[k], k),
                ripple=float(problem.ripple[k]),
                steering=np.concatenate([channels[k : k + 1], steering]),
                near=_own_neighbours(near[k], mask[k]),
            )
        )
    return Model(
        beams=beams,
        loss=problem.loss / problem.power,
        threshold=np.expm1(problem.min_rate * np.log(2.0)),
        channels=channels,
    )


def _own_neighbours(near: IntArray, mask: BoolArray) -> IntArray:
    """Return neighbours counted among the points of a beam's own cover alone."""
    place = np.where(mask, np.cumsum(mask) - 1, -1)
    return np.where(near[mask] >= 0, place[near[mask]], -1)


def _start(problem: BeamProblem, grid: Array, mask: BoolArray, k: int) -> BoolArray:
    """Return which points of a beam's own cover, ``(G,)``, to impose at first."""
    array, own, cover = problem.array, problem.angles[k], problem.coverage_halfwidths[k]
    if isinstance(array, PlanarArray):
        lobes = float(cover_lobes(array, own, cover, problem.resolution))
        chosen = np.zeros(mask.shape, dtype=bool)
        chosen[spread_points(grid, own, cover, 2 * (int(lobes) + EXTRA_DEGREE))] = True
        return chosen[mask]
    return sparse_cover(array.phase(grid), mask, array.n, START_PER_LOBE)[mask]


def quadratic_forms(vectors: Array, covariance: Array) -> Array:
    """Return v^T X v for rows v: the pattern of a reduced covariance, ``(..., r)`` to ``(...)``."""
    return np.asarray(np.sum((vectors @ covariance) * vectors, axis=-1))


def model_gains(model: Model, covariances: list[Array]) -> Array:
    """Return ``(K, K)`` gains, row by object, column by beam, of reduced covariances."""
    columns = [
        quadratic_forms(beam.channels, covariance)
        for beam, covariance in zip(model.beams, covariances, strict=True)
    ]
    return np.stack(columns, axis=-1)


def ripple_excess(beam: BeamModel, covariance: Array) -> Array:
    """Return |p_0 - p_j| - B tr X on the full grid, relative to tr X, Eq. (38f)."""
    power = float(np.trace(covariance))
    if power <= 0.0:
        return np.full(len(beam.cover), -beam.ripple)
    pattern = quadratic_forms(beam.cover, covariance)
    centre = float(beam.own @ covariance @ beam.own)
    return np.abs(pattern - centre) / power - beam.ripple


def new_cuts(beam: BeamModel, excess: Array, tolerance: float) -> BoolArray:
    """Return the grid points where the excess has a local maximum above the tolerance.

    Their neighbours come along, since the peak moves a little when it is cut.
    """
    around = np.where(beam.near >= 0, excess[beam.near], -np.inf)
    chosen: BoolArray = (excess > tolerance) & (excess >= around.max(axis=-1))
    beside = beam.near[chosen]
    chosen[beside[beside >= 0]] = True
    return chosen


def flattened(covariance: Array, excess: Array, ripple: float) -> Array:
    """Return the covariance mixed with a flat one until it keeps its coverage, of the same power.

    The identity is flat over the cover, since all steering vectors have one length.

    Parameters
    ----------
    covariance
        ``(r, r)``.
    excess
        ``(G,)``: its `ripple_excess`.
    ripple
        B_k.
    """
    size = len(covariance)
    worst = float(np.max(excess, initial=0.0))
    if worst <= FLATNESS:
        return covariance
    part = (worst - FLATNESS) / (worst + ripple)
    mixed: Array = (1.0 - part) * covariance
    mixed[np.diag_indices(size)] += part * np.trace(covariance) / size
    return mixed
