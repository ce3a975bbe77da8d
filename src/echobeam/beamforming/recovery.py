"""From relaxed covariances to beams on the antennas that keep all of (38)."""

from __future__ import annotations

import math

import numpy as np

from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.model import FLATNESS, BeamModel, Model
from echobeam.beamforming.power import settle
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.rank_one import autocorrelation, beam_of, spectral_factor
from echobeam.beamforming.subspace import to_beams
from echobeam.values import Array, ComplexArray

NO_POWER = 1e-12
"""Share of the whole power below which a beam is switched off."""

NEGLIGIBLE = 5e-8
"""Share of the allowed ripple that may be lost with a covariance's smallest eigenvalues."""

ROUNDING = 1e-15
"""Share of the power held back, so that rounding does not exceed the budget."""


def recover_beams(problem: BeamProblem, model: Model, covariances: list[Array]) -> ComplexArray:
    """Return rank-one beams with the patterns and powers of reduced covariances.

    What a solver left open in the last digits of the rate floors (38e) is settled by the powers.

    Parameters
    ----------
    problem, model
        The problem and its reduced form; floors are the model's.
    covariances
        ``(r_k, r_k)`` per beam, power relative to P_T; coverage is kept.

    Returns
    -------
    ComplexArray
        ``(K, N)``, sqrt(power).
    """
    beams = np.stack(
        [_beam(beam, covariance) for beam, covariance in zip(model.beams, covariances, strict=True)]
    )
    channels = problem.array.steering(problem.angles)
    settled = settle_powers(beams, channels, model.loss, model.threshold)
    return settled * math.sqrt(problem.power)


def _beam(beam: BeamModel, covariance: Array) -> ComplexArray:
    values, vectors = np.linalg.eigh(covariance)
    values = np.maximum(values, 0.0)
    power = float(np.sum(values))
    if power < NO_POWER:
        return np.zeros(beam.basis.shape[0], dtype=complex)
    columns = beam.basis @ (vectors * np.sqrt(values))
    # All data are real: two real columns x, y have the pattern of the one complex x + j y.
    rest = beam.basis.shape[0] * float(np.sum(values[:-2]))
    if len(values) >= 2 and rest <= NEGLIGIBLE * beam.ripple * power:
        pair = columns[:, -1] + 1j * columns[:, -2]
        return to_beams(pair * math.sqrt(power / float(np.sum(values[-2:]))))
    return beam_of(to_beams(columns.T.astype(complex)).T)


def settle_powers(
    beams: ComplexArray, channels: ComplexArray, loss: Array, threshold: Array
) -> ComplexArray:
    """Return the same beams with powers that meet floors (38e) and budget (38b), if near ones do.

    Parameters
    ----------
    beams
        ``(K, N)``, sqrt(power / P_T).
    channels
        ``(K, N)``: steering vectors of the objects.
    loss, threshold
        ``(K,)``: as in `power.settle`.
    """
    powers = np.sum(np.abs(beams) ** 2, axis=-1)
    served = powers >= NO_POWER
    beams = np.where(served[:, np.newaxis], beams, 0.0)
    if not served.any():
        return beams
    gains = np.abs(np.conj(channels[served]) @ beams[served].T) ** 2 / powers[served]
    settled = settle(gains, loss[served], threshold[served], powers[served])
    beams[served] *= np.sqrt(settled / powers[served] * (1.0 - ROUNDING))[:, np.newaxis]
    return beams


def keep_coverage(problem: BeamProblem, beams: ComplexArray) -> ComplexArray:
    """Return beams mixed with a flat pattern, as far as it takes to keep (38f) on the full grid.

    A pattern is mixed with a flat one of the same power by shrinking its autocorrelation but for
    the power, and a beam is found from the result.
    """
    grid, mask = coverage_grid(problem.angles, problem.coverage_halfwidths, problem.resolution)
    kept = beams.copy()
    for k, beam in enumerate(beams):
        power = float(np.sum(np.abs(beam) ** 2))
        if power < NO_POWER:
            continue
        angles = np.concatenate([problem.angles[k : k + 1], grid[k, mask[k]]])
        response = np.conj(problem.array.steering(angles)) @ beam
        pattern = np.abs(response) ** 2 / power
        ripple = float(problem.ripple[k])
        excess = float(np.max(np.abs(pattern - pattern[0]))) - ripple
        if excess > FLATNESS:
            lags = autocorrelation(beam[:, np.newaxis])
            lags[1:] *= ripple / (ripple + excess)
            kept[k] = spectral_factor(lags)[0]
    return kept
