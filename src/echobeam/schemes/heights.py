"""Depth of a measured place below the UAV, by which what is off the ground is told."""

from __future__ import annotations

import numpy as np

from echobeam.physics.coordinates import Geometry
from echobeam.physics.plane import GroundGeometry
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array


def depth_of(value: Array, variance: Array, geometry: Geometry) -> tuple[Array, Array]:
    """Return the depth below the UAV and its variance, ``(...)`` m and m^2, to first order.

    Parameters
    ----------
    value, variance
        ``(..., M)``: measurements, and their variances.
    geometry
        Their coordinates.
    """
    if isinstance(geometry, GroundGeometry):
        return _on_ground(value, variance, geometry)
    angle, distance = value[..., 0], 0.5 * SPEED_OF_LIGHT * value[..., 1]
    square = (distance * np.cos(angle)) ** 2 * variance[..., 0]
    square += (0.5 * SPEED_OF_LIGHT * np.sin(angle)) ** 2 * variance[..., 1]
    return distance * np.sin(angle), square


def _on_ground(value: Array, variance: Array, geometry: GroundGeometry) -> tuple[Array, Array]:
    """Return depth and variance of direction cosines and delay.

    The slope by a cosine is that of a chord over its standard deviation: at the edge of the visible
    region the derivative has no end.
    """
    distance = 0.5 * SPEED_OF_LIGHT * value[..., 2]
    down = -geometry.sight(value[..., :2])[..., 2]
    square = (0.5 * SPEED_OF_LIGHT * down) ** 2 * variance[..., 2]
    for axis in range(2):
        step = np.zeros((*value.shape[:-1], 2))
        step[..., axis] = np.sqrt(np.minimum(variance[..., axis], 1.0))
        ends = [-geometry.sight(value[..., :2] + side * step)[..., 2] for side in (-1.0, 1.0)]
        square += (distance * np.maximum(*(np.abs(end - down) for end in ends))) ** 2
    return distance * down, square
