"""The first state of an object on the plane, from one measurement."""

from __future__ import annotations

import numpy as np

from echobeam.tracking.gaussian_sum import Law, SumPosterior, level, posterior
from echobeam.tracking.ground import GroundMeasurement
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, UavState

REACH = 5.0
"""Standard deviations of the measured place, to either side, in which a new object is sought."""

ABREAST = 0.1
"""Half the width, over the farthest distance on the ground, of the part of a ring that stands for
all of it: its bend, a two-hundredth of its radius, is below the errors of a first measurement."""

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
    longer than the distance. One cosine, of an array of a single row or column, is the same at
    mirrored places, and of a vertical one on a whole ring: then it is on one side only.

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
    reach = 0.5 * (upper - lower)[..., None] * np.eye(2)
    one = measured[..., :2].sum(axis=-1) == 1
    for axis in range(2):
        only = one & measured[..., axis]
        if only.any():
            centre[only], reach[only] = _one_side(
                value[only][:, axis] * distance[only][:, 0],
                wide[only][:, axis] * distance[only][:, 0] + beyond[only][:, 0],
                farthest[only][:, 0],
                np.array(model.array[axis]),
                np.array(model.facing),
                uav,
            )
    return centre, reach


def _one_side(
    along: Array, off: Array, farthest: Array, axis: Array, facing: Array, uav: UavState
) -> tuple[Array, Array]:
    """Return the rectangle on one side of the vertical plane in which an array of one line lies.

    Parameters
    ----------
    along, off
        ``(n,)`` m: the measured component of the line of sight along the array, and its error.
    farthest
        ``(n,)`` m.
    axis, facing
        Unit vectors along the array, and of where it looks.
    uav
        The UAV in the slot.
    """
    level = np.hypot(*axis[:2])
    if level > 1e-6:
        direction = axis[:2] / level
        start = (along + axis[2] * uav.position[2]) / level
        ends = [np.clip(start + side * off / level, -farthest, farthest) for side in (-1.0, 1.0)]
    else:  # the same all around
        ends = [-ABREAST * farthest, ABREAST * farthest]
        length = np.hypot(*facing[:2])
        direction = np.array([facing[1], -facing[0]]) / length if length > 0.0 else np.eye(2)[1]
    across = np.array([-direction[1], direction[0]])
    across *= 1.0 if facing[:2] @ across >= 0.0 else -1.0
    middle, half = 0.5 * (ends[0] + ends[1]), np.maximum(0.5 * (ends[1] - ends[0]), MARGIN)
    centre = middle[:, None] * direction + 0.5 * farthest[:, None] * across
    reach = [half[:, None] * direction, 0.5 * farthest[:, None] * across]
    return uav.position[:2] + centre, np.stack(reach, axis=-2)


def _third(size: Array) -> Array:
    """Return the third direction cosine, not negative, of two absolute ones ``(..., 2)``."""
    squares = np.square(np.maximum(size, 0.0)).sum(axis=-1)
    third: Array = np.sqrt(np.maximum(1.0 - squares, 0.0))
    return third
