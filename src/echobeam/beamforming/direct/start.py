"""Start of one beam: a chirp over its cover, the matched beam, or the beam given.

Widening a beam well takes a phase that is quadratic over the array; from a start without it (real
in phase-centred coordinates) an iteration stays on a branch that loses up to 5 %.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct.arrays import copy_into, fill, scaled_identity
from echobeam.beamforming.direct.compiling import compiled
from echobeam.beamforming.direct.linear import factor, solve
from echobeam.beamforming.direct.shape import (
    BARRIER,
    RESIDUAL,
    RIPPLE,
    SHIFT,
    TARGET,
    Shape,
    power_of,
    respond_from,
    slacks,
)
from echobeam.beamforming.direct.steering import from_antennas
from echobeam.values import Array, ComplexArray

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


@compiled
def start_shape(
    shape: Shape, imposed: Array, cover: tuple[float, float, float], chirp: float
) -> None:
    """Set a beam's coordinates and scalars to the start.

    Parameters
    ----------
    shape
        With rows, offset and target.
    imposed
        ``(m,)`` rad: phases of the points imposed.
    cover
        rad: phase of the own object, least and largest phase of the cover.
    chirp
        Rate of the chirp.
    """
    scalars = shape.scalars
    scalars[BARRIER], scalars[SHIFT], scalars[RESIDUAL] = FIRST_BARRIER, 0.0, np.inf
    scalars[RIPPLE] = scalars[TARGET]
    excess = 0.0
    for row in range(imposed.size):
        excess = max(excess, abs(shape.offset[row] ** 2 - 1.0))
    if excess <= (1.0 - MATCHED_SLACK) * scalars[TARGET]:
        fill(shape.z, 0.0)
        scalars[BARRIER] = MATCHED_BARRIER
    else:
        _chirped(shape, imposed, cover, chirp)


@compiled
def _chirped(shape: Shape, imposed: Array, cover: tuple[float, float, float], chirp: float) -> None:
    rows, offset, z, n_tx = shape.rows, shape.offset, shape.z, shape.basis.shape[1]
    own, low, high = cover
    size, m = rows.shape[0], imposed.size
    middle = 0.5 * (low + high)
    width = max(high - low, LEAST_WIDTH * 2.0 * np.pi / n_tx)
    bow = 0.5 * chirp * n_tx / width
    real, imaginary = np.empty(m), np.empty(m)
    for row in range(m):
        angle = bow * ((imposed[row] - middle) ** 2 - (own - middle) ** 2)
        real[row], imaginary[row] = np.cos(angle) - offset[row], np.sin(angle)
    normal = scaled_identity(size, RIDGE)
    for first in range(size):
        line, along, across = rows[first], 0.0, 0.0
        for row in range(m):
            along += line[row] * real[row]
            across += line[row] * imaginary[row]
        z[first], z[size + first] = along, across
        for second in range(first + 1):
            total = 0.0
            for row in range(m):
                total += line[row] * rows[second, row]
            normal[first, second] += total
    inverse = np.empty(size)
    factor(normal, inverse)
    solve(normal, inverse, z[:size])
    solve(normal, inverse, z[size:])


@compiled
def keep_warm(shape: Shape, warm: ComplexArray) -> None:
    """Start from a beam given, where it is not much worse than what there is."""
    basis = shape.basis
    size, n_tx = basis.shape[0] - 1, basis.shape[1]
    coordinates = np.empty(n_tx, dtype=np.complex128)
    from_antennas(warm, coordinates)
    own = 0.0j
    for antenna in range(n_tx):
        own += basis[0, antenna] * coordinates[antenna]
    given = np.empty(2 * size)
    total = abs(own) ** 2
    for place in range(size):
        value = 0.0j
        for antenna in range(n_tx):
            value += basis[1 + place, antenna] * coordinates[antenna]
        given[place], given[size + place] = value.real, value.imag
        total += abs(value) ** 2
    if not (total < np.inf and abs(own) > 1e-3 * np.sqrt(total)):
        return
    for place in range(size):
        value = complex(given[place], given[size + place]) / own
        given[place], given[size + place] = value.real, value.imag
    if _cost(shape, given) < WORSE * _cost(shape, shape.z):
        copy_into(shape.z, given)
        shape.scalars[BARRIER] = min(shape.scalars[BARRIER], WARM_BARRIER)


@compiled
def _cost(shape: Shape, z: Array) -> float:
    """Return the power of coordinates, with a penalty for ripple beyond what is allowed."""
    response = np.empty((2, shape.offset.size))
    respond_from(shape.rows, shape.offset, z, response)
    excess = 0.0
    for row in range(shape.low.size):
        excess = max(excess, abs(response[0, row] ** 2 + response[1, row] ** 2 - 1.0))
    power = power_of(z)
    beyond: float = max(excess / shape.scalars[TARGET] - power, 0.0)
    return power + 10.0 * beyond


@compiled
def make_feasible(shape: Shape) -> None:
    """Widen the imposed ripple where the point does not leave some of it free."""
    response, low, high, scalars = shape.response, shape.low, shape.high, shape.scalars
    respond_from(shape.rows, shape.offset, shape.z, response)
    power = power_of(shape.z)
    excess = 0.0
    for row in range(low.size):
        size = response[0, row] ** 2 + response[1, row] ** 2
        excess = max(excess, abs(size - 1.0))
    target = scalars[TARGET]
    scalars[RIPPLE] = max(target, excess / power + SAFE * target)
    slacks(response, scalars[RIPPLE] * power, low, high)
    for row in range(low.size):
        low[row] = scalars[BARRIER] / low[row]
        high[row] = scalars[BARRIER] / high[row]
