"""The relaxed problem (38) without (38d), by successive convex approximation, Eqs. (51)-(54).

The sum rate depends on the beams through two sums per object, what it receives in all and what it
receives of others' beams. The concave logarithm of the first keeps its second-order model, the
convex one of the second its tangent as in (52); both are renewed at each step, and the step is cut
back until the true sum rate rises. The model is one quadratic semidefinite programme with real
matrices of the reduced sizes, in which the rate floors (38e) are linear and coverage (38f) stands
on an active set of the grid that cuts complete.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from echobeam.beamforming.relaxation import conic
from echobeam.beamforming.relaxation.model import (
    FLATNESS,
    Model,
    flattened,
    model_gains,
    new_cuts,
    ripple_excess,
)
from echobeam.beamforming.relaxation.shape import cover_rows
from echobeam.values import Array, BoolArray

MOST_STEPS = 60
MOST_ROUNDS = 15

STEADY = 1e-9
"""Relative change of the sum rate at which the steps end."""

TRUSTED = 1e-7
"""Relative error of the model over a whole step at which its maximum is taken for the true one."""

LEAST_SCALE = 1e-4
"""A beam's matrix is counted in units of its present power, but of no less than this."""

CUT_TOLERANCE = 1e-7
"""Excess of the ripple, relative to it, above which a grid point is added as a cut."""

LEAST_POWER = 1e-7
"""What is wrong with the pattern of a beam with less power does not call for cuts."""

PARTS = np.concatenate([np.linspace(1.0, 0.05, 20), np.geomspace(0.04, 1e-6, 20)])
"""Parts of a step to choose from; the sum rate along it costs K^2 numbers each."""


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """Covariances of all beams in reduced coordinates, power relative to P_T.

    Attributes
    ----------
    covariances
        ``(r_k, r_k)`` each.
    cuts
        ``(G_k,)`` each: grid points imposed so far.
    solves
        Semidefinite programmes solved so far.
    """

    covariances: list[Array]
    cuts: list[BoolArray]
    solves: int


def sum_rate(gains: Array, loss: Array) -> Array:
    """Return sum log(1 + SINR), nats, of ``(..., K, K)`` gains, Eq. (50)."""
    own = np.diagonal(gains, axis1=-2, axis2=-1)
    foreign = gains.sum(axis=-1) - own
    return np.asarray(np.sum(np.log1p(own / (foreign + loss)), axis=-1))


def improve(model: Model, start: Design) -> Design | None:
    """Climb from a start to where the approximation stands still.

    The start only says where to approximate: the first step is taken whole, since it meets all
    constraints whatever the start does.

    Returns
    -------
    Design or None
        None if not even the first step could be solved; then the floors (38e) may be too high.
    """
    design, gains = start, model_gains(model, start.covariances)
    value = float(sum_rate(gains, model.loss))
    for count in range(MOST_STEPS):
        step = _solve_with_cuts(model, design, gains)
        if step is None:
            return None if count == 0 else design
        change = model_gains(model, step.covariances) - gains
        part = 1.0 if count == 0 else _best_part(model, gains, change)
        risen = float(sum_rate(gains + part * change, model.loss))
        if risen <= 0.0:
            # Beams without power, from a solver at the end of its digits.
            return None if count == 0 else design
        rise, promised = risen - value, _promised(model, gains, change)
        solves = design.solves + step.solves
        if count > 0 and rise <= 0.0:
            return replace(design, solves=solves)
        mixed = [
            (1.0 - part) * old + part * new
            for old, new in zip(design.covariances, step.covariances, strict=True)
        ]
        design = Design(mixed, step.cuts, solves)
        gains, value = gains + part * change, risen
        # Where the model was right about a whole step, its maximum is the true one.
        right = part == 1.0 and abs(promised - rise) <= TRUSTED * value
        if right or (count > 0 and rise <= STEADY * value):
            break
    return design


def _best_part(model: Model, gains: Array, change: Array) -> float:
    """Return the part of a step at which the true sum rate is largest."""
    along = sum_rate(gains + PARTS[:, np.newaxis, np.newaxis] * change, model.loss)
    return float(PARTS[int(np.argmax(along))])


def _slopes(model: Model, gains: Array) -> tuple[Array, Array]:
    """Return d/dx of log x at all that is received and at what others' beams bring, Eq. (53)."""
    received = gains.sum(axis=-1) + model.loss
    return 1.0 / received, 1.0 / (received - np.diagonal(gains))


def _promised(model: Model, gains: Array, change: Array) -> float:
    """Return by how much the model of the sum rate rises along a change of the gains."""
    slope, slope_foreign = _slopes(model, gains)
    received = change.sum(axis=-1)
    foreign = received - np.diagonal(change)
    bend = (slope * received) ** 2 / 2.0
    return float(np.sum(slope * received - bend - slope_foreign * foreign))


