"""What a design keeps and what none can beat, judged without any solver.

A solver never marks its own homework: nothing here imports one. The residuals are evaluated on
the antenna weights themselves and on the full grid of (38f).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.coverage import cover_grid
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem
from echobeam.physics.planar import AntennaArray
from echobeam.values import Array, BoolArray, ComplexArray

FEASIBLE = 1e-6
"""Largest relative violation of a design that passes for feasible."""

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


def violation(problem: BeamProblem, beams: ComplexArray) -> Violation:
    """Return how far beams are from feasible, Eqs. (38b), (38e), (38f); infinite for NaN beams.

    Parameters
    ----------
    problem
        The problem with K objects.
    beams
        ``(K, n)`` complex, sqrt(power).
    """
    if not np.isfinite(beams).all():
        return Violation(np.inf, np.inf, np.inf)
    spent = float(np.sum(np.abs(beams) ** 2))
    covers = problem.angles, problem.coverage_halfwidths
    grid, mask = cover_grid(problem.array, *covers, problem.resolution)
    excess = coverage_excess(beams, problem.angles, grid, mask, problem.ripple, problem.array)
    shortfall = rate_shortfall(rates(problem, beams), problem.min_rate)
    return Violation(
        power=max(0.0, spent / problem.power - 1.0),
        rate=float(np.max(shortfall, initial=0.0)),
        coverage=float(np.max(excess, initial=0.0)),
    )


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
