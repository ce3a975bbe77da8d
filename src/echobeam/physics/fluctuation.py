"""Laws of an echo's fluctuation: its strength, the power over its mean, anew in every slot.

A law draws the amplitude from standard normals, and says how often a square-law detector in noise
of known power, of threshold -ln P_FA, finds such an echo.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np

from echobeam.values import Array, ComplexArray

NODES = 48
"""Nodes of the quadrature over a log-normal law: its errors are below 1e-8 of a probability, for
deviations of 2.5 to 4 dB, false-alarm rates from 1e-9 to 1e-2 and any SNR."""

LOWEST = -6.0
"""Standard normal from which the quadrature begins: 1e-9 of the law is below."""


class Fluctuation(Protocol):
    """Law of the strength of an echo, of mean 1 or close to it."""

    @property
    def steady(self) -> bool:
        """Whether the strength is always 1."""

    def amplitude(self, normals: Array) -> ComplexArray:
        """Return amplitudes ``(...)`` drawn from standard normals ``(..., 2)``."""

    def detection(self, snr: Array, false_alarm: float) -> Array:
        """Return the probability of detection at mean SNRs ``(...)``, at least zero."""

    def beyond(self, least: Array, luck: Array) -> Array:
        """Return strengths ``(...)`` that exceed `least`, drawn from standard normals."""


@dataclass(frozen=True, slots=True)
class Steady:
    """Constant amplitude (Swerling 0)."""

    @property
    def steady(self) -> bool:
        """The strength is always 1."""
        return True

    def amplitude(self, normals: Array) -> ComplexArray:
        """Return ones."""
        return np.ones(normals.shape[:-1], dtype=np.complex128)

    def detection(self, snr: Array, false_alarm: float) -> Array:
        """Return Q_1(sqrt(2 SNR), sqrt(-2 ln P_FA)), Marcum's function."""
        from scipy.stats import ncx2

        found: Array = ncx2.sf(-2.0 * np.log(false_alarm), 2, 2.0 * np.minimum(snr, 1e6))
        return found

    def beyond(self, least: Array, luck: Array) -> Array:
        """Return ones: a constant echo is detected by the noise beside it."""
        return np.ones(least.shape)


STEADY = Steady()
"""Law of an echo that does not fluctuate: it has no parameters."""


@dataclass(frozen=True, slots=True)
class SwerlingOne:
    """Complex Gaussian amplitude: a strength of the exponential law."""

    @property
    def steady(self) -> bool:
        """The strength is drawn."""
        return False

    def amplitude(self, normals: Array) -> ComplexArray:
        """Return complex Gaussian amplitudes of unit mean power."""
        drawn: ComplexArray = (normals[..., 0] + 1j * normals[..., 1]) / np.sqrt(2.0)
        return drawn

    def detection(self, snr: Array, false_alarm: float) -> Array:
        """Return P_FA^(1 / (1 + SNR)) (Richards, Fundamentals of Radar Signal Processing, 6.3)."""
        return np.asarray(false_alarm ** (1.0 / (1.0 + snr)))

    def beyond(self, least: Array, luck: Array) -> Array:
        """Return the least strength and an exponential excess: the law has no memory."""
        from scipy.special import log_ndtr

        strength: Array = least - log_ndtr(luck)
        return strength


@dataclass(frozen=True, slots=True)
class LogNormal:
    """Log-normal strength of the standard, sigma_S of TR 38.901, clauses 7.9.2.1 and 7.9.4.1.

    10 lg(sigma_S) has the mean mu = -(ln 10 / 20) s^2 of formula 7.9.2-1, so that the linear mean
    is 1, and values above mu + 3 s are replaced by it, formula 7.9.4-1. The phase is uniform.

    Attributes
    ----------
    std
        s, dB.
    """

    std: float

    @property
    def steady(self) -> bool:
        """The strength is drawn."""
        return False

    def strength(self, normal: Array) -> Array:
        """Return the strength ``(...)`` of standard normals, 10^((mu + s min(g, 3)) / 10)."""
        mean = -math.log(10.0) / 20.0 * self.std**2
        strength: Array = 10.0 ** (0.1 * (mean + self.std * np.minimum(normal, 3.0)))
        return strength

    def amplitude(self, normals: Array) -> ComplexArray:
        """Return amplitudes of the first normals' strength and the second ones' phase."""
        from scipy.special import ndtr

        phase = np.exp(2j * np.pi * ndtr(normals[..., 1]))
        drawn: ComplexArray = np.sqrt(self.strength(normals[..., 0])) * phase
        return drawn

    def detection(self, snr: Array, false_alarm: float) -> Array:
        """Return the mean of Marcum's function over the strength, by Gauss's quadrature.

        The law's density between `LOWEST` and the cut, and its mass at the cut.
        """
        normal, weight = _nodes()
        each = Steady().detection(snr[..., None] * self.strength(normal), false_alarm)
        found: Array = each @ weight
        return found

    def beyond(self, least: Array, luck: Array) -> Array:
        """Return strengths of the normal law beyond the least one, at most that of the cut."""
        from scipy.special import ndtr, ndtri

        mean = -math.log(10.0) / 20.0 * self.std**2
        with np.errstate(divide="ignore", invalid="ignore"):
            lowest = (10.0 * np.log10(least) - mean) / self.std
            above = ndtr(-lowest) * ndtr(luck)
        return self.strength(-ndtri(above))


@cache
def _nodes() -> tuple[Array, Array]:
    """Return nodes ``(n,)`` and weights of the normal law below 3, and of its rest at 3."""
    from scipy.special import ndtr

    node, weight = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * (3.0 - LOWEST)
    normal = LOWEST + half * (node + 1.0)
    density = np.exp(-0.5 * normal**2) / math.sqrt(2.0 * math.pi)
    nodes, weights = np.append(normal, 3.0), np.append(half * weight * density, ndtr(-3.0))
    weights /= weights.sum()
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights
