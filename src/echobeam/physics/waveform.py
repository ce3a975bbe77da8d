"""Waveform of a slot's coherent interval: symbols on a grid of subcarriers and OFDM symbols.

The communication signal is the radar signal. On the grid every transmitted vector is
x_nm = F s_nm, F F^H = C, with one symbol of unit power for each stream in s_nm. A delay tau turns
subcarrier n by exp(-j 2 pi n df tau), a Doppler shift mu turns symbol m by exp(j 2 pi m T_s mu).
Cyclic prefixes are longer than every delay, and a symbol is short against 1 / mu.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, assert_never

import numpy as np

from echobeam.values import Array, ComplexArray, Transmission

Modulation = Literal["qpsk", "16qam", "gaussian"]
"""Law of the symbols: constant modulus, sixteen points, or the paper's CSCG pulse."""


@dataclass(frozen=True, slots=True)
class Waveform:
    """Grid of resource elements.

    Attributes
    ----------
    bandwidth
        kappa, Hz: occupied by all subcarriers.
    duration
        iota, s: the coherent interval, of all symbols.
    subcarriers, symbols
        N and M.
    modulation
        Law of the symbols.
    """

    bandwidth: float
    duration: float
    subcarriers: int
    symbols: int
    modulation: Modulation = "qpsk"

    @property
    def elements(self) -> int:
        """N M, the number of resource elements: the gain of coherent integration."""
        return self.subcarriers * self.symbols

    @property
    def spacing(self) -> float:
        """Df, Hz: distance between subcarriers."""
        return self.bandwidth / self.subcarriers

    @property
    def symbol_duration(self) -> float:
        """T_s, s: distance between symbols."""
        return self.duration / self.symbols

    @property
    def unambiguous_delay(self) -> float:
        """1 / df, s: delays beyond are folded."""
        return 1.0 / self.spacing

    @property
    def unambiguous_doppler(self) -> float:
        """1 / (2 T_s), Hz: Doppler shifts beyond it, of either sign, are folded."""
        return 0.5 / self.symbol_duration

    @property
    def effective_bandwidth(self) -> float:
        """Width of the flat spectrum with the grid's mean square, Hz: B sqrt(1 - 1 / N^2)."""
        return self.bandwidth * math.sqrt(1.0 - 1.0 / self.subcarriers**2)

    @property
    def effective_duration(self) -> float:
        """Length of the rectangular pulse with the grid's mean square, s: T sqrt(1 - 1 / M^2)."""
        return self.duration * math.sqrt(1.0 - 1.0 / self.symbols**2)

    def places(self) -> tuple[Array, Array]:
        """Return frequencies ``(N,)`` Hz and times ``(M,)`` s of the grid, around their means.

        Around the means a change of delay or Doppler leaves the phase of the whole as it is, so
        that their estimates do not depend on each other.
        """
        n: Array = np.arange(self.subcarriers, dtype=np.float64) - 0.5 * (self.subcarriers - 1)
        m: Array = np.arange(self.symbols, dtype=np.float64) - 0.5 * (self.symbols - 1)
        return np.asarray(self.spacing * n), np.asarray(self.symbol_duration * m)

    def phases(self, delay: Array, doppler: Array) -> ComplexArray:
        """Return exp(j 2 pi (t_m mu - f_n tau)), ``(..., N, M)``.

        Parameters
        ----------
        delay, doppler
            ``(...)`` s and Hz.
        """
        f, t = self.places()
        along_f = np.exp(-2j * np.pi * f * np.asarray(delay)[..., None])
        along_t = np.exp(2j * np.pi * t * np.asarray(doppler)[..., None])
        turned: ComplexArray = along_f[..., :, None] * along_t[..., None, :]
        return turned


def symbols_of(waveform: Waveform, normals: Array) -> ComplexArray:
    """Return symbols of unit mean power made of standard normals.

    Parameters
    ----------
    waveform
        Says by which law.
    normals
        ``(..., 2)``: two for each symbol.

    Returns
    -------
    ComplexArray
        ``(...)``.
    """
    pair = normals
    match waveform.modulation:
        case "qpsk":
            pair = np.where(normals >= 0.0, 1.0, -1.0)
        case "16qam":
            outer = np.abs(normals) > 0.6744897501960817  # the median of |normal|: half of them
            pair = np.where(normals >= 0.0, 1.0, -1.0) * np.where(outer, 3.0, 1.0) / np.sqrt(5.0)
        case "gaussian":
            pass
        case _:
            assert_never(waveform.modulation)
    symbols: ComplexArray = (pair[..., 0] + 1j * pair[..., 1]) / np.sqrt(2.0)
    return symbols


def orthogonalised(symbols: ComplexArray) -> ComplexArray:
    """Return streams that are orthogonal over the grid, each of unit mean power.

    The nearest such streams (Loewdin): S (S S^H / (N M))^(-1/2). Those of an omnidirectional slot
    are precoded so; a directional slot sends its data as they are.

    Parameters
    ----------
    symbols
        ``(..., L, N, M)``, L at most N M.
    """
    shape = symbols.shape
    flat = symbols.reshape(*shape[:-2], -1)
    gram = flat @ np.conj(np.swapaxes(flat, -1, -2)) / flat.shape[-1]
    values, vectors = np.linalg.eigh(gram)
    floor = np.finfo(np.float64).eps * flat.shape[-1]
    root = vectors / np.sqrt(np.maximum(values, floor))[..., None, :]
    whitened: ComplexArray = root @ np.conj(np.swapaxes(vectors, -1, -2)) @ flat
    return whitened.reshape(shape)


def factor(sent: Transmission) -> tuple[ComplexArray, bool]:
    """Return F ``(..., N_t, L)`` with F F^H = C, and whether its streams are orthogonal ones.

    One column for each beam of a directional slot; one for each antenna that sends by itself, as
    in omnidirectional slots, in block of trials where any does.

    Parameters
    ----------
    sent
        ``(..., C, N)`` inside.
    """
    single = np.sum(sent.antenna_power, axis=-2) + sent.probing
    beams = np.swapaxes(sent.beams, -1, -2)
    uncorrelated = bool((single > 0.0).any())
    if not uncorrelated:
        return beams, False
    used = np.flatnonzero((single > 0.0).any(axis=tuple(range(single.ndim - 1))))
    alone = np.sqrt(single)[..., :, None] * np.eye(single.shape[-1])[:, used]
    if not sent.beams.any():
        return alone.astype(np.complex128), True
    return np.concatenate([beams, alone], axis=-1), True
