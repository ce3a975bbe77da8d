"""What a design keeps and what none can beat, judged without any solver.

A solver never marks its own homework: nothing here imports one. The residuals are evaluated on
the antenna weights themselves and on the full grid of (38f).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.coverage import cover_grid, cover_size
from echobeam.beamforming.objective import beam_gains, rates_from_gains
from echobeam.beamforming.problem import BeamProblem, ProblemBatch, only_active
from echobeam.physics.planar import AntennaArray
from echobeam.values import Array, BoolArray, ComplexArray

FEASIBLE = 1e-6
"""Largest relative violation of a design that passes for feasible."""

EXAMINED = 2e6
"""Numbers of the full grids' steering vectors that are examined at a time."""

LEAST_RIPPLE = 1e-3
"""The coverage residual is relative to the allowed ripple, but to no less than this one."""


@dataclass(frozen=True, slots=True)
class Violation:
    """By how much a design misses each constraint of (38), relative; zero where it is met.

    Attributes
    ----------
    power
        (sum_k |w_k|^2 - P_T) / P_T, Eq. (38b).
    rate
        Largest (Gamma_k - R_k) / Gamma_k, Eq. (38e).
    coverage
        Largest excess over the allowed ripple, relative to it, Eq. (38f):
        (||a^H(theta_k) w_k|^2 - |a^H(cover) w_k|^2| - B_k |w_k|^2) / (B_k |w_k|^2), on the full
        grid; with 0.001 in place of a B_k below it in the denominator.
    """

    power: float
    rate: float
    coverage: float

    @property
    def largest(self) -> float:
        """Largest of the three."""
        return max(self.power, self.rate, self.coverage)


@dataclass(frozen=True, slots=True, eq=False)
class Violations:
    """Violations of T designs, ``(T,)`` each; see `Violation`."""

    power: Array
    rate: Array
    coverage: Array

    @property
    def largest(self) -> Array:
        """Largest of the three, ``(T,)``."""
        return np.maximum(np.maximum(self.power, self.rate), self.coverage)

    def trial(self, place: int) -> Violation:
        """Return those of one design."""
        parts = (self.power, self.rate, self.coverage)
        return Violation(*(float(part[place]) for part in parts))


def violation(problem: BeamProblem, beams: ComplexArray) -> Violation:
    """Return how far beams are from feasible, Eqs. (38b), (38e), (38f); infinite for NaN beams.

    Parameters
    ----------
    problem
        The problem with K objects.
    beams
        ``(K, n)`` complex, sqrt(power).
    """
    return violations(problem.batch(), beams[np.newaxis]).trial(0)


def violations(
    batch: ProblemBatch, beams: ComplexArray, floor_factor: Array | None = None
) -> Violations:
    """Return how far many designs are from feasible, see `violation`.

    Parameters
    ----------
    batch
        T problems; inactive objects are left out.
    beams
        ``(T, K, n)`` complex, sqrt(power).
    floor_factor
        ``(T,)``: part of every floor (38e) that is asked for; all of it by default.
    """
    n_trials = len(batch)
    factor = np.ones(n_trials) if floor_factor is None else floor_factor
    missed = np.zeros((3, n_trials))
    covers = only_active(batch.active, batch.coverage_halfwidths)
    points = cover_size(batch.array, covers, batch.resolution)
    size = max(1, int(EXAMINED / (points * max(1, batch.active.shape[1]) * batch.n_tx)))
    for begin in range(0, n_trials, size):
        part = np.arange(begin, min(begin + size, n_trials))
        missed[:, part] = _missed(batch.taken(part), beams[part], factor[part])
    return Violations(*missed)


def _missed(batch: ProblemBatch, beams: ComplexArray, factor: Array) -> Array:
    """Return the violations of power, floors and coverage, ``(3, T)``."""
    active = batch.active
    beams = only_active(active, beams)
    finite = np.asarray(np.isfinite(beams).all(axis=(1, 2)))
    beams = np.where(finite[:, np.newaxis, np.newaxis], beams, 0.0)
    angles, covers = (only_active(active, v) for v in (batch.angles, batch.coverage_halfwidths))
    grid, mask = cover_grid(batch.array, angles, covers, batch.resolution)
    excess = coverage_excess(beams, angles, grid, mask, batch.ripple, batch.array)
    spent = np.sum(np.abs(beams) ** 2, axis=(-2, -1)) / batch.power - 1.0
    gains = beam_gains(beams, angles, batch.array)
    achieved = rates_from_gains(gains, np.where(active, batch.loss, 1.0))
    floors = np.where(active, batch.min_rate, 0.0) * factor[:, np.newaxis]
    shortfall = rate_shortfall(achieved, floors).max(axis=-1, initial=0.0)
    parts = [np.maximum(spent, 0.0), shortfall, excess.max(axis=-1, initial=0.0)]
    return np.where(finite, np.stack(parts), np.inf)


def rate_shortfall(achieved: Array, min_rate: Array) -> Array:
    """Return max(0, (Gamma_k - R_k) / Gamma_k) of Eq. (38e); zero where no floor is asked.

    Parameters
    ----------
    achieved, min_rate
        ``(..., K)`` and a shape that fits, bit/s/Hz.
    """
    floor = np.where(min_rate > 0, min_rate, 1.0)
    return np.where(min_rate > 0, np.maximum(0.0, 1.0 - achieved / floor), 0.0)


def floor_part(achieved: Array, min_rate: Array) -> float:
    """Return the largest common part of the floors (38e) that is met; 1 if they all are.

    Parameters
    ----------
    achieved, min_rate
        ``(K,)`` bit/s/Hz.
    """
    asked = min_rate > 0.0
    return float(np.min(achieved[asked] / min_rate[asked], initial=1.0))


def coverage_excess(
    beams: ComplexArray,
    angles: Array,
    grid: Array,
    mask: BoolArray,
    ripple: Array,
    array: AntennaArray,
) -> Array:
    """Return by how much each beam exceeds its allowed ripple, relative, Eq. (38f).

    Parameters
    ----------
    beams
        ``(..., K, n)`` complex.
    angles
        ``(..., K)`` rad or ``(..., K, 2)`` direction cosines: centres.
    grid, mask
        `cover_grid`.
    ripple
        ``(K,)``, or of a shape that fits: B_k.
    array
        The transmit array.

    Returns
    -------
    Array
        ``(..., K)``, at least zero; zero for a beam without power.
    """
    points = mask.ndim - 1
    pattern = array.pattern(beams, np.concatenate([np.expand_dims(angles, points), grid], points))
    ripples = np.abs(pattern[..., 1:] - pattern[..., :1])
    worst = np.max(ripples, axis=-1, where=mask, initial=0.0)
    power = np.sum(np.abs(beams) ** 2, axis=-1)
    scale = np.maximum(ripple, LEAST_RIPPLE) * np.where(power > 0, power, 1.0)
    excess: Array = np.maximum(0.0, (worst - ripple * power) / scale)
    return excess


def numerical_rank(covariance: ComplexArray, tolerance: float = 1e-6) -> int:
    """Return how many eigenvalues exceed ``tolerance`` times the largest, Eq. (38d).

    Parameters
    ----------
    covariance
        ``(N, N)``, Hermitian: W_k.
    """
    eigenvalues = np.linalg.eigvalsh(covariance)
    if eigenvalues[-1] <= 0.0:
        return 0
    return int(np.sum(eigenvalues > tolerance * eigenvalues[-1]))
