"""Background channel of a flying monostatic sensor: reference points of TR 38.901, clause 7.9.4.2.

What a radar receives besides its targets, the standard stands for by three reference points around
the sensor, 120 degrees apart. Their distance on the ground and their height follow Gamma laws whose
parameters depend on the sensor's height (table 7.9.4.2-2, part 2). Each has the path loss and the
shadow fading of a link without line of sight (TR 36.777, tables B-2 and B-3), Eq. (7.9.4-15). The
clusters of clause 7.5 are left out: a point is a single path.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array

POINTS = 3
"""Reference points, clause 7.9.4.2, step 2."""

DRAWS = 5
"""Standard normals of a point: distance, height, shadow fading, two of its amplitude."""


@dataclass(frozen=True, slots=True)
class GammaLaw:
    """Law G(shape, rate) + offset of a length in m; parameters at a height of the sensor, m."""

    shape: Callable[[float], float]
    rate: Callable[[float], float]
    offset: Callable[[float], float]

    def quantile(self, normal: Array, height: float) -> Array:
        """Return lengths, m, of the same probability as standard normals."""
        from scipy.special import gammaincinv, ndtr

        shape, rate = self.shape(height), self.rate(height)
        length: Array = gammaincinv(shape, ndtr(normal)) / rate + self.offset(height)
        return length

    def mean(self, height: float) -> float:
        """Return its mean, m."""
        return self.shape(height) / self.rate(height) + self.offset(height)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Scenario of the standard.

    Attributes
    ----------
    distance, height
        Laws of the reference points.
    path_loss
        dB without line of sight, of the sensor's height, m, the distance, m, and the carrier, GHz.
    shadowing
        Standard deviation of the shadow fading, dB.
    lowest, highest
        Heights of the sensor for which the path loss is stated, m, the first one excluded.
    """

    distance: GammaLaw
    height: GammaLaw
    path_loss: Callable[[float, Array, float], Array]
    shadowing: float
    lowest: float
    highest: float


def _first_metre(gigahertz: float) -> float:
    """Return 20 lg(40 pi f_c / 3), f_c in GHz: the free-space loss at 1 m, dB."""
    return 20.0 * math.log10(40.0 * math.pi * gigahertz / 3.0)


def _uma(h: float, d: Array, f: float) -> Array:
    return -17.5 + (46.0 - 7.0 * math.log10(h)) * np.log10(d) + _first_metre(f)


def _rma(h: float, d: Array, f: float) -> Array:
    sight = max(23.9 - 1.8 * math.log10(h), 20.0) * np.log10(d) + _first_metre(f)
    hidden = -12.0 + (35.0 - 5.3 * math.log10(h)) * np.log10(d) + _first_metre(f)
    return np.maximum(sight, hidden)


def _umi(h: float, d: Array, f: float) -> Array:
    free = 20.0 * np.log10(d) + _first_metre(f)
    carrier = 20.0 * math.log10(f)
    sight = 30.9 + (22.25 - 0.5 * math.log10(h)) * np.log10(d) + carrier
    hidden = 32.4 + (43.2 - 7.6 * math.log10(h)) * np.log10(d) + carrier
    return np.maximum(np.maximum(free, sight), hidden)


SURROUNDINGS = {
    "umi-av": Surroundings(
        GammaLaw(
            lambda h: 0.0156 * h + 5.5399,
            lambda h: 40.4517 / (h + 254.6318),
            lambda h: 0.0140 * h + 15.1184,
        ),
        GammaLaw(
            lambda h: 0.0123 * h + 11.9569,
            lambda h: 17.8047 / (h - 0.2202),
            lambda h: 0.0532 * h - 0.0120,
        ),
        _umi,
        8.0,
        22.5,
        300.0,
    ),
    "uma-av": Surroundings(
        GammaLaw(
            lambda h: 0.83 + 0.00015 * h,
            lambda h: 1.0 / (536.305 + 1.0279 * h),
            lambda h: 13.824 + 0.03085 * h,
        ),
        GammaLaw(
            lambda h: 0.9054 - 0.0001117 * h,
            lambda h: 1.0 / (38.672 - 0.04658 * h),
            lambda h: 25.4898 - 0.02398 * h,
        ),
        _uma,
        6.0,
        22.5,
        100.0,
    ),
    "rma-av": Surroundings(
        GammaLaw(
            lambda h: 4.423 + 0.001926 * h,
            lambda h: 1.0 / (3.8467 + 0.6547 * h),
            lambda h: 3.864 + 0.1538 * h,
        ),
        GammaLaw(
            lambda h: 1.4231 + 0.00192 * h,
            lambda h: 1.0 / (1.7157 - 0.00538 * h),
            lambda h: 2.6541 - 0.003851 * h,
        ),
        _rma,
        6.0,
        10.0,
        40.0,
    ),
}
"""By the name in a scenario file; tables 7.9.4.2-2 part 2, B-2 and B-3."""


@dataclass(frozen=True, slots=True)
class ReferencePoints:
    """Reference points of T trials.

    Attributes
    ----------
    offset
        ``(T, POINTS, 3)`` m: from the sensor's place on the ground, x, y, and the height z.
    amplitude
        ``(T, POINTS)``: complex, of the power gain 10^(-(PL + SF) / 10) between isotropic
        antennas relative to that of 1 m of free space, times that of a complex normal number.
    """

    offset: Array
    amplitude: np.ndarray


def reference_points(
    surroundings: Surroundings, height: float, carrier: float, azimuth: Array, normals: Array
) -> ReferencePoints:
    """Return the reference points of some trials.

    Parameters
    ----------
    surroundings
        Scenario of the standard.
    height, carrier
        The sensor's, m and Hz.
    azimuth
        ``(T,)``: a standard normal, of the first point's azimuth, uniform over the circle.
    normals
        ``(T, POINTS, DRAWS)``: standard normals of each.
    """
    from scipy.special import ndtr

    far = surroundings.distance.quantile(normals[..., 0], height)
    high = surroundings.height.quantile(normals[..., 1], height)
    turn = 2.0 * np.pi * (ndtr(azimuth)[:, None] + np.arange(POINTS) / POINTS)
    offset = np.stack([far * np.cos(turn), far * np.sin(turn), high], axis=-1)
    distance = np.hypot(far, height - high)
    gigahertz = 1e-9 * carrier
    lost = surroundings.path_loss(height, distance, gigahertz)
    lost = lost + surroundings.shadowing * normals[..., 2]
    first = 20.0 * math.log10(4.0 * math.pi * carrier / SPEED_OF_LIGHT)
    scattered = (normals[..., 3] + 1j * normals[..., 4]) / np.sqrt(2.0)
    return ReferencePoints(offset, scattered * 10.0 ** (-0.05 * (lost - first)))
