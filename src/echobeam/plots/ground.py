"""Where things are above the road: the UAV's path and the objects' positions relative to it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from echobeam.physics.motion import uav_path
from echobeam.physics.position import offset, offset_cov
from echobeam.plots.setting import Setting
from echobeam.simulation.forecast import same_object
from echobeam.values import STATE, Array, BoolArray

if TYPE_CHECKING:
    import xarray as xr

_VELOCITY = STATE.index("velocity")


class Scene(NamedTuple):
    """Positions ``(along the road, height)`` in m of one trial of one scheme.

    ``uav`` is ``(slot, 2)``; ``true``, ``predicted`` and ``estimated`` are ``(slot, object, 2)``,
    NaN where there is none; ``spread`` is ``(slot, object, 2, 2)``, the covariance of
    ``estimated``; ``stretches`` holds the `occupants` of every object's column.
    """

    uav: Array
    true: Array
    predicted: Array
    estimated: Array
    spread: Array
    stretches: list[list[slice]]


def read_scene(result: xr.Dataset, scheme: str, trial: int, setting: Setting) -> Scene:
    """Return the positions in one trial (counted from 0) of one scheme."""
    names = ["truth", "present", "predicted", "estimated", "estimated_cov"]
    one = result[names].isel(trial=trial).sel(scheme=scheme)
    one = one.transpose("slot", "object", "state", "state_b")
    present = one["present"].values.astype(bool)
    truth = np.where(present[..., None], one["truth"].values, np.nan)
    time = result["time"].values
    uav = flight(time, setting)
    true = uav[:, None] + offset(truth)
    estimated = one["estimated"].values
    return Scene(
        uav=uav,
        true=true,
        predicted=uav[:, None] + offset(one["predicted"].values),
        estimated=uav[:, None] + offset(estimated),
        spread=offset_cov(estimated, one["estimated_cov"].values),
        stretches=[
            occupants(true[:, k], truth[:, k, _VELOCITY], time) for k in range(truth.shape[1])
        ],
    )


def flight(time: Array, setting: Setting) -> Array:
    """Return the UAV's path ``(slot, 2)``, m; it stays at 0 if its height is not known."""
    if setting.height is None or time.size < 2:
        return np.broadcast_to([0.0, setting.height or 0.0], (time.size, 2))
    step = float(time[1] - time[0])
    path = uav_path(setting.height, setting.speed, setting.heading, step, time.size, setting.floor)
    return np.stack([path.x, path.height], axis=-1)


def occupants(true: Array, velocity: Array, time: Array) -> list[slice]:
    """Return the stretches of slots in which one object's column holds one and the same object.

    In traffic a column passes to another object when the first has left. A stretch ends where
    the position is NaN or jumps by more than the velocity can explain.

    Parameters
    ----------
    true
        ``(slot, 2)`` m: the column's true positions.
    velocity
        ``(slot,)`` m/s along the road.
    time
        ``(slot,)`` s.
    """
    there: BoolArray = np.asarray(np.isfinite(true).all(axis=-1))
    step = float(time[1] - time[0]) if time.size > 1 else 0.0
    same = np.append(False, same_object(true[:, :1], velocity[:, None], step)[:, 0])
    breaks = np.append(np.flatnonzero(~same), there.size)
    return [slice(int(start), int(end)) for start, end in pairwise(breaks) if there[start]]
