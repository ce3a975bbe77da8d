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
    received,
    respond_from,
    slacks,
)
from echobeam.beamforming.direct.steering import from_antennas
from echobeam.values import Array, ComplexArray

RIDGE = 1e-3

SECOND = 0.1
"""Amplitude of the second column of a start, relative to the first: without one it would stay
zero, as a saddle."""

SAFE = 0.05
"""Part of the allowed ripple that a start should leave free."""

MATCHED_SLACK = 0.02

FIRST_BARRIER = 0.1

MATCHED_BARRIER = 1e-4

WARM_BARRIER = 1e-2

WORSE = 1.3
"""A warm start is dropped where the new chirp costs less than this part of it."""


@compiled
def start_shape(shape: Shape, bow: Array, chirp: Array) -> None:
    """Set a beam's coordinates and scalars to the start.

    Parameters
    ----------
    shape
        With rows, offset and target.
    bow
        ``(d, m)`` rad: phases of a chirp of rate one along each axis, at the points imposed.
    chirp
        ``(r, d)``: rates of each column's chirp.
    """
    scalars = shape.scalars
    scalars[BARRIER], scalars[SHIFT], scalars[RESIDUAL] = FIRST_BARRIER, 0.0, np.inf
    scalars[RIPPLE] = scalars[TARGET]
    excess = 0.0
    for row in range(bow.shape[1]):
        excess = max(excess, abs(shape.offset[row] ** 2 - 1.0))
    fill(shape.z, 0.0)
    if excess <= (1.0 - MATCHED_SLACK) * scalars[TARGET]:
        scalars[BARRIER] = MATCHED_BARRIER
    else:
        for column in range(chirp.shape[0]):
            _chirped(shape, bow, chirp[column], column)


@compiled
def _chirped(shape: Shape, bow: Array, chirp: Array, column: int) -> None:
    """Set one column to the least squares fit of a chirp; a second one of two is far weaker."""
    rows, offset, z = shape.rows, shape.offset, shape.z
    size, m = rows.shape[0], bow.shape[1]
    real, imaginary = np.empty(m), np.empty(m)
    for row in range(m):
        angle = 0.0
        for axis in range(chirp.size):
            angle += chirp[axis] * bow[axis, row]
        if column == 0:
            real[row], imaginary[row] = np.cos(angle) - offset[row], np.sin(angle)
        else:
            real[row] = SECOND * (np.cos(angle) - offset[row])
            imaginary[row] = SECOND * np.sin(angle)
    normal = scaled_identity(size, RIDGE)
    begin = 2 * column * size
    for first in range(size):
        line, along, across = rows[first], 0.0, 0.0
        for row in range(m):
            along += line[row] * real[row]
            across += line[row] * imaginary[row]
        z[begin + first], z[begin + size + first] = along, across
        for second in range(first + 1):
            total = 0.0
            for row in range(m):
                total += line[row] * rows[second, row]
            normal[first, second] += total
    inverse = np.empty(size)
    factor(normal, inverse)
    solve(normal, inverse, z[begin : begin + size])
    solve(normal, inverse, z[begin + size : begin + 2 * size])


@compiled
def keep_warm(shape: Shape, warm: ComplexArray) -> None:
    """Start from a beam given, ``(r N,)``, where it is not much worse than what there is.

    Two columns are turned into each other until the own object receives the first alone: neither
    power nor any pattern changes.
    """
    basis, parts = shape.basis, shape.response.shape[0]
    size, n_tx, columns = basis.shape[0] - 1, basis.shape[1], parts // 2
    coordinates = np.empty((columns, n_tx), dtype=np.complex128)
    own = np.zeros(2, dtype=np.complex128)
    for column in range(columns):
        from_antennas(warm[column * n_tx : (column + 1) * n_tx], coordinates[column])
        for antenna in range(n_tx):
            own[column] += basis[0, antenna] * coordinates[column, antenna]
    gain = own[0].real ** 2 + own[0].imag ** 2 + own[1].real ** 2 + own[1].imag ** 2
    if not 0.0 < gain < np.inf:  # a beam without power, or none at all
        return
    scale = 1.0 / gain
    given = np.empty(parts * size)
    total = gain
    for place in range(size):
        value = np.zeros(2, dtype=np.complex128)
        for column in range(columns):
            for antenna in range(n_tx):
                value[column] += basis[1 + place, antenna] * coordinates[column, antenna]
        first = (own[0].conjugate() * value[0] + own[1].conjugate() * value[1]) * scale
        given[place], given[size + place] = first.real, first.imag
        if columns > 1:
            second = (own[0] * value[1] - own[1] * value[0]) * scale
            given[2 * size + place], given[3 * size + place] = second.real, second.imag
        for column in range(columns):
            total += value[column].real ** 2 + value[column].imag ** 2
    if not (total < np.inf and np.sqrt(gain) > 1e-3 * np.sqrt(total)):
        return
    if _cost(shape, given) < WORSE * _cost(shape, shape.z):
        copy_into(shape.z, given)
        shape.scalars[BARRIER] = min(shape.scalars[BARRIER], WARM_BARRIER)


@compiled
def _cost(shape: Shape, z: Array) -> float:
    """Return the power of coordinates, with a penalty for ripple beyond what is allowed."""
    response = np.empty(shape.response.shape)
    respond_from(shape.rows, shape.offset, z, response)
    excess = 0.0
    for row in range(shape.low.size):
        excess = max(excess, abs(received(response, row) - 1.0))
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
        excess = max(excess, abs(received(response, row) - 1.0))
    target = scalars[TARGET]
    scalars[RIPPLE] = max(target, excess / power + SAFE * target)
    slacks(response, scalars[RIPPLE] * power, low, high)
    for row in range(low.size):
        low[row] = scalars[BARRIER] / low[row]
        high[row] = scalars[BARRIER] / high[row]
