"""Transmissions of each mode, as the covariances W_c of their streams."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, BoolArray, ComplexArray, Transmission


def omni(served: BoolArray, power: float, n_tx: int) -> Transmission:
    """Return the omnidirectional transmission of some streams, Eq. (6) and its neighbours.

    With K' streams every direction gets ``power`` in all three cases:

    - K' >= n_tx: every stream on every antenna, sum (P_T / N_t) I, Eq. (6). The streams are
      taken as uncorrelated between antennas, so each has the share 1 / K' of the power in every
      direction, which is what Eq. (7) says; a fixed precoder has that share only on average.
    - 0 < K' < n_tx: the j-th stream on antenna j alone, as the paper has it below Eq. (7). The
      SINR is that of Eq. (7), but the covariance has rank K' and is not Eq. (6).
    - K' = 0: nobody to talk to, the antennas probe with P_T / N_t each (sensing only).

    Parameters
    ----------
    served
        ``(..., C)``: the streams that are sent.
    power
        P_T, linear.
    n_tx
        Number of transmit antennas N_t.
    """
    served = np.asarray(served, dtype=np.bool_)
    count = served.sum(axis=-1)
    share = power / np.maximum(count, 1)
    antenna_of = np.cumsum(served, axis=-1) - 1
    alone = antenna_of[..., np.newaxis] == np.arange(n_tx)
    spread = np.where((count < n_tx)[..., np.newaxis, np.newaxis], alone, 1.0 / n_tx)
    antenna_power = served[..., np.newaxis] * spread * share[..., np.newaxis, np.newaxis]
    probing = np.where(count == 0, power / n_tx, 0.0)[..., np.newaxis] * np.ones(n_tx)
    return Transmission(
        beams=np.zeros(antenna_power.shape, dtype=np.complex128),
        antenna_power=antenna_power,
        probing=probing,
    )


def pilot(served: BoolArray, power: float, n_tx: int) -> Transmission:
    """Return the omnidirectional transmission without data: the same covariance, all of it probing.

    Parameters
    ----------
    served, power, n_tx
        As in `omni`.
    """
    with_data = omni(served, power, n_tx)
    return Transmission(
        beams=with_data.beams,
        antenna_power=np.zeros_like(with_data.antenna_power),
        probing=with_data.probing + with_data.antenna_power.sum(axis=-2),
    )


def directional(beams: ComplexArray) -> Transmission:
    """Return the transmission of one beam for each stream, W = [w_1 .. w_C] of Eq. (2).

    Parameters
    ----------
    beams
        ``(..., C, N)`` complex, sqrt(power); zero where there is no stream.
    """
    beams = np.asarray(beams, dtype=np.complex128)
    return Transmission(
        beams=beams,
        antenna_power=np.zeros(beams.shape),
        probing=np.zeros((*beams.shape[:-2], beams.shape[-1])),
    )


def with_probing(beams: ComplexArray, share: Array, power: float) -> Transmission:
    """Return beams with a share of the power taken from them and sent in all directions.

    The share is sent without data, uncorrelated from antenna to antenna: C = (1 - s) W W^H +
    (s P_T / N_t) I, a mixture of Eq. (6) and Eq. (9).

    Parameters
    ----------
    beams
        ``(..., C, N)`` complex, sqrt(power), of at most the whole power.
    share
        ``(...)``: s, from 0 to 1.
    power
        P_T, linear.
    """
    sent = directional(beams)
    if not np.any(share):
        return sent
    scale = np.sqrt(1.0 - share)[..., np.newaxis, np.newaxis]
    probing = sent.probing + (share * power / beams.shape[-1])[..., np.newaxis]
    return Transmission(scale * sent.beams, sent.antenna_power, probing)


def choose(mask: BoolArray, one: Transmission, other: Transmission) -> Transmission:
    """Return one transmission in the trials of a mask ``(...)`` and another in the rest."""
    if mask.all():
        return one
    if not mask.any():
        return other
    per_stream = mask[..., np.newaxis, np.newaxis]
    return Transmission(
        beams=np.where(per_stream, one.beams, other.beams),
        antenna_power=np.where(per_stream, one.antenna_power, other.antenna_power),
        probing=np.where(mask[..., np.newaxis], one.probing, other.probing),
    )


def undirected_power(sent: Transmission) -> Array:
    """Return the power that goes in all directions alike, with data or without: ``(...)``."""
    power: Array = np.sum(sent.antenna_power, axis=(-2, -1)) + np.sum(sent.probing, axis=-1)
    return power


def radiated_power(sent: Transmission) -> Array:
    """Return tr(C), what all antennas radiate together: ``(...)``, at most P_T by Eq. (38b)."""
    with np.errstate(over="ignore"):  # infinite power is more than is allowed, too
        beams = np.sum(np.abs(sent.beams) ** 2, axis=(-2, -1))
    uncorrelated = np.sum(sent.antenna_power, axis=(-2, -1))
    total: Array = beams + uncorrelated + np.sum(sent.probing, axis=-1)
    return total
