"""Where a beam starts: a chirp over its cover, the matched beam, or the last slot's beam.

Widening a beam well takes a phase that is quadratic over the array; from a start without it (real
in phase-centred coordinates) an iteration stays on a branch that loses up to 5 %.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.barrier import Shapes, respond, slacks
from echobeam.beamforming.direct.beams import BeamSet
from echobeam.beamforming.subspace import to_coordinates
from echobeam.values import Array, BoolArray, ComplexArray

CHIRPS = (0.6, 1.0, 0.3)
"""Rates of the chirp of the first start and of those after failures."""

RIDGE = 1e-3
LEAST_WIDTH = 0.5
"""Width in Nyquist lobes below which the chirp gets no slower."""

SAFE = 0.05
"""Part of the allowed ripple that a start should leave free."""

MATCHED_SLACK = 0.02

FIRST_BARRIER = 0.1
MATCHED_BARRIER = 1e-4
WARM_BARRIER = 1e-2

WORSE = 1.3
"""A warm start is dropped where the new chirp costs less than this part of it."""


def start_shapes(beams: BeamSet, chirp: float, warm: ComplexArray | None = None) -> Shapes:
    """Return shapes to start from, strictly feasible for a ripple that may be wider than asked.

    Parameters
    ----------
    beams
        S beams.
    chirp
        Rate, 1 where the chirp sweeps the cover over the whole array.
    warm
        ``(S, N)``: beams to start from, NaN where there are none.
    """
    imposed = np.take_along_axis(beams.phases, beams.points, axis=1)
    rows, offset = beams.reduced(np.concatenate([imposed, beams.others], axis=1))
    m, batch = imposed.shape[1], beams.own.size
    target = np.maximum(beams.ripple, 1e-12)
    shapes = Shapes(
        rows=rows,
        offset=offset,
        target=target,
        ripple=target,
        coordinates=np.zeros((2, rows.shape[1], batch)),
        response=np.zeros((rows.shape[0], 2, batch)),
        low=np.ones((m, batch)),
        high=np.ones((m, batch)),
        barrier=np.full(batch, FIRST_BARRIER),
        shift=np.zeros(batch),
        residual=np.full(batch, np.inf),
    )
    shapes.coordinates = _chirped(beams, shapes, imposed, chirp)
    _keep_matched(shapes)
    if warm is not None:
        _keep_warm(beams, shapes, warm)
    make_feasible(shapes)
    return shapes


def make_feasible(shapes: Shapes) -> None:
    """Widen the imposed ripple where the point does not leave some of it free."""
    respond(shapes)
    power = shapes.power
    response = shapes.response[: shapes.cover]
    excess = np.abs(np.einsum("mcs,mcs->ms", response, response) - 1.0)
    needed = np.max(excess, axis=0) / power + SAFE * shapes.target
    shapes.ripple = np.maximum(shapes.target, needed)
    below, above = slacks(response, shapes.ripple, power)
    shapes.low, shapes.high = shapes.barrier / below, shapes.barrier / above


def _chirped(beams: BeamSet, shapes: Shapes, imposed: Array, chirp: float) -> Array:
    """Return the smallest coordinates that nearly give unit responses of quadratic phase."""
    m = imposed.shape[1]
    middle = 0.5 * (beams.low + beams.high)
    width = np.maximum(beams.high - beams.low, LEAST_WIDTH * 2.0 * np.pi / beams.n_tx)
    bow = 0.5 * chirp * beams.n_tx / width
    phase = (imposed - middle[:, np.newaxis]) ** 2 - ((beams.own - middle) ** 2)[:, np.newaxis]
    wanted = np.exp(1j * bow[:, np.newaxis] * phase)
    rows = np.moveaxis(shapes.rows[:m], -1, 0)
    across = np.swapaxes(rows, 1, 2)
    wanted = wanted - shapes.offset[:m].T
    right = across @ np.stack([wanted.real, wanted.imag], axis=-1)
    normal = across @ rows + RIDGE * np.eye(rows.shape[2])
    return np.ascontiguousarray(np.linalg.solve(normal, right).transpose(2, 1, 0))


def _keep_matched(shapes: Shapes) -> None:
    """Start from the matched beam where coverage does not bind on it."""
    excess = np.max(np.abs(shapes.offset[: shapes.cover] ** 2 - 1.0), axis=0)
    free = excess <= (1.0 - MATCHED_SLACK) * shapes.target
    shapes.coordinates[:, :, free] = 0.0
    shapes.barrier[free] = MATCHED_BARRIER


def _keep_warm(beams: BeamSet, shapes: Shapes, warm: ComplexArray) -> None:
    """Start from given beams where they are not much worse than what there is."""
    usable: BoolArray = np.all(np.isfinite(warm), axis=1)
    reduced = (
        np.swapaxes(beams.basis, 1, 2)
        @ to_coordinates(np.where(usable[:, None], warm, 1.0))[:, :, np.newaxis]
    )
    reduced = reduced[:, :, 0]
    usable &= np.abs(reduced[:, 0]) > 1e-3 * np.linalg.norm(reduced, axis=1)
    scaled = reduced[:, 1:] / np.where(usable, reduced[:, 0], 1.0)[:, np.newaxis]
    given = np.stack([scaled.real.T, scaled.imag.T])
    better = usable & (_cost(shapes, given) < WORSE * _cost(shapes, shapes.coordinates))
    shapes.coordinates[:, :, better] = given[:, :, better]
    shapes.barrier[better] = np.minimum(shapes.barrier[better], WARM_BARRIER)


def _cost(shapes: Shapes, coordinates: Array) -> Array:
    """Return the power of coordinates, with a penalty for ripple beyond what is allowed."""
    m = shapes.cover
    power = 1.0 + np.einsum("cns,cns->s", coordinates, coordinates)
    real = np.einsum("rns,ns->rs", shapes.rows[:m], coordinates[0]) + shapes.offset[:m]
    imaginary = np.einsum("rns,ns->rs", shapes.rows[:m], coordinates[1])
    excess = np.max(np.abs(real**2 + imaginary**2 - 1.0), axis=0)
    cost: Array = power + 10.0 * np.maximum(excess / shapes.target - power, 0.0)
    return cost
