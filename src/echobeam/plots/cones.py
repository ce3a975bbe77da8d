"""Forecasts along the road: where an object will be, seen from a slot, and how surely."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.physics.geometry import offset, offset_cov
from echobeam.simulation.forecast import MOST_SLOTS, SIGMAS, forecasts

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from echobeam.schemes.base import System
    from echobeam.values import Array

_SHORT = 20
_SHARES = (0.1, 0.4, 0.7)

WAY: dict[str, Any] = {
    "color": "black", "linewidth": 0.9, "linestyle": (0, (2.0, 1.2)), "zorder": 2.5
}  # fmt: skip
"""Line of the predicted way."""


class Cone(NamedTuple):
    """A forecast of one object: slots counted from 0, position along the road and its std, m.

    All are ``(h + 1,)``; the first is the posterior of the slot in which it was made.
    """

    slots: npt.NDArray[np.int64]
    centres: Array
    deviations: Array


def chosen_slots(stay: slice) -> list[int]:
    """Return the slots from which a stay's forecasts are drawn: its middle, or three if long."""
    length = stay.stop - stay.start
    if length < 2:
        return []
    if length <= _SHORT:
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

    Each ends where the next begins or the stay ends, and after 50 slots at most. Where nothing
    is known, or nothing is in doubt, there is none.

    Parameters
    ----------
    mean, cov
        ``(n, 3)`` and ``(n, 3, 3)``: posteriors of all slots.
    starts, end
        Slots counted from 0, ascending, and the one after the stay's last.
    uav
        Position and velocity of the UAV, ``(n, 3)`` m and m/s.
    system
        The system of the scheme, with the settings of its filter.
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


def draw_cone(axes: Axes, cone: Cone, x: npt.NDArray[Any], colour: str) -> None:
    """Fill the growing 3-sigma band and draw the way through it; ``x`` is where the slots are."""
    at, reach = x[cone.slots], SIGMAS * cone.deviations
    low, high = cone.centres - reach, cone.centres + reach
    axes.fill_between(at, low, high, color=colour, alpha=0.2, linewidth=0, zorder=1.2)
    axes.plot(at, cone.centres, **WAY)
    axes.plot(at[:1], cone.centres[:1], color="black", marker="o", markersize=2.5, zorder=2.6)
