"""The uniform linear array: steering vectors and their derivatives, Eq. (4)."""

from __future__ import annotations

from typing import assert_never

import numpy as np
import numpy.typing as npt

from echobeam.values import Array, Axis, ComplexArray


def directional_sine(theta: npt.ArrayLike, axis: Axis = "vertical") -> Array:
    """Return what the array can tell of a direction: u in the phase 2 pi spacing m u of Eq. (4).

    A linear array sees u and not the angle. With the vertical axis ``theta`` and ``pi - theta``
    have the same u (an object ahead and its mirror image behind), with the horizontal one
    ``theta`` and ``-theta`` have (the ground and the sky).

    Parameters
    ----------
    theta
        ``(...)`` rad: depression angle from the road's direction.
    axis
        ``"vertical"``: u = sin(theta), as in the paper; ``"horizontal"``: u = cos(theta).

    Returns
    -------
    Array
        ``(...)``, -1 to 1; NaN where ``theta`` is.
    """
    theta = np.asarray(theta, dtype=float)
    match axis:
        case "vertical":
            return np.sin(theta)
        case "horizontal":
            return np.cos(theta)
        case _:
            assert_never(axis)


def directional_slope(theta: npt.ArrayLike, axis: Axis = "vertical") -> Array:
    """Return du/dtheta of `directional_sine`: cos(theta) or -sin(theta).

    Where the array is blind to small changes of the angle (90 degrees for the vertical axis,
    0 and 180 for the horizontal one) the slope is exactly zero: the double nearest to pi/2
    means 90 degrees, and its cosine of 6e-17 means nothing.

    Parameters
    ----------
    theta
        ``(...)`` rad.
    axis
        As in `directional_sine`.
    """
    theta = np.asarray(theta, dtype=float)
    match axis:
        case "vertical":
            slope = np.cos(theta)
        case "horizontal":
            slope = -np.sin(theta)
        case _:
            assert_never(axis)
    return np.where(np.abs(slope) < np.finfo(float).eps, 0.0, slope)


def steering_vector(
    theta: npt.ArrayLike, n: int, spacing: float = 0.5, axis: Axis = "vertical"
) -> ComplexArray:
    """Return the steering vector a(theta) of Eq. (4): exp(j 2 pi spacing m u), m = 0 .. n - 1.

    Parameters
    ----------
    theta
        ``(...)`` rad.
    n
        Number of antennas.
    spacing
        Distance between neighbours in wavelengths, Delta d / lambda.
    axis
        As in `directional_sine`.

    Returns
    -------
    ComplexArray
        ``(..., n)``, each entry of modulus 1; NaN where ``theta`` is.
    """
    phase = _phase_rate(n, spacing) * directional_sine(theta, axis)[..., np.newaxis]
    return np.exp(1j * phase)


def steering_derivative(
    theta: npt.ArrayLike, n: int, spacing: float = 0.5, axis: Axis = "vertical"
) -> ComplexArray:
    """Return da/dtheta of Eq. (4): j 2 pi spacing m (du/dtheta) a(theta).

    Parameters
    ----------
    theta, n, spacing, axis
        As in `steering_vector`.

    Returns
    -------
    ComplexArray
        ``(..., n)``, 1/rad.
    """
    phase_slope = _phase_rate(n, spacing) * directional_slope(theta, axis)[..., np.newaxis]
    return 1j * phase_slope * steering_vector(theta, n, spacing, axis)


def _phase_rate(n: int, spacing: float) -> Array:
    return 2.0 * np.pi * spacing * np.arange(n)
