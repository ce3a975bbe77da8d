"""Evolution of a state from one slot to the next, Eqs. (25)-(35), (42).

The object moves by II = v DT - v^u cos(theta^u) DT along the road and by I = v^u sin(theta^u) DT
in depth, relative to the UAV. That is p = I sin(theta) + II cos(theta) along the line of sight and
q = II sin(theta) - I cos(theta) across it. The new distance is exactly the length of (d + p, q) and
the angle falls by that vector's own; the paper keeps the first order in q / (d + p) of both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from echobeam.values import Array

Evolution = Literal["paper", "exact"]
"""First order as in the paper (corrected), or closed form."""


def evolve(
    mean: Array,
    uav_speed: Array | float,
    uav_heading: Array | float,
    slot_duration: float,
    kind: Evolution = "paper",
) -> Array:
    """Return the state one slot later without noise, g(e) of Eq. (35) or the exact geometry.

    Departs: Eq. (33) lacks a plus sign, the denominator is d + p; Eq. (31) needs the angle's
    change with the other sign; in Eqs. (26), (27) DT stands outside sine and cosine (ledger).

    Parameters
    ----------
    mean
        ``(..., K, 3)`` rad, m, m/s; NaN gives NaN. A complex state passes through the paper's
        form, for derivatives by complex step.
    uav_speed, uav_heading
        v^u, m/s, and theta^u, rad above the horizontal; scalars or of a shape that broadcasts
        against ``(..., K)``.
    slot_duration
        DT, s.
    kind
        "paper": theta - q / (d + p), d + p, v; Eqs. (30), (33), (34).
        "exact": theta - atan2(q, d + p), hypot(d + p, q), v; Eq. (25) without approximation.
    """
    step = _step(mean, uav_speed, uav_heading, slot_duration)
    if kind == "paper":
        theta, d = step.theta - step.q / step.ahead, step.ahead
    else:
        theta, d = step.theta - np.arctan2(step.q, step.ahead), np.hypot(step.ahead, step.q)
    return np.moveaxis(np.stack([theta, d, mean[..., 2]]), 0, -1)


def evolution_jacobian(
    mean: Array,
    uav_speed: Array | float,
    uav_heading: Array | float,
    slot_duration: float,
    kind: Evolution = "paper",
) -> Array:
    """Return G = dg/de of `evolve` at a state, ``(..., K, 3, 3)``, Eq. (42).

    Departs: the derivative of the distance by the angle is I cos(theta) - II sin(theta) = -q;
    the paper's second term is missing (ledger). The exact model's Jacobian is not in the paper.

    Parameters
    ----------
    mean, uav_speed, uav_heading, slot_duration, kind
        As in `evolve`.
    """
    step = _step(mean, uav_speed, uav_heading, slot_duration)
    d, q, ahead = step.d, step.q, step.ahead
    G = np.zeros((3, 3, *step.theta.shape), dtype=mean.dtype)
    if kind == "paper":
        square = ahead * ahead
        G[0, 0] = (d * ahead - q * q) / square
        G[1, 0], G[1, 1], G[1, 2] = -q, 1.0, slot_duration * step.cosine
    else:
        square = ahead * ahead + q * q
        distance = np.sqrt(square)
        G[0, 0] = d * ahead / square
        G[1, 0], G[1, 1] = -d * q / distance, ahead / distance
        G[1, 2] = slot_duration * (d * step.cosine + step.along) / distance
    G[0, 1] = q / square
    G[0, 2] = -slot_duration * (d * step.sine + step.down) / square
    G[2, 2] = 1.0
    return np.moveaxis(G, (0, 1), (-2, -1))


@dataclass(frozen=True, slots=True)
class _Step:
    """The geometry of one slot: the old state, and the displacement in two pairs of axes."""

    theta: Array
    d: Array
    sine: Array
    cosine: Array
    down: Array | float
    along: Array
    q: Array
    ahead: Array


def _step(
    mean: Array, uav_speed: Array | float, uav_heading: Array | float, slot_duration: float
) -> _Step:
    """Return I (down), II (along), q and d + p (ahead), Eqs. (26), (27)."""
    theta, d, v = mean[..., 0], mean[..., 1], mean[..., 2]
    sine, cosine = np.sin(theta), np.cos(theta)
    down = slot_duration * uav_speed * np.sin(uav_heading)
    along = slot_duration * (v - uav_speed * np.cos(uav_heading))
    ahead = d + (down * sine + along * cosine)
    return _Step(theta, d, sine, cosine, down, along, along * sine - down * cosine, ahead)
