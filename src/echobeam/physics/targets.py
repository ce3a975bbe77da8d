"""Radar cross-section of the standard's sensing targets, 3GPP TR 38.901 v19.4, clause 7.9.2.1.

sigma = sigma_M sigma_D sigma_S: a mean, a pattern over the aspect, and a fluctuation of unit mean.
The pattern is that of a target with one scattering point, seen by a monostatic radar: the
bistatic angle is zero, and the bisector of formula 7.9.2-3 is the direction from the target to the
radar. Its zenith and azimuth are in the target's frame: the front has azimuth 0 and zenith 90
degrees, the left azimuth 90, the roof zenith 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from echobeam.physics.fluctuation import LogNormal
from echobeam.values import Array


@dataclass(frozen=True, slots=True)
class Lobe:
    """Row of a table of RCS model 2: the pattern over a range of aspects.

    Attributes
    ----------
    azimuth, azimuth_width
        phi_center and phi_3dB, degrees; an azimuth of None has no pattern over it and all azimuths.
        Others reach 45 degrees to either side.
    zenith, zenith_width
        theta_center and theta_3dB, degrees.
    peak, depth
        G_max, dBsm, which holds sigma_M; sigma_max, dB.
    lowest, highest
        Range of the zenith, degrees, the highest excluded unless it is 180.
    """

    azimuth: float | None
    azimuth_width: float
    zenith: float
    zenith_width: float
    peak: float
    depth: float
    lowest: float
    highest: float

    def pattern(self, zenith: Array, azimuth: Array) -> Array:
        """Return 10 lg(sigma_M sigma_D) of formula 7.9.2-3, ``(...)`` dBsm; NaN out of its range.

        Parameters
        ----------
        zenith, azimuth
            ``(...)`` degrees.
        """
        inside = (zenith >= self.lowest) & ((zenith < self.highest) | (self.highest == 180.0))
        loss = np.minimum(12.0 * ((zenith - self.zenith) / self.zenith_width) ** 2, self.depth)
        if self.azimuth is not None:
            off = np.mod(azimuth - self.azimuth + 180.0, 360.0) - 180.0
            inside &= (off >= -45.0) & (off < 45.0)
            loss = loss + np.minimum(12.0 * (off / self.azimuth_width) ** 2, self.depth)
        return np.where(inside, self.peak - np.minimum(loss, self.depth), np.nan)


@dataclass(frozen=True, slots=True)
class Target:
    """Target of the standard.

    Attributes
    ----------
    mean
        10 lg(sigma_M), dBsm: the mean of the linear cross-section over all aspects.
    fluctuation
        sigma_S.
    lobes
        Pattern of RCS model 2; RCS model 1 has none.
    """

    mean: float
    fluctuation: LogNormal
    lobes: tuple[Lobe, ...] = ()

    @property
    def directional(self) -> bool:
        """Whether the cross-section depends on the aspect."""
        return bool(self.lobes)

    def pattern(self, zenith: npt.ArrayLike, azimuth: npt.ArrayLike) -> Array:
        """Return the cross-section 10 lg(sigma_M sigma_D), ``(...)`` dBsm, formulas 7.9.2-2 and -3.

        Parameters
        ----------
        zenith, azimuth
            ``(...)`` rad: direction to the radar in the target's frame, zenith 0 to pi; NaN gives
            NaN if the cross-section depends on it.
        """
        theta, phi = np.broadcast_arrays(np.degrees(zenith), np.degrees(azimuth))
        if not self.lobes:
            return np.full(theta.shape, self.mean)
        found = np.full(theta.shape, np.nan)
        for lobe in self.lobes:  # the ranges do not overlap
            found = np.fmax(found, lobe.pattern(theta, phi))
        return found

    def relative(self, zenith: npt.ArrayLike, azimuth: npt.ArrayLike) -> Array:
        """Return sigma_D, ``(...)``: the cross-section over its mean, see `pattern`."""
        relative: Array = 10.0 ** (0.1 * (self.pattern(zenith, azimuth) - self.mean))
        return relative


_Row = tuple[float, float, float, float, float]
"""Row of a table without its ranges: phi_3dB, theta_center, theta_3dB, G_max, sigma_max."""


def _sides(front: _Row, left: _Row, back: _Row, zeniths: tuple[float, float]) -> tuple[Lobe, ...]:
    """Return the four lobes around a target; the right is the left's mirror image."""
    rows = ((0.0, front), (90.0, left), (180.0, back), (270.0, left))
    return tuple(Lobe(azimuth, *row, *zeniths) for azimuth, row in rows)


def _cap(centre: float, row: tuple[float, float, float], zeniths: tuple[float, float]) -> Lobe:
    """Return the lobe of a roof or a bottom, alike at all azimuths."""
    return Lobe(None, np.inf, centre, *row, *zeniths)


TARGETS: Mapping[str, Target] = MappingProxyType(
    {
        # Table 7.9.2.1-1
        "3gpp-small-uav": Target(-12.81, LogNormal(3.74)),
        "3gpp-human": Target(-1.37, LogNormal(3.94)),
        # Table 7.9.2.1-2
        "3gpp-large-uav": Target(
            -5.85,
            LogNormal(2.50),
            (
                *_sides(
                    front=(14.19, 90.0, 16.53, 1.02, 7.89),
                    left=(7.13, 90.0, 8.68, 7.43, 14.30),
                    back=(10.09, 90.0, 11.43, 3.99, 10.86),
                    zeniths=(45.0, 135.0),
                ),
                _cap(0.0, (4.93, 13.55, 20.42), (0.0, 45.0)),
                _cap(180.0, (4.93, 13.55, 20.42), (135.0, 180.0)),
            ),
        ),
        # Table 7.9.2.1-4
        "3gpp-vehicle": Target(
            11.25,
            LogNormal(3.41),
            (
                *_sides(
                    front=(40.54, 71.75, 29.13, 15.52, 8.45),
                    left=(26.90, 79.70, 44.42, 20.75, 13.68),
                    back=(36.32, 79.65, 36.73, 14.56, 7.50),
                    zeniths=(30.0, 180.0),
                ),
                _cap(0.0, (18.13, 21.26, 14.19), (0.0, 30.0)),
            ),
        ),
        # Table 7.9.2.1-6
        "3gpp-agv": Target(
            -4.25,
            LogNormal(2.51),
            (
                *_sides(
                    front=(13.68, 90.0, 13.68, 13.02, 23.29),
                    left=(15.53, 75.0, 20.03, 7.33, 17.60),
                    back=(12.49, 90.0, 11.89, 11.01, 21.28),
                    zeniths=(30.0, 180.0),
                ),
                _cap(0.0, (11.44, 11.79, 22.06), (0.0, 30.0)),
            ),
        ),
    }
)
"""Targets by their names in ``radar.target``; of the human RCS model 1, alike from all sides."""
