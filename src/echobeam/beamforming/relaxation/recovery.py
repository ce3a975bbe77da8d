"""From relaxed covariances to beams on the antennas that keep all of (38)."""

from __future__ import annotations

import math

import numpy as np

from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.objective import beam_gains
from echobeam.beamforming.power import repair_powers
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation.model import FLATNESS, BeamModel, Model
from echobeam.beamforming.relaxation.rank_one import autocorrelation, beam_of, spectral_factor
from echobeam.beamforming.subspace import to_beams
from echobeam.physics.array import LinearArray
from echobeam.physics.planar import PlanarArray
from echobeam.values import Array, ComplexArray

NO_POWER = 1e-12
"""Share of the whole power below which a beam is switched off."""

NEGLIGIBLE = 5e-8
"""Share of the allowed ripple that may be lost with a covariance's smallest eigenvalues."""

ROUNDING = 1e-15
"""Share of the power held back, so that rounding does not exceed the budget."""


def recover_beams(problem: BeamProblem, model: Model, covariances: list[Array]) -> ComplexArray:
    """Return beams with the patterns and powers of reduced covariances.

    What a solver left open in the last digits of the rate floors (38e) is repaired by the powers.
    For a linear array a beam of that pattern exists, see `rank_one`; for a planar one it may not,
    and the beam is that of the strongest columns.

    Parameters
    ----------
    problem, model
        The problem and its reduced form; floors are the model's.
    covariances
        ``(r_k, r_k)`` per beam, power relative to P_T; coverage is kept.

    Returns
    -------
    ComplexArray
        ``(K, n)``, sqrt(power).
    """
    columns = problem.array.polarisations
    exact = isinstance(problem.array, LinearArray)
    beams = np.stack(
        [
            _beam(beam, covariance, columns, exact)
            for beam, covariance in zip(model.beams, covariances, strict=True)
        ]
    )
    return repair_beam_powers(problem, beams, model.threshold) * math.sqrt(problem.power)


def _beam(beam: BeamModel, covariance: Array, count: int, exact: bool) -> ComplexArray:
    """Return a beam of so many columns, one after the other."""
    n_tx = beam.basis.shape[0]
    values, vectors = np.linalg.eigh(covariance)
    values = np.maximum(values, 0.0)
    power = float(np.sum(values))
    if power < NO_POWER:
        return np.zeros(count * n_tx, dtype=complex)
    strongest_first = (vectors * np.sqrt(values))[:, ::-1]
    columns = (beam.basis @ strongest_first).astype(np.complex128)
    # All data are real: two real columns x, y have the pattern of the one complex x + j y.
    rest = n_tx * float(np.sum(values[: -2 * count]))
    if exact and rest > NEGLIGIBLE * beam.ripple * power:
        return beam_of(to_beams(columns.T).T)
    paired = np.zeros((count, n_tx), dtype=complex)
    for place in range(min(2 * count, columns.shape[1])):
        paired[place % count] += columns[:, place] * (1.0, 1.0j)[place // count]
    kept = float(np.sum(np.abs(paired) ** 2))
    return to_beams(paired).ravel() * math.sqrt(power / kept)


def repair_beam_powers(problem: BeamProblem, beams: ComplexArray, threshold: Array) -> ComplexArray:
    """Return the same beams with powers that meet floors (38e) and budget (38b), if near ones do.

    Parameters
    ----------
    problem
        With K objects; its own floors are not looked at.
    beams
        ``(K, n)``, sqrt(power / P_T).
    threshold
        ``(K,)``: as in `power.repair_powers`.
    """
    powers = np.sum(np.abs(beams) ** 2, axis=-1)
    served = powers >= NO_POWER
    beams = np.where(served[:, np.newaxis], beams, 0.0)
    if not served.any():
        return beams
    gains = beam_gains(beams[served], problem.angles[served], problem.array) / powers[served]
    loss = problem.loss[served] / problem.power
    repaired = repair_powers(gains, loss, threshold[served], powers[served])
    beams[served] *= np.sqrt(repaired / powers[served] * (1.0 - ROUNDING))[:, np.newaxis]
    return beams


def keep_coverage(problem: BeamProblem, beams: ComplexArray) -> ComplexArray:
    """Return beams mixed with a flat pattern, as far as it takes to keep (38f) on the full grid.

    On linear arrays; beams of planar ones are returned as they are, since nothing can be mixed
    with a single beam there.

    A pattern is mixed with a flat one of the same power by shrinking its autocorrelation but for
    the power, and a beam is found from the result.
    """
    array = problem.array
    if isinstance(array, PlanarArray):
        return beams
    grid, mask = coverage_grid(problem.angles, problem.coverage_halfwidths, problem.resolution)
    kept = beams.copy()
    for k, beam in enumerate(beams):
        power = float(np.sum(np.abs(beam) ** 2))
        if power < NO_POWER:
            continue
        angles = np.concatenate([problem.angles[k : k + 1], grid[k, mask[k]]])
        response = np.conj(array.steering(angles)) @ beam
        pattern = np.abs(response) ** 2 / power
        ripple = float(problem.ripple[k])
        excess = float(np.max(np.abs(pattern - pattern[0]))) - ripple
        if excess > FLATNESS:
            lags = autocorrelation(beam[:, np.newaxis])
            lags[1:] *= ripple / (ripple + excess)
            kept[k] = spectral_factor(lags)[0]
    return kept
