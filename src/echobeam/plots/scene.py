"""Positions above the road: the UAV's path, the objects, their tracks and forecasts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.physics.geometry import offset, offset_cov
from echobeam.plots.looks import BLACK, SHORT, Look
from echobeam.plots.record import Series
from echobeam.plots.source import Source
from echobeam.schemes.base import System
from echobeam.simulation.forecast import MOST_SLOTS, SIGMAS, forecasts, same_object
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
    one = source.one_trial(*names).transpose("slot", "object", "state", "state_b", "axis")
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


class Cone(NamedTuple):
    """Forecast of one object: slots counted from 0, position along the road and its std, m.

    All are ``(h + 1,)``; the first is the posterior of the slot in which it was made.
    """

    slots: npt.NDArray[np.int64]
    centres: Array
    deviations: Array


def chosen_slots(stay: slice) -> list[int]:
    """Return the slots from which forecasts of a stay start: its middle, or three if it is long."""
    length = stay.stop - stay.start
    if length < 2:
        return []
    if length <= _SHORT_STAY:
        return [stay.start + length // 2]
    return [stay.start + round(share * length) for share in _SHARES]


def make_cones(
    mean: Array,
    cov: Array,
    starts: Sequence[int],
    end: int,
    uav: tuple[Array, Array],
    system: System,
) -> list[Cone]:
    """Return the forecasts of one object from some slots, in one trial.

    Each ends where the next begins or the stay ends, and after at most 50 slots. There is none
    without an estimate, or with zero covariance.

    Parameters
    ----------
    mean, cov
        ``(n, 3)`` and ``(n, 3, 3)``: posteriors of all slots.
    starts, end
        Slots counted from 0, ascending, and the one after the stay's last.
    uav
        Position and velocity of the UAV, ``(n, 3)`` m and m/s.
    system
        Model of the scheme's filter, with its parameters.
    """
    position, velocity = uav
    cones = []
    for start, stop in zip(starts, [*starts, end - 1][1:], strict=True):
        if not (np.diagonal(cov[start]) > 0).all():
            continue
        here = mean[None, start, None], cov[None, start, None]
        most = min(stop - start, MOST_SLOTS)
        ahead = list(forecasts(*here, np.array([start]), most, velocity, system))
        states = np.stack([mean[start], *(one.mean[0, 0] for one in ahead)])
        covs = np.stack([cov[start], *(one.cov[0, 0] for one in ahead)])
        slots = np.arange(start, start + len(states))
        centres = position[slots, 0] + offset(states)[:, 0]
        cones.append(Cone(slots, centres, np.sqrt(offset_cov(states, covs)[:, 0, 0])))
    return cones


def cone_series(cone: Cone, x: npt.NDArray[np.generic], colour: str) -> tuple[Series, Series]:
    """Return the growing 3-sigma band and its centre line, at the positions ``x`` of the slots."""
    at, reach = x[cone.slots], SIGMAS * cone.deviations
    band = np.stack([cone.centres - reach, cone.centres + reach], axis=-1)
    made = f"forecast from slot {cone.slots[0] + 1}"
    return (
        Series(f"{made}, ±3σ", at, cone.centres, band, Look(colour), kind="line", width=0.0,
               legend=False),
        Series(made, at, cone.centres, look=FORECAST, kind="line", width=0.9, legend=False),
    )  # fmt: skip
