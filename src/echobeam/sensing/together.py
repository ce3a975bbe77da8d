"""Joint maximum of the likelihood over all echoes of a slot, by damped Gauss-Newton steps.

Subtracting one echo at a time bends the estimates of echoes less than a cell or two apart. Here the
unknowns of all move together (Levenberg and Marquardt), so that the error is that of their joint
bound.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echobeam.sensing.directions import within
from echobeam.sensing.information import derivatives
from echobeam.sensing.target import Point, Receiver, rebuilt, replica
from echobeam.values import Array, BoolArray, ComplexArray

_STEPS = 25
_START = 1e-2
"""Damping of the first step, relative to the information of each unknown."""


def refine_together(
    signal: ComplexArray, points: Sequence[Point], valid: Sequence[BoolArray], known: Receiver
) -> list[Point]:
    """Return the joint maximum near D estimates of ``(T,)``.

    Parameters
    ----------
    signal
        ``(T, N_r, N M)``.
    points, valid
        The estimates, and which of them are echoes; the others stay as they are.
    known
        The receiver.
    """
    best = _values(points)
    residual = signal - _sum(_points(best, points, known), valid, known)
    misfit = _energy(residual)
    damping = np.full(len(misfit), _START)
    for _ in range(_STEPS):
        here = derivatives(_points(best, points, known), valid, known)
        step = _step(here.information(known.noise), here.gradient(residual, known.noise), damping)
        tried = best + step.reshape(best.shape)
        axes = known.receiver.axes
        if axes == 1:
            tried[..., 0] = within(known.receiver, tried[..., 0])
        else:
            tried[..., :axes] = within(known.receiver, tried[..., :axes])
        rest = signal - _sum(_points(tried, points, known), valid, known)
        energy = _energy(rest)
        better = energy < misfit
        best = np.where(better[:, None, None], tried, best)
        residual = np.where(better[:, None, None], rest, residual)
        misfit = np.where(better, energy, misfit)
        damping = np.clip(np.where(better, 0.2 * damping, 10.0 * damping), 1e-9, 1e9)
    return _points(best, points, known)


def _values(points: Sequence[Point]) -> Array:
    """Return the unknowns, ``(T, D, 4 + A)``."""
    return np.stack(
        [
            np.stack(
                [*_directions(p), p.delay, p.doppler, p.amplitude.real, p.amplitude.imag], axis=-1
            )
            for p in points
        ],
        axis=1,
    )


def _directions(point: Point) -> list[Array]:
    """Return the components of the direction, ``(T,)`` each."""
    return [point.u] if point.u.ndim == 1 else list(point.u.T)


def _points(values: Array, before: Sequence[Point], known: Receiver) -> list[Point]:
    """Return estimates of given unknowns, with their likelihood ratios as single echoes."""
    found = []
    for place in range(len(before)):
        *direction, delay, doppler, real, imaginary = np.moveaxis(values[:, place], -1, 0)
        u = direction[0] if known.receiver.axes == 1 else np.stack(direction, axis=-1)
        amplitude = real + 1j * imaginary
        lit = np.sum(np.abs(replica(u, known)) ** 2, axis=-1)
        statistic = np.abs(amplitude) ** 2 * lit * known.receiver.n / known.noise
        found.append(Point(u, delay, doppler, amplitude, statistic))
    return found


def _sum(points: Sequence[Point], valid: Sequence[BoolArray], known: Receiver) -> ComplexArray:
    parts = (
        np.where(passed[:, None, None], rebuilt(point, known), 0.0)
        for point, passed in zip(points, valid, strict=True)
    )
    total: ComplexArray = sum(parts, start=np.zeros((), dtype=np.complex128))
    return total


def _energy(residual: ComplexArray) -> Array:
    energy: Array = np.sum(np.abs(residual) ** 2, axis=(-2, -1))
    return energy


def _step(information: Array, gradient: Array, damping: Array) -> Array:
    """Return the damped step, ``(T, (4 + A) D)``; zero in unknowns without information."""
    diagonal = np.diagonal(information, axis1=-2, axis2=-1)
    scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
    unit = information * scale[..., :, None] * scale[..., None, :]
    damped = unit + (damping[:, None, None] + 1e-12) * np.eye(unit.shape[-1])
    step = np.linalg.solve(damped, (gradient * scale)[..., None])[..., 0] * scale
    return np.asarray(step)