def _solve_with_cuts(model: Model, around: Design, gains: Array) -> Design | None:
    """Return the maximum of (54) around a design, kept to coverage on the full grid."""
    power = np.array([np.trace(covariance) for covariance in around.covariances])
    scales = np.maximum(power, LEAST_SCALE)
    found = solve_on_grid(model, scales, around.cuts, partial(_approximation, model, gains))
    if found is None:
        return None
    total = sum(float(np.trace(covariance)) for covariance in found.covariances)
    return replace(found, covariances=[c / max(1.0, total) for c in found.covariances])


def solve_on_grid(
    model: Model,
    scales: Array,
    cuts: list[BoolArray],
    programme: Callable[[Array, list[BoolArray]], conic.Programme],
) -> Design | None:
    """Solve a programme with more and more cuts until it keeps (38f) on the full grid.

    Parameters
    ----------
    scales
        ``(K,)``: unit in which each matrix is counted.
    cuts
        Grid points to start with.
    programme
        Gives the programme for scales and cuts.

    Returns
    -------
    Design or None
        Covariances that keep coverage; None if the programme has no solution.
    """
    solves, complete = 0, False
    while solves < MOST_ROUNDS and not complete:
        answer = conic.solve(programme(scales, cuts))
        solves += 1
        if not answer.usable:
            return None
        found = [scale * _positive(m) for scale, m in zip(scales, answer.matrices, strict=True)]
        kept, cuts, complete = keep_coverage(model, found, cuts)
    return Design(kept, cuts, solves)


def keep_coverage(
    model: Model, covariances: list[Array], cuts: list[BoolArray]
) -> tuple[list[Array], list[BoolArray], bool]:
    """Return covariances that keep coverage on the full grid, cuts to add, and if none is new."""
    kept, wider, complete = [], [], True
    for beam, covariance, old in zip(model.beams, covariances, cuts, strict=True):
        excess = ripple_excess(beam, covariance)
        kept.append(flattened(covariance, excess, beam.ripple))
        found = new_cuts(beam, excess, FLATNESS + CUT_TOLERANCE * beam.ripple) & ~old
        found &= float(np.trace(covariance)) > LEAST_POWER
        wider.append(old | found)
        complete &= not found.any()
    return kept, wider, complete


def _positive(symmetric: Array) -> Array:
    values, vectors = np.linalg.eigh(symmetric)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _approximation(
    model: Model, gains: Array, scales: Array, cuts: list[BoolArray]
) -> conic.Programme:
    """Return problem (54), as a minimisation relative to the present sum rate."""
    slope, slope_foreign = _slopes(model, gains)
    received = gains.sum(axis=-1)
    value = float(sum_rate(gains, model.loss))
    n_objects = scales.size
    unit = np.array([float(beam.own @ beam.own) for beam in model.beams])
    forms = [
        scale * beam.block.squares(beam.channels)
        for scale, beam in zip(scales, model.beams, strict=True)
    ]
    others = ~np.eye(n_objects, dtype=bool)
    cost = [(slope_foreign * others[k] / value) @ forms[k] for k in range(n_objects)]
    floors, floors_of = floor_rows(model, forms)
    traces = [scale * b.block.identity() for scale, b in zip(scales, model.beams, strict=True)]
    return conic.Programme(
        blocks=[beam.block for beam in model.beams],
        cost=cost,
        equal=[form / unit[:, np.newaxis] for form in forms],
        equal_free=-np.eye(n_objects),
        equal_to=received / unit,
        free_cost=-slope * unit / value,
        curvature=(slope * unit) ** 2 / value,
        most=[np.vstack([t, f]) for t, f in zip(traces, floors, strict=True)],
        most_of=np.concatenate([[1.0], floors_of]),
        own=[cover_rows(beam, cut) for beam, cut in zip(model.beams, cuts, strict=True)],
    )


def floor_rows(model: Model, forms: list[Array]) -> tuple[list[Array], Array]:
    """Return the floors (38e), linear: threshold (foreign + loss) - own <= 0, scaled to -1.

    Parameters
    ----------
    forms
        Per beam, ``(K, m_k)``: its gain at each object as a row of its triangle vector.
    """
    asked = np.flatnonzero(model.threshold > 0.0)
    need = model.threshold * model.loss
    rows = []
    for k, form in enumerate(forms):
        weight = np.where(np.arange(len(forms)) == k, -1.0, model.threshold) / np.where(
            need > 0.0, need, 1.0
        )
        rows.append((weight[:, np.newaxis] * form)[asked])
    return rows, -np.ones(asked.size)
