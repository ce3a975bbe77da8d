"""Matched filter, Eq. (13): a signal on a waveform's grid compressed over delay and Doppler."""

from __future__ import annotations

from typing import Literal, assert_never

import numpy as np

from echobeam.physics.waveform import Waveform
from echobeam.values import Array, ComplexArray

Filter = Literal["matched", "reciprocal", "lmmse"]
"""Weights of the resource elements: the conjugate of what was sent, its inverse, or between them.

The matched filter has the best SNR; dividing by the data gives the lowest side lobes and much noise
where little was sent; LMMSE weighs both by the SNR of one element.
"""


def weights(replica: ComplexArray, kind: Filter, noise_over_echo: Array | float) -> ComplexArray:
    """Return the weights that a received signal is multiplied with, element by element.

    Parameters
    ----------
    replica
        ``(..., N, M)``: what illuminates the target.
    kind
        The filter.
    noise_over_echo
        ``(...)``: noise power over the power of one element's echo per unit of ``|replica|^2``;
        of LMMSE only.
    """
    match kind:
        case "matched":
            return np.conj(replica)
        case "reciprocal":
            square = np.abs(replica) ** 2
            floor = np.finfo(np.float64).tiny
            return np.asarray(np.conj(replica) / np.maximum(square, floor) * (square > floor))
        case "lmmse":
            level = np.asarray(noise_over_echo, dtype=np.float64)[..., None, None]
            scaled = np.conj(replica) / (np.abs(replica) ** 2 + level)
            return np.asarray(scaled, dtype=np.complex128)
        case _:
            assert_never(kind)


def delay_doppler_map(
    weighted: ComplexArray, weight: ComplexArray, noise: float, padding: tuple[int, int]
) -> Array:
    """Return |sum y w phi*|^2 over its mean under noise alone, at all delays and Doppler shifts.

    Under noise alone every cell is exponential with mean 1.

    Parameters
    ----------
    weighted
        ``(..., N, M)``: signal times weights.
    weight
        ``(..., N, M)``: the weights.
    noise
        Variance of the signal's noise in one element.
    padding
        Cells of the map per resolution cell, along delay and Doppler.

    Returns
    -------
    Array
        ``(..., N padding[0], M padding[1])``, at the cells of `cell_places`.
    """
    n, m = weighted.shape[-2] * padding[0], weighted.shape[-1] * padding[1]
    along_delay = np.fft.ifft(weighted, n=n, axis=-2, norm="forward")
    spectrum = np.fft.fft(along_delay, n=m, axis=-1)
    expected = noise * np.sum(np.abs(weight) ** 2, axis=(-2, -1))
    power = spectrum.real**2 + spectrum.imag**2
    cells: Array = power / np.where(expected > 0.0, expected, np.inf)[..., None, None]
    return cells


def cell_places(waveform: Waveform, padding: tuple[int, int]) -> tuple[Array, Array]:
    """Return delays s and Doppler shifts Hz of the cells of `delay_doppler_map`."""
    n, m = waveform.subcarriers * padding[0], waveform.symbols * padding[1]
    delay: Array = np.arange(n, dtype=np.float64) / (n * waveform.spacing)
    return delay, np.asarray(np.fft.fftfreq(m, waveform.symbol_duration), dtype=np.float64)
