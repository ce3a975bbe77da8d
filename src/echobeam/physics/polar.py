"""The paper's state and measurement: angle, distance, velocity; angle, delay, Doppler."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, BoolArray, StateSpace


def physical(state: Array) -> BoolArray:
    """Return ``(...)``: whether an object on the ground can have a state ``(..., 3)``.

    It can if the state is finite, 0 < theta < pi and d > 0.
    """
    theta, d, v = state[..., 0], state[..., 1], state[..., 2]
    possible: BoolArray = (theta > 0.0) & (theta < np.pi) & (d > 0.0) & np.isfinite(d + v)
    return possible


POLAR = StateSpace(
    names=("angle", "distance", "velocity"),
    units=("rad", "m", "m/s"),
    angles=(0,),
    valid=physical,
)
"""State of an object as seen from the UAV, Eqs. (25)-(35)."""

POLAR_MEASUREMENT = ("angle", "delay", "doppler")
"""Components of a measurement, Eq. (24)."""

POLAR_MEASUREMENT_UNITS = ("rad", "s", "Hz")
