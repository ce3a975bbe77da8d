"""Log odds of each pair of a track and a detection: all that association knows of a scan.

A joint event gives every track one detection or none, and no detection to two tracks. Its
probability is proportional to the product, over the tracks, of P_D N(z; zhat, S) / lambda for the
detection that the track has, and of 1 - P_D P_G for a track that has none (Bar-Shalom, Willett and
Tian, Tracking and Data Fusion, 2011, sections 3.4 and 6.2; Stone Soup's `PDAHypothesiser` has the
same). A detection of no track is clutter of density lambda, which is divided out.
"""

from __future__ import annotations

from math import prod
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.estimation.gaussian import log_density, square_norm
from echobeam.faults import InputError
from echobeam.values import Array, BoolArray

LEAST_MISS = float(np.finfo(np.float64).eps)
"""Least probability of a missed detection, 1 - P_D P_G.

Without it a certain detection (P_D = P_G = 1) makes every event impossible in which two tracks
have one detection between them, and a scan without detections as well. Double precision does not
resolve probabilities closer to one than this."""


class Pairs(NamedTuple):
    """Log odds of a scan's joint events, track by track.

    Attributes
    ----------
    log_odds
        ``(..., C, D)``: log(P_D N(z_d; zhat_c, S_c) / lambda_d); -inf where the pair is
        impossible: outside the gate, or without a track or a detection.
    missed
        ``(..., C)``, finite: log(1 - P_D P_G); 0 where there is no track.
    """

    log_odds: Array
    missed: Array


def pairs_of(
    innovation: Array,
    covariance: Array,
    detection_probability: npt.ArrayLike,
    clutter_density: npt.ArrayLike,
    gate_probability: float,
    tracks: BoolArray,
    detections: BoolArray,
) -> Pairs:
    """Return the log odds of every pair inside the gate.

    The gate is the ellipsoid e^T S^-1 e <= the quantile of the chi-square law with as many degrees
    of freedom as components were measured.

    Parameters
    ----------
    innovation
        ``(..., C, D, M)``: detection minus the track's expected measurement, angles wrapped by the
        caller. What is not finite in a measured component makes the pair impossible.
    covariance
        ``(..., C, D, M, M)``, or ``(..., C, 1, M, M)`` where all detections of a scan have the
        same noise: S. A component with infinite variance was not measured and does not count. A
        pair whose S is singular to working precision has no density and is impossible, and so is
        one of which nothing was measured.
    detection_probability
        ``(..., C)`` or a number, 0 to 1: P_D. 1 - P_D P_G is at least `LEAST_MISS`.
    clutter_density
        ``(..., D)`` or a number, positive: expected number of false detections per unit of volume
        of the measured components.
    gate_probability
        P_G, above 0: that the gate contains a detection of the track; with 1 there is no gate.
    tracks, detections
        ``(..., C)`` and ``(..., D)``: whether there is one.
    """
    P_D = np.asarray(detection_probability, dtype=np.float64)
    density = np.asarray(clutter_density, dtype=np.float64)
    _check(innovation, covariance, P_D, density, gate_probability, tracks, detections)
    measured = np.diagonal(covariance, axis1=-2, axis2=-1) != np.inf
    error = np.where(measured, innovation, 0.0)
    count = measured.sum(axis=-1)
    with np.errstate(all="ignore"):  # unknown tracks and singular covariances: impossible pairs
        distance = square_norm(error, covariance)
        at_centre = log_density(np.zeros(innovation.shape[-1]), covariance)
        log_odds = at_centre - 0.5 * distance + np.log(P_D)[..., None] - _log_density(density)
    # Both for singular covariances and for unknown tracks a comparison with NaN is false.
    possible = (distance <= _quantiles(innovation.shape[-1], gate_probability)[count]) & (count > 0)
    possible = possible & tracks[..., :, None] & detections[..., None, :] & (log_odds > -np.inf)
    missed = np.log(np.maximum(1.0 - P_D * gate_probability, LEAST_MISS))
    return Pairs(np.where(possible, log_odds, -np.inf), np.where(tracks, missed, 0.0))


def flattened(pairs: Pairs) -> tuple[Array, Array, tuple[int, ...]]:
    """Return log odds ``(B, C, D)``, logs of a miss ``(B, C)``, and the leading shape of B.

    Raises
    ------
    InputError
        If shapes do not fit, log odds are NaN or +inf, or a log of a miss is not finite.
    """
    log_odds = np.asarray(pairs.log_odds, dtype=np.float64)
    missed = np.asarray(pairs.missed, dtype=np.float64)
    if log_odds.ndim < 2 or missed.shape != log_odds.shape[:-1]:
        raise InputError(
            f"log odds of shape {log_odds.shape} and misses of shape {missed.shape} do not fit: "
            "(..., C, D) and (..., C) are needed"
        )
    if not (log_odds < np.inf).all():
        raise InputError("log odds must be numbers or -inf")
    if not np.isfinite(missed).all():
        raise InputError("logs of the probability of a miss must be finite")
    lead = log_odds.shape[:-2]
    size = prod(lead)
    return (
        log_odds.reshape(size, *log_odds.shape[-2:]),
        missed.reshape(size, missed.shape[-1]),
        lead,
    )


def _log_density(density: Array) -> Array:
    """Return the logarithm of the clutter's density, with an axis for the tracks."""
    log: Array = np.log(density)
    return log[..., None, :] if density.ndim else log


def _quantiles(components: int, probability: float) -> Array:
    """Return the chi-square quantile for 0, 1, ... degrees of freedom."""
    from scipy.special import gammaincinv

    half = 0.5 * np.arange(1, components + 1)
    return np.concatenate([[0.0], 2.0 * gammaincinv(half, probability)])


def _check(
    innovation: Array,
    covariance: Array,
    P_D: Array,
    density: Array,
    gate_probability: float,
    tracks: BoolArray,
    detections: BoolArray,
) -> None:
    """Raise an `InputError` for what cannot be used."""
    if innovation.ndim < 3 or covariance.shape[-2:] != innovation.shape[-1:] * 2:
        raise InputError(
            f"innovations of shape {innovation.shape} and covariances of shape {covariance.shape} "
            "do not fit: (..., C, D, M) and (..., C, D or 1, M, M) are needed"
        )
    n_tracks, n_detections = innovation.shape[-3:-1]
    if tracks.shape[-1:] != (n_tracks,) or detections.shape[-1:] != (n_detections,):
        raise InputError(
            f"innovations are for {n_tracks} tracks and {n_detections} detections, but the masks "
            f"have the shapes {tracks.shape} and {detections.shape}"
        )
    if not 0.0 < gate_probability <= 1.0:
        raise InputError(f"gate probability must be above 0 and at most 1, not {gate_probability}")
    if not ((np.where(tracks, P_D, 1.0) >= 0.0) & (np.where(tracks, P_D, 1.0) <= 1.0)).all():
        raise InputError("detection probabilities must be between 0 and 1")
    real = np.where(detections, density, 1.0)
    if not ((real > 0.0) & (real < np.inf)).all():
        raise InputError("clutter densities must be positive and finite")
