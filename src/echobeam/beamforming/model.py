"""Problem (38) in normalised, reduced form: what a solver needs and nothing else.

Power is counted in units of P_T. Then only loss_k = sigma_C^2 d_k^2 / (P_T alpha0^2) and
2^Gamma_k - 1 are left of the radio, and nothing depends on the scale of P_T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.conic import Block
from echobeam.beamforming.coverage import coverage_grid, sparse_cover
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.subspace import beam_subspace, real_steering
from echobeam.values import Array, BoolArray

START_PER_LOBE = 8
"""Cover points per Nyquist lobe to start with: they are cheap, a further round of cuts is not."""

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
    phases
        ``(G + 1,)`` rad: antenna phases of the object, then of its grid, for what has to be
        judged outside the reduced coordinates.
    """

    basis: Array
    own: Array
    channels: Array
    cover: Array
    start: BoolArray
    ripple: float
    phases: Array

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
    n_tx, array = problem.n_tx, problem.array
    grid, mask = coverage_grid(problem.angles, problem.coverage_halfwidths, problem.resolution)
    phases = array.phase(grid)
    start = sparse_cover(phases, mask, n_tx, START_PER_LOBE)
    centres = array.phase(problem.angles)
    channels = real_steering(centres, n_tx)
    subspaces = beam_subspace(
        np.broadcast_to(channels, (problem.n_objects, *channels.shape)),
        np.min(np.where(mask, phases, np.inf), axis=-1),
        np.max(np.where(mask, phases, -np.inf), axis=-1),
    )
    beams = []
    for k in range(problem.n_objects):
        basis = subspaces.basis[k][:, : subspaces.dimension[k]]
        reduced = channels @ basis
        beams.append(
            BeamModel(
                basis=basis,
                own=reduced[k],
                channels=reduced,
                cover=real_steering(phases[k, mask[k]], n_tx) @ basis,
                start=start[k, mask[k]],
                ripple=float(problem.ripple[k]),
                phases=np.concatenate([centres[k : k + 1], phases[k, mask[k]]]),
            )
        )
    return Model(
        beams=beams,
        loss=problem.loss / problem.power,
        threshold=np.expm1(problem.min_rate * np.log(2.0)),
        channels=channels,
    )


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


def new_cuts(excess: Array, tolerance: float) -> BoolArray:
    """Return the grid points where the excess has a local maximum above the tolerance.

    Their neighbours come along, since the peak moves a little when it is cut.
    """
    padded = np.concatenate([[-np.inf], excess, [-np.inf]])
    peak = (excess > tolerance) & (excess >= padded[:-2]) & (excess >= padded[2:])
    chosen = peak.copy()
    chosen[1:] |= peak[:-1]
    chosen[:-1] |= peak[1:]
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
