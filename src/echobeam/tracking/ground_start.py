"""The first state of an object on the plane, from one measurement."""

from __future__ import annotations

import numpy as np

from echobeam.tracking.gaussian_sum import Law, SumPosterior, level, posterior
from echobeam.tracking.ground import GroundMeasurement
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, UavState

REACH = 5.0
"""Standard deviations of the measured place, to either side, in which a new object is sought."""

MARGIN = 5.0
"""Length in m by which the delay's own error is exceeded at least: no rectangle is of size zero."""


def first_state(
    value: Array,
    variance: Array,
    law: Law,
    model: GroundMeasurement,
    uav: UavState,
    stds: tuple[float, float, float],
    points: int,
) -> SumPosterior:
    """Return the posterior of a first measurement, before which every position is as likely.

    The rectangle of positions is that of the measured direction and distance, by their errors, no
    longer than the distance.

    Parameters
    ----------
    value
        ``(..., 4)``: u, v, delay, Doppler, NaN where not measured; the delay must be.
    variance
        ``(..., 4)``: at the measured place, by which it is found where to look.
    law
        The law of the variance, or a constant.
    model, uav
        The measurement model, and the UAV in the slot.
    stds
        Prior standard deviations of both velocities and the altitude error, m/s and m.
    points
        Gaussians along each axis.
    """
    centre, reach = sought(value, variance, model, uav)
    return posterior(level(centre, reach, points, stds), value, law, model, uav)


def sought(
    value: Array, variance: Array, model: GroundMeasurement, uav: UavState
) -> tuple[Array, Array]:
    """Return the rectangle in which a new object is sought, along x and y.

    Parameters
    ----------
    value, variance, model, uav
        As for `first_state`.

    Returns
    -------
    centre, reach
        ``(..., 2)`` m, and ``(..., 2, 2)`` m: from the centre to two neighbouring edges, by row.
    """
    measured = np.isfinite(value) & np.isfinite(variance)
    wide = REACH * np.sqrt(np.where(measured, variance, 0.0))
    wide[..., :2] = np.where(measured[..., :2], wide[..., :2], 1.0)
    cosine = np.clip(np.where(measured, value, 0.0)[..., :2], -1.0, 1.0)
    size = np.abs(cosine)
    low, middle, high = (
        _third(size + shift * wide[..., :2]) for shift in (1.0, 0.0, -1.0)
    )  # cosine to where the array faces
    both = measured[..., :2].all(axis=-1)  # else the side that the array faces is open, too
    middle = np.where(both, middle, 0.0)
    sight = np.concatenate([cosine, middle[..., None]], axis=-1)
    turn = np.concatenate([wide[..., :2], np.maximum(high - middle, middle - low)[..., None]], -1)
    axes = np.array([*model.array, model.facing])[:, :2]
    distance = 0.5 * SPEED_OF_LIGHT * value[..., 2, None]
    beyond = 0.5 * SPEED_OF_LIGHT * wide[..., 2, None] + MARGIN
    place = distance * (sight @ axes)
    off = distance * (turn @ np.abs(axes)) + beyond
    farthest = distance + beyond
    lower, upper = (np.clip(place + side * off, -farthest, farthest) for side in (-1.0, 1.0))
    centre = uav.position[:2] + 0.5 * (lower + upper)
    return centre, 0.5 * (upper - lower)[..., None] * np.eye(2)


def _third(size: Array) -> Array:
    """Return the third direction cosine, not negative, of two absolute ones ``(..., 2)``."""
    squares = np.square(np.maximum(size, 0.0)).sum(axis=-1)
    third: Array = np.sqrt(np.maximum(1.0 - squares, 0.0))
    return third
