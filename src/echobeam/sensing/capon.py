"""Angle by Capon's spectrum: minimum-variance distortionless response, with diagonal loading.

The receive beam is Capon's, the transmit array's part of the echo its known mixture of streams:

    |b^H R^-1 z(u)|^2 / ((b^H R^-1 b) |r(u)|^2),    z(u) = sum_nm y_nm r_nm(u)^* phi_nm^*,

which is Capon's spectrum of the amplitude for a monostatic array with several streams, and that of
the receive array alone for one stream.
"""

from __future__ import annotations

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.sensing.directions import PER_BEAM, steering
from echobeam.sensing.refine import Receiver
from echobeam.values import Array, ComplexArray

LOADING = 10.0
"""Diagonal loading as a share of the mean power of the antennas.

With less, a strong echo is suppressed for the smallest error of its steering vector: at 36 dB in an
omnidirectional slot the RMSE over the bound is 1.39 with a loading of 1, and 1.16 with 10.
"""

_POINTS = 41


def covariance(snapshots: ComplexArray, loading: float = LOADING) -> ComplexArray:
    """Return the forward-backward averaged, loaded covariance ``(..., n, n)`` of snapshots.

    Parameters
    ----------
    snapshots
        ``(..., n, J)``.
    loading
        Added to the diagonal, as a share of the mean power.
    """
    n, count = snapshots.shape[-2:]
    forward = snapshots @ np.conj(np.swapaxes(snapshots, -1, -2)) / count
    backward = np.conj(forward[..., ::-1, ::-1])  # the array is symmetric in its middle
    both = 0.5 * (forward + backward)
    mean = np.trace(both, axis1=-2, axis2=-1).real / n
    # Snapshots of nothing that was sent are zero, and have no direction: any covariance will do.
    added = np.where(mean > 0.0, loading * mean, 1.0)
    loaded: ComplexArray = both + added[..., None, None] * np.eye(n)
    return loaded


def capon_spectrum(inverse: ComplexArray, array: LinearArray, u: Array) -> Array:
    """Return Capon's spectrum of power, 1 / (b^H R^-1 b), in directions ``(..., G)``.

    Parameters
    ----------
    inverse
        ``(..., n, n)``: R^-1.
    array
        The receive array.
    u
        ``(..., G)``.
    """
    b = steering(array, u)
    quadratic = np.real(np.sum(np.conj(b) * (b @ np.swapaxes(inverse, -1, -2)), axis=-1))
    spectrum: Array = 1.0 / quadratic
    return spectrum


def capon_direction(
    correlated: ComplexArray, inverse: ComplexArray, near: Array, known: Receiver
) -> Array:
    """Return the direction of the maximum within a beam of a direction, ``(T,)``.

    A grid of a twentieth of a beam's width, then the vertex of the parabola through the logarithms
    of its three largest values.

    Parameters
    ----------
    correlated
        ``(T, N_r, L)``: the signal compressed with each stream.
    inverse
        ``(T, N_r, N_r)``: R^-1.
    near
        ``(T,)``: direction of the search.
    known
        The receiver.
    """
    low, high = known.receiver.visible
    width = 1.0 / (PER_BEAM * known.receiver.n * known.receiver.spacing)
    step = 2.0 * width / (_POINTS - 1)
    grid = near[:, None] + step * (np.arange(_POINTS) - _POINTS // 2)
    b = steering(known.receiver, grid)
    f = np.conj(np.conj(steering(known.transmitter, grid)) @ known.precoder)  # (T, G, L): F^H a
    weighted = np.conj(b) @ inverse
    amplitude = np.sum((weighted @ correlated) * f, axis=-1)
    distortionless = np.real(np.sum(weighted * b, axis=-1))
    lit = np.real(np.sum(np.conj(f) * (f @ np.swapaxes(known.gram, -1, -2)), axis=-1))
    power = np.abs(amplitude) ** 2 / np.maximum(distortionless * lit, np.finfo(np.float64).tiny)
    logs = np.log(np.maximum(power, np.finfo(np.float64).tiny))
    best = np.clip(np.argmax(logs, axis=-1), 1, _POINTS - 2)[:, None]
    before, middle, after = (
        np.take_along_axis(logs, best + shift, axis=-1)[:, 0] for shift in (-1, 0, 1)
    )
    bend = before - 2.0 * middle + after
    offset = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, 1.0), 0.0)
    u = np.take_along_axis(grid, best, axis=-1)[:, 0] + step * np.clip(offset, -1.0, 1.0)
    return np.asarray(np.clip(u, low, high))
