"""Positions above the road: the UAV's path, the objects, their tracks and forecasts."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.physics.geometry import offset, offset_cov
from echobeam.plots.looks import BLACK, SHORT, Look
from echobeam.plots.record import Axis, Series
from echobeam.plots.source import Source
from echobeam.simulation.forecast import SIGMAS, Cone, same_object
from echobeam.values import NOBODY, Array, IntArray

FORECAST = Look(BLACK, "", SHORT)
"""Look of a forecast path."""

_SHORT_STAY = 20
_SHARES = (0.1, 0.4, 0.7)


class Scene(NamedTuple):
    """Positions ``(along the road, height)`` in m of one trial of one scheme.

    ``uav`` is ``(slot, 2)``; ``true``, ``predicted`` and ``estimated`` are ``(slot, object, 2)``,
    NaN where there is none; ``spread`` is ``(slot, object, 2, 2)``, the covariance of
    ``estimated``; ``stays`` holds object and slots of each stay, see `occupants`.
    """

    uav: Array
    true: Array
    predicted: Array
    estimated: Array
    spread: Array
    stays: list[tuple[int, slice]]


def read_scene(source: Source) -> Scene:
    """Return the positions of the chosen trial and scheme."""
    names = ["identity", "position", "uav_position", "predicted", "estimated", "estimated_cov"]
    one = source.one_trial(*names).isel(slot=source.stretch)
    one = one.transpose("slot", "object", "state", "state_b", "axis")
    plane = [0, 2]  # along the road, and height
    uav = one["uav_position"].values[:, plane]
    identity, estimated = one["identity"].values, one["estimated"].values
    return Scene(
        uav=uav,
        true=one["position"].values[..., plane],
        predicted=uav[:, None] + offset(one["predicted"].values),
        estimated=uav[:, None] + offset(estimated),
        spread=offset_cov(estimated, one["estimated_cov"].values),
        stays=[(k, stay) for k in range(identity.shape[1]) for stay in occupants(identity[:, k])],
    )


def occupants(identity: IntArray) -> list[slice]:
    """Return the ranges of slots in which a column of the result holds the same object.

    Parameters
    ----------
    identity
        ``(slot,)``: identity of the object in the column.
    """
    same = np.append(False, same_object(identity[:, None])[:, 0])
    breaks = np.append(np.flatnonzero(~same), identity.size)
    return [
        slice(int(start), int(end)) for start, end in pairwise(breaks) if identity[start] != NOBODY
    ]


def chosen_slots(stay: slice) -> list[int]:
    """Return the slots from which forecasts of a stay start: its middle, or three if it is long."""
    length = stay.stop - stay.start
    if length < 2:
        return []
    if length <= _SHORT_STAY:
        return [stay.start + length // 2]
    return [stay.start + round(share * length) for share in _SHARES]


def cone_series(
    cone: Cone, axis: Axis, x: npt.NDArray[np.generic], colour: str
) -> tuple[Series, Series]:
    """Return the growing 3-sigma band and its centre line, at the positions ``x`` of the slots."""
    at, reach = x[cone.slots], SIGMAS * cone.deviations
    band = np.stack([cone.centres - reach, cone.centres + reach], axis=-1)
    made = f"forecast from {axis.name.lower()} {at[0]:g}"
    return (
        Series(f"{made}, ±3σ", at, cone.centres, band, Look(colour), kind="line", width=0.0,
               legend=False),
        Series(made, at, cone.centres, look=FORECAST, kind="line", width=0.9, legend=False),
    )  # fmt: skip
