"""Flat beams: what is left where hardly any ripple (38f) is allowed over a wide cover.

A pattern of N antennas that is constant over more than 2 N - 2 phases is constant everywhere, and
one antenna alone has it. Then all objects receive all beams alike, only the powers are left
to choose, and the best ones have a closed form. With next to no ripple a solver has no interior
to move in, and these beams are what remains when it finds nothing better.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.certify.bounds import dirty_paper_bound, interference_free_bound
from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.coverage import cover_lobes
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.proposal import Proposal
from echobeam.beamforming.subspace import real_steering
from echobeam.values import Array, ComplexArray

STIFF_LOBES = 6.0
"""Cover in Nyquist lobes 2 pi / N from which on next to no ripple leaves little but flat beams."""

BISECTIONS = 60


def problem_lobes(problem: BeamProblem) -> Array:
    """Return ``(K,)``: how many Nyquist lobes each cover of a problem is wide."""
    covers = problem.angles, problem.coverage_halfwidths
    return cover_lobes(problem.array, *covers, problem.resolution)


def flat_proposal(problem: BeamProblem, lobes: Array) -> Proposal:
    """Return flat beams for all objects, with the best powers for them, and say why.

    Parameters
    ----------
    problem
        With K >= 1 objects.
    lobes
        ``(K,)``: `problem_lobes`; the widest cover is named.
    """
    beams, factor = _flat_beams(problem)
    widest = int(np.argmax(lobes))
    short = [f"all floors scaled by {factor:.4g}"] if factor < 1.0 else []
    words = (
        f"object {widest}: no better beams than flat ones were found for a ripple of "
        f"{problem.ripple[widest]:.3g} over a cover of {lobes[widest]:.0f} lobes"
    )
    return Proposal(
        beams=beams,
        proof=Proof(_bound(problem)),
        outcome="flat",
        message="; ".join([words, *short]),
        iterations=0,
    )


def single_proposal(problem: BeamProblem) -> Proposal:
    """Return the best beams of an array of one element, which is flat whatever it sends."""
    beams, factor = _flat_beams(problem)
    short = factor < 1.0
    words = f"one element tells no directions apart; all floors scaled by {factor:.4g}"
    return Proposal(
        beams=beams,
        proof=Proof(_bound(problem)),
        outcome="floors lowered" if short else "converged",
        message=words if short else "",
        iterations=0,
    )


def _flat_beams(problem: BeamProblem) -> tuple[ComplexArray, float]:
    """Return beams ``(K, n)`` from one element with the best powers, and the floors' part."""
    powers, factor = flat_powers(problem.loss / problem.power, problem.min_rate)
    beams = np.zeros((problem.n_objects, problem.n_tx), dtype=complex)
    beams[:, 0] = np.sqrt(powers * problem.power)
    return beams, factor


def flat_powers(loss: Array, min_rate: Array) -> tuple[Array, float]:
    """Return the powers of unit sum that maximise the sum rate of flat beams, and the floors' part.

    Noise and beams at object k sum to loss_k + 1 whatever the powers, so that its rate is
    -log2(1 - p_k / (loss_k + 1)), convex in p_k: what the floors (38e) leave goes to one object.

    Parameters
    ----------
    loss
        ``(K,)``: noise d^2 / (P_T alpha0^2).
    min_rate
        ``(K,)`` bit/s/Hz: Gamma_k.

    Returns
    -------
    powers, factor
        ``(K,)``, and the common factor of the floors that is met; 1 if they all are.
    """
    total = loss + 1.0

    def least(factor: float) -> Array:
        return np.asarray(-np.expm1(-factor * min_rate * np.log(2.0)) * total)

    low, high = (1.0, 1.0) if np.sum(least(1.0)) <= 1.0 else (0.0, 1.0)
    for _ in range(BISECTIONS if low < high else 0):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.sum(least(middle)) <= 1.0 else (low, middle)
    powers = least(low)
    left = max(0.0, 1.0 - float(np.sum(powers)))
    gain = np.log1p(-powers / total) - np.log1p(-np.minimum((powers + left) / total, 1.0 - 1e-16))
    powers[np.argmax(gain)] += left
    return powers, low


def _bound(problem: BeamProblem) -> float:
    """Return a bound on the sum rate of every design, without coverage and floors."""
    array, loss = problem.array, problem.loss / problem.power
    whole = np.full(problem.n_objects, float(array.elements))
    free = interference_free_bound(whole, loss, np.zeros_like(loss))
    channels = real_steering(array.phases(problem.angles), array.shape)
    return min(free, dirty_paper_bound(channels, loss))
