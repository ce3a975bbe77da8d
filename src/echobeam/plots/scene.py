"""Positions in a plane: the UAV's path, the objects, their tracks and forecasts."""

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

_FLATTEST = 1.25
"""Largest width over height of a part of the ground that is shown; the least is 1."""

_SHORT_STAY = 20
_SHARES = (0.1, 0.4, 0.7)


class Scene(NamedTuple):
    """Positions in m of one trial of one scheme: ``(along the road, height)``, or ``(x, y)``.

    ``uav`` is ``(slot, 2)``; ``true``, ``predicted`` and ``estimated`` are ``(slot, object, 2)``,
    NaN where there is none; ``spread`` is ``(slot, object, 2, 2)``, the covariance of
    ``estimated``; ``stays`` holds object and slots of each stay, see `occupants`; ``on_ground``
    is whether the plane is the ground.
    """

    uav: Array
    true: Array
    predicted: Array
    estimated: Array
    spread: Array
    stays: list[tuple[int, slice]]
    on_ground: bool = False

    @property
    def names(self) -> tuple[str, str]:
        """Names of the two coordinates."""
        return ("x", "y") if self.on_ground else ("Position along the road", "Height")


def read_scene(source: Source) -> Scene:
    """Return the positions of the chosen trial and scheme."""
    names = ["identity", "position", "uav_position", "predicted", "estimated", "estimated_cov"]
    one = source.one_trial(*names).isel(slot=source.stretch)
    one = one.transpose("slot", "object", "state", "state_b", "axis")
    ground = source.scenario.geometry == "ground"
    plane = [0, 1] if ground else [0, 2]  # of x along the road, y across it, and height
    uav = one["uav_position"].values[:, plane]
    identity, estimated = one["identity"].values, one["estimated"].values
    predicted, spread = one["predicted"].values, one["estimated_cov"].values
    stays = [(k, stay) for k in range(identity.shape[1]) for stay in occupants(identity[:, k])]
    return Scene(
        uav=uav,
        true=one["position"].values[..., plane],
        predicted=predicted[..., :2] if ground else uav[:, None] + offset(predicted),
        estimated=estimated[..., :2] if ground else uav[:, None] + offset(estimated),
        spread=spread[..., :2, :2] if ground else offset_cov(estimated, spread),
        stays=stays,
        on_ground=ground,
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


def framed(points: Array, margin: float, least: float) -> tuple[Array, Array]:
    """Return the lower and upper corner ``(2,)`` m of the part of the ground to show.

    It is nearly square, so that panels to scale have room.

    Parameters
    ----------
    points
        ``(n, 2)`` m, all of which are inside; NaN for none.
    margin, least
        Room around them as a share of the longer side, and at least, m.
    """
    points = points[np.isfinite(points).all(axis=-1)]
    low, high = points.min(axis=0), points.max(axis=0)
    centre, half = (low + high) / 2.0, (high - low) / 2.0
    half = half + max(margin * 2.0 * float(half.max()), least)
    half = np.maximum(half, [half[1], half[0] / _FLATTEST])
    return centre - half, centre + half


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
