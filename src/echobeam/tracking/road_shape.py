"""Shape of a belief about a position: what its density has beyond its two moments.

Distance and height leave the side of the UAV open, and where a beam has its null the variance of a
measurement changes by orders of magnitude: then the posterior has several modes, or long tails.
Only its moments would be left of it after every slot (assumed density filtering), and what the
tails have would be lost for good, also the true place. The shape is the ratio of the density to the
Gaussian of the same moments, at fixed points of the standardised position. It is carried to the
next slot as it is: an affine motion does not change it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from echobeam.brief import Brief
from echobeam.tracking.road_grid import PositionGrid
from echobeam.values import Array, BoolArray

POINTS = 64
"""Points of a shape."""

REACH = 5.0
"""Standard deviations to either side that every shape covers."""

FARTHEST = 16.0
"""Largest number of these: a second mode of a probability below 1/16^2 may be beyond."""

NOTHING = 1e-6
"""Probability of a point of the grid that a shape leaves out."""

LARGEST = 300.0
"""Largest logarithm of a ratio; the Gaussian's own at 16 standard deviations is 128."""

BENT = 0.05
"""Divergence of a posterior from its Gaussian, nat, above which it has a shape."""

PURE = 0.9
"""Least squared correlation of the positions of two slots with which a shape is carried on.

Below it the uncertain velocity blurs the shape towards a Gaussian."""


@dataclass(frozen=True, slots=True, repr=False)
class Shape(Brief):
    """Shapes of beliefs.

    Attributes
    ----------
    log_ratio
        ``(..., P)``: logarithm of the ratio, equally spaced; 0 where a belief is Gaussian.
    reach
        ``(...)``: standard deviations to either side of the mean that the points cover.
    """

    log_ratio: Array
    reach: Array

    @property
    def bent(self) -> BoolArray:
        """``(...)``: beliefs that have one."""
        return np.asarray((self.log_ratio != 0.0).any(axis=-1))

    def where(self, mask: BoolArray) -> Shape:
        """Return the shapes of a mask ``(...)``, none elsewhere."""
        return Shape(
            np.where(mask[..., None], self.log_ratio, 0.0), np.where(mask, self.reach, REACH)
        )

    def placed(self, chosen: BoolArray, other: Shape) -> Shape:
        """Return the shapes with those of another ``(M, ...)`` at a mask."""
        log_ratio, reach = self.log_ratio.copy(), self.reach.copy()
        log_ratio[chosen], reach[chosen] = other.log_ratio, other.reach
        return Shape(log_ratio, reach)

    def for_each(self, change: Callable[[Array], Array]) -> Shape:
        """Return the same with a change of the objects' axis."""
        return Shape(change(self.log_ratio), change(self.reach))

    def __getitem__(self, chosen: Any) -> Shape:
        """Return the shapes at a mask or an index of the leading axes."""
        return Shape(self.log_ratio[chosen], self.reach[chosen])


def gaussian_shape(where: tuple[int, ...]) -> Shape:
    """Return no shape for beliefs ``(...)``."""
    return Shape(np.zeros((*where, POINTS)), np.full(where, REACH))


def shape_of(grid: PositionGrid, weight: Array, mean: Array, cov: Array) -> Shape:
    """Return the shapes of posteriors on a grid; none where they are nearly Gaussian.

    Between points of the grid the logarithm is interpolated linearly, beyond them it is that of
    the last point.

    Parameters
    ----------
    grid, weight
        The grid, and ``(..., G)`` weights on it.
    mean, cov
        ``(..., S)``, ``(..., S, S)``: moments of the posterior.
    """
    ratio = _log_ratio(grid, weight, mean, cov)
    with np.errstate(invalid="ignore"):
        divergence = np.where(weight > 0.0, weight * ratio, 0.0).sum(axis=-1)  # Kullback-Leibler
    bent = np.asarray(divergence > BENT)
    none = gaussian_shape(bent.shape)
    if not bent.any():
        return none
    part = replace(grid, state=grid.state[bent], step=grid.step[bent])
    found = _interpolated(part, ratio[bent], weight[bent], mean[bent, 0], cov[bent, 0, 0])
    return none.placed(bent, found)


def carried(shape: Shape, before: Array, after: Array, slot_duration: float) -> Shape:
    """Return the shapes of predictions; none where the velocity blurs them.

    Parameters
    ----------
    shape
        Of the posteriors.
    before, after
        ``(..., S, S)``: covariances of posterior and prediction, position and velocity first.
    slot_duration
        DT, s.
    """
    shared = before[..., 0, 0] + slot_duration * before[..., 0, 1]
    with np.errstate(all="ignore"):
        pure = shared**2 >= PURE * before[..., 0, 0] * after[..., 0, 0]
    return shape.where(np.asarray(pure))


def _log_ratio(grid: PositionGrid, weight: Array, mean: Array, cov: Array) -> Array:
    """Return the logarithm of the density over the Gaussian's at the points of the grid."""
    with np.errstate(all="ignore"):
        off = (grid.state[..., 0] - mean[..., :1]) ** 2 / cov[..., 0, 0][..., None]
        scale = np.log(grid.step / np.sqrt(2.0 * np.pi * cov[..., 0, 0]))
        return np.asarray(np.log(weight) - scale[..., None] + 0.5 * off)


def _interpolated(
    grid: PositionGrid, ratio: Array, weight: Array, mean: Array, variance: Array
) -> Shape:
    """Return the ratios ``(M, G)`` of positions of these moments at the points of shapes."""
    std, x = np.sqrt(variance), grid.state[..., 0]
    with np.errstate(all="ignore"):
        away = np.where(weight > NOTHING, np.abs(x - mean[:, None]), 0.0).max(axis=-1)
        reach = np.clip((away + grid.step) / std, REACH, FARTHEST)
        place = mean[:, None] + (reach * std)[:, None] * np.linspace(-1.0, 1.0, POINTS)
        at = (place - x[:, :1]) / grid.step[:, None]
    at = np.clip(at, 0.0, ratio.shape[-1] - 1.0)
    left = np.minimum(at.astype(np.int64), ratio.shape[-1] - 2)
    ratio = np.clip(ratio, -LARGEST, LARGEST)
    low = np.take_along_axis(ratio, left, axis=-1)
    high = np.take_along_axis(ratio, left + 1, axis=-1)
    return Shape(low + (at - left) * (high - low), reach)
