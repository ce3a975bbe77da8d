"""What the UAV sends in each phase, as the covariances W_k of its streams."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, BoolArray, ComplexArray, Transmission


def omni(present: BoolArray, power: float, n_tx: int) -> Transmission:
    """Return the omnidirectional transmission for the objects at hand, Eq. (6) and its neighbours.

    With K' objects present every direction gets ``power`` in all three cases:

    - K' >= n_tx: every stream on every antenna, sum (P_T / N_t) I, Eq. (6). The streams are
      taken as uncorrelated between antennas, so each has the share 1 / K' of the power in every
      direction, which is what Eq. (7) says; a fixed precoder has that share only on average.
    - 0 < K' < n_tx: the j-th object's stream on antenna j alone, as the paper has it below
      Eq. (7). The SINR is that of Eq. (7), but the covariance has rank K' and is not Eq. (6).
    - K' = 0: nobody to talk to, the antennas probe with P_T / N_t each (sensing only).

    Parameters
    ----------
    present
        ``(..., K)``: objects that get a stream.
    power
        P_T, linear.
    n_tx
        Number of transmit antennas N_t.
    """
    present = np.asarray(present, dtype=np.bool_)
    count = present.sum(axis=-1)
    share = power / np.maximum(count, 1)
    antenna_of = np.cumsum(present, axis=-1) - 1
    alone = antenna_of[..., np.newaxis] == np.arange(n_tx)
    spread = np.where((count < n_tx)[..., np.newaxis, np.newaxis], alone, 1.0 / n_tx)
    antenna_power = present[..., np.newaxis] * spread * share[..., np.newaxis, np.newaxis]
    probing = np.where(count == 0, power / n_tx, 0.0)[..., np.newaxis] * np.ones(n_tx)
    return Transmission(
        beams=np.zeros(antenna_power.shape, dtype=np.complex128),
        antenna_power=antenna_power,
        probing=probing,
    )


def directional(beams: ComplexArray) -> Transmission:
    """Return the transmission of one beam per object, W = [w_1 .. w_K] of Eq. (2).

    Parameters
    ----------
    beams
        ``(..., K, N)`` complex, sqrt(power); zero for an object without a stream.
    """
    beams = np.asarray(beams, dtype=np.complex128)
    return Transmission(
        beams=beams,
        antenna_power=np.zeros(beams.shape),
        probing=np.zeros((*beams.shape[:-2], beams.shape[-1])),
    )


def radiated_power(transmission: Transmission) -> Array:
    """Return tr(C), what all antennas radiate together: ``(...)``, at most P_T by Eq. (38b)."""
    beams = np.sum(np.abs(transmission.beams) ** 2, axis=(-2, -1))
    uncorrelated = np.sum(transmission.antenna_power, axis=(-2, -1))
    total: Array = beams + uncorrelated + np.sum(transmission.probing, axis=-1)
    return total
