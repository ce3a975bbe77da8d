"""What is kept of a block of trials when the block itself is not: sums that add up exactly.

A digest is a dictionary of arrays. Those with a trial axis are small (a rate per trial and slot)
and are joined; the others are sums over trials and objects and are added. Digests of blocks,
taken in order, come to the digest of the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from echobeam.estimation.consistency import nees, nis
from echobeam.estimation.gaussian import wrap
from echobeam.physics.motion import uav_path
from echobeam.scenario.model import Scenario
from echobeam.simulation.bound import bound_terms
from echobeam.tracking.measurement import measurement_jacobian, predict_measurement
from echobeam.values import STATE, Array, BoolArray

Digest = dict[str, Array]

PER_TRIAL = ("sum_rate", "fallback")
"""Digest arrays with a trial axis, ``(scheme, trial, ...)``; all others are sums."""

NEEDED = (
    "truth",
    "present",
    "predicted",
    "predicted_cov",
    "estimated",
    "estimated_cov",
    "measured",
    "measured_var",
    "rate",
    "fallback",
    "phase",
)
"""Arrays of a block, or variables of a result, that a digest is made of."""


def digest(arrays: Mapping[str, npt.NDArray[np.generic]], scenario: Scenario) -> Digest:
    """Return the digest of some trials.

    Parameters
    ----------
    arrays
        Named and laid out as in the result file, ``(scheme, trial, slot, object, ...)``.
    scenario
        Whose floors, coverage and flight the figures refer to.

    Returns
    -------
    dict
        ``sum_rate`` (scheme, trial, slot); ``fallback`` (scheme, trial): slots; sums over
        trials, (scheme, slot, object): ``squares_*`` and ``errors`` of the posterior; sums over
        trials and objects, (scheme, slot): ``nees``, ``nis`` with ``nees_count``,
        ``nis_degrees``, ``below``/``served`` (objects below their floor), ``inside``/``covered``
        (true angles inside the covered interval), ``known``/``there`` (objects with a track);
        and what `bound_terms` gives.
    """
    present = np.asarray(arrays["present"], dtype=bool)
    rate = _floats(arrays["rate"])
    directional = np.asarray(arrays["phase"] == "directional")[:, None, :, None]
    in_service = present & directional
    known = np.isfinite(_floats(arrays["estimated"])[..., 0])
    figures = {
        "sum_rate": np.where(present, rate, 0.0).sum(axis=-1),
        "fallback": np.asarray(arrays["fallback"], dtype=float).sum(axis=-1),
        "below": _count(in_service & ~(rate >= scenario.coverage.min_rate)),
        "served": _count(np.broadcast_to(in_service, rate.shape)),
        "known": _count(present & known),
        "there": _count(np.broadcast_to(present, rate.shape)),
    }
    figures |= _errors(arrays) | _innovations(arrays, scenario) | _cover(arrays, scenario)
    return figures | bound_terms(arrays, scenario)


def join(digests: Sequence[Digest]) -> Digest:
    """Return the digest of several blocks, given in order."""
    return {
        name: np.concatenate([one[name] for one in digests], axis=1)
        if name in PER_TRIAL
        else np.sum([one[name] for one in digests], axis=0)
        for name in digests[0]
    }


def _floats(values: npt.NDArray[np.generic]) -> Array:
    return np.asarray(values, dtype=np.float64)


def _count(mask: npt.NDArray[np.bool_]) -> Array:
    """Return how often a mask ``(scheme, trial, slot, object)`` holds, per scheme and slot."""
    count: Array = mask.sum(axis=(1, 3)).astype(float)
    return count


def _positive(cov: Array) -> BoolArray:
    """Return where a covariance has positive variances, ``(...)``."""
    positive: BoolArray = np.all(np.diagonal(cov, axis1=-2, axis2=-1) > 0, axis=-1)
    return positive


def _total(values: Array) -> Array:
    """Return the sum of the finite values over trials and objects, per scheme and slot."""
    total: Array = np.where(np.isfinite(values), values, 0.0).sum(axis=(1, 3))
    return total


def _errors(arrays: Mapping[str, npt.NDArray[np.generic]]) -> Digest:
    """Return errors of the posterior and their normalised squares."""
    error = _floats(arrays["estimated"]) - _floats(arrays["truth"])
    error[..., 0] = wrap(error[..., 0])
    cov = _floats(arrays["estimated_cov"])
    doubtful = _positive(cov)  # not so: unknown objects, and a genie's
    normalised = nees(
        np.where(doubtful[..., None], error, np.nan),
        np.where(doubtful[..., None, None], cov, np.eye(3)),
    )
    return {
        "errors": np.isfinite(error[..., 0]).sum(axis=1).astype(float),
        **{
            f"squares_{name}": np.nansum(error[..., index] ** 2, axis=1)
            for index, name in enumerate(STATE)
        },
        "nees": _total(normalised),
        "nees_count": _count(np.isfinite(normalised)),
    }


def _innovations(arrays: Mapping[str, npt.NDArray[np.generic]], scenario: Scenario) -> Digest:
    """Return normalised squared innovations of the predicted objects that were measured."""
    prior, cov = _floats(arrays["predicted"]), _floats(arrays["predicted_cov"])
    value, variance = _floats(arrays["measured"]), _floats(arrays["measured_var"])
    uav = scenario.uav
    path = uav_path(
        uav.height, uav.speed, uav.heading, scenario.frame.slot, prior.shape[2], uav.floor
    )
    speed, heading = path.speed[:, None], path.heading[:, None]
    carrier = scenario.radio.carrier
    predicted = np.isfinite(prior[..., 0]) & _positive(cov)
    mean = np.where(predicted[..., None], prior, 1.0)
    innovation = value - predict_measurement(mean, speed, heading, carrier)
    innovation[..., 0] = wrap(innovation[..., 0])
    used = np.isfinite(innovation) & np.isfinite(variance) & predicted[..., None]
    squared = nis(
        np.where(used, innovation, np.nan),
        np.where(predicted[..., None, None], cov, np.eye(3)),
        measurement_jacobian(mean, speed, heading, carrier),
        np.where(used, variance, np.inf),
    )
    return {
        "nis": _total(np.where(used.any(axis=-1), squared, np.nan)),
        "nis_degrees": used.sum(axis=(1, 3, 4)).astype(float),
    }


def _cover(arrays: Mapping[str, npt.NDArray[np.generic]], scenario: Scenario) -> Digest:
    """Return how often the true angle is inside the interval that (38f) covers.

    The interval is l sigma_theta around the prediction, sigma_theta that of the last slot in
    which the object was measured (``coverage.spread``).
    """
    prior, truth = _floats(arrays["predicted"]), _floats(arrays["truth"])
    if scenario.coverage.spread == "posterior":
        spread = np.sqrt(np.maximum(_floats(arrays["predicted_cov"])[..., 0, 0], 0.0))
    else:
        spread = _last_finite(np.sqrt(_floats(arrays["measured_var"])[..., 0]))
    halfwidth = np.minimum(scenario.coverage.width * spread, scenario.coverage.max_halfwidth)
    directional = np.asarray(arrays["phase"] == "directional")[:, None, :, None]
    asked = np.isfinite(prior[..., 0]) & np.isfinite(halfwidth) & directional
    off = np.abs(wrap(np.where(asked, prior[..., 0] - truth[..., 0], 0.0)))
    return {
        "inside": _count(asked & (off <= np.where(asked, halfwidth, 0.0))),
        "covered": _count(asked),
    }


def _last_finite(values: Array) -> Array:
    """Return, along the slots (axis 2), the last finite value before each slot; NaN if none."""
    index = np.where(np.isfinite(values), np.arange(values.shape[2])[:, None], -1)
    last = np.maximum.accumulate(index, axis=2)
    before = np.concatenate([np.full_like(last[:, :, :1], -1), last[:, :, :-1]], axis=2)
    found: Array = np.where(
        before >= 0, np.take_along_axis(values, np.maximum(before, 0), axis=2), np.nan
    )
    return found
