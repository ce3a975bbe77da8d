"""Positions above the road: the UAV's path, the objects and their tracks."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from echobeam.physics.geometry import offset, offset_cov
from echobeam.simulation.forecast import same_object
from echobeam.values import NOBODY, Array, IntArray

if TYPE_CHECKING:
    import xarray as xr


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


def read_scene(result: xr.Dataset, scheme: str, trial: int) -> Scene:
    """Return the positions in one trial (counted from 0) of one scheme."""
    names = ["identity", "position", "uav_position", "predicted", "estimated", "estimated_cov"]
    one = result[names].isel(trial=trial).sel(scheme=scheme)
    one = one.transpose("slot", "object", "state", "state_b", "axis")
    plane = [0, 2]  # along the road, and height
    uav = one["uav_position"].values[:, plane]
    true = one["position"].values[..., plane]
    identity = one["identity"].values
    estimated = one["estimated"].values
    return Scene(
        uav=uav,
        true=true,
        predicted=uav[:, None] + offset(one["predicted"].values),
        estimated=uav[:, None] + offset(estimated),
        spread=offset_cov(estimated, one["estimated_cov"].values),
        stretches=[occupants(identity[:, k]) for k in range(identity.shape[1])],
    )


def occupants(identity: IntArray) -> list[slice]:
    """Return the stretches of slots in which one object's column holds one and the same object.

    Parameters
    ----------
    identity
        ``(slot,)``: who is in the column.
    """
    same = np.append(False, same_object(identity[:, None])[:, 0])
    breaks = np.append(np.flatnonzero(~same), identity.size)
    return [
        slice(int(start), int(end)) for start, end in pairwise(breaks) if identity[start] != NOBODY
    ]
