"""From relaxed covariances in reduced coordinates to beams that keep all of (38)."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.model import BeamModel, Model
from echobeam.beamforming.power import settle
from echobeam.beamforming.rank_one import beam_of
from echobeam.beamforming.subspace import to_beams, to_coordinates
from echobeam.values import Array, ComplexArray

NO_POWER = 1e-12
"""Share of the whole power below which a beam is switched off."""


def recover_beams(model: Model, covariances: list[Array]) -> ComplexArray:
    """Return rank-one beams with the patterns and powers of covariances, of at most unit power.

    What a solver left open in the last digits of the rate floors (38e) is settled by the powers.

    Parameters
    ----------
    model
        The reduced problem.
    covariances
        ``(r_k, r_k)`` per beam, power relative to P_T; coverage is kept.

    Returns
    -------
    ComplexArray
        ``(K, N)``, sqrt(power / P_T).
    """
    beams = np.stack(
        [_beam(beam, covariance) for beam, covariance in zip(model.beams, covariances, strict=True)]
    )
    powers = np.sum(np.abs(beams) ** 2, axis=-1)
    beams[powers < NO_POWER] = 0.0
    served = powers >= NO_POWER
    if not served.any():
        return beams
    received = np.abs(to_coordinates(beams[served]) @ model.channels[served].T).T ** 2
    gains = received / powers[served]
    settled = settle(gains, model.loss[served], model.threshold[served], powers[served])
    beams[served] *= np.sqrt(settled / powers[served])[:, np.newaxis]
    return beams


def _beam(beam: BeamModel, covariance: Array) -> ComplexArray:
    values, vectors = np.linalg.eigh(covariance)
    columns = beam.basis @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    return beam_of(to_beams(columns.T.astype(complex)).T)
