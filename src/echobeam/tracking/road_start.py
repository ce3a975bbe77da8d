"""The first state of an object on the road, from one measurement, on finer and finer grids."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echobeam.tracking import road_grid
from echobeam.tracking.models import MeasurementModel
from echobeam.tracking.road_grid import PositionGrid
from echobeam.values import Array, UavState

FARTHEST = 500.0
"""Largest distance along the road at which a new object is sought, m."""

STAGES = 4
"""Grids on which a first position is sought, each where the one before has found it."""

NOTHING = 1e-6
"""Largest probability of a cell that the next of these grids leaves out."""


def first_state(
    value: Array,
    law: Callable[[PositionGrid], Array],
    model: MeasurementModel,
    uav: UavState,
    stds: tuple[float, ...],
    points: int,
) -> tuple[PositionGrid, Array, Array, Array]:
    """Return the last grid and the moments of the posterior of a first measurement.

    Every position within `FARTHEST` is as likely before. Where angle and distance leave the side
    open, the moments are those of both sides together.

    Parameters
    ----------
    value
        ``(..., 3)``: the measurement, NaN where a component was not measured.
    law
        Variance of the measurement ``(..., G, 3)`` at the points of a grid, or ``(..., 1, 3)``.
    model, uav
        The measurement model, and the UAV in the slot.
    stds
        Prior standard deviations of velocity and altitude error, m/s and m.
    points
        Of each grid.

    Returns
    -------
    grid, weight
        The last grid, and the posterior ``(..., G)`` on it.
    mean, cov
        ``(..., 3)`` and ``(..., 3, 3)``: x, v, b in m, m/s, m.
    """
    near, far = uav.position[0] - FARTHEST, uav.position[0] + FARTHEST
    low = np.full(value.shape[:-1], near)
    high = np.full(value.shape[:-1], far)
    for _ in range(STAGES - 1):
        grid = road_grid.flat_grid(low, high, points, stds)
        weight = road_grid.weights(grid, value, law(grid), model, uav)
        x = grid.state[..., 0]
        there = weight > NOTHING
        half = 0.5 * grid.step
        low = np.where(there, x, np.inf).min(axis=-1) - half
        high = np.where(there, x, -np.inf).max(axis=-1) + half
    grid = road_grid.flat_grid(low, high, points, stds)
    return grid, *road_grid.posterior(grid, value, law(grid), model, uav)
