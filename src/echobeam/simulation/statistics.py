"""Statistics of a run, computed once: sums over trials that add up exactly.

Tables, claims, pictures and sweeps read these. Those with a trial axis are small (a rate per
trial and slot) and are joined; the others are sums over trials and objects and are added.
Statistics of blocks, taken in order, come to those of the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from echobeam.estimation.consistency import nees, nis
from echobeam.estimation.gaussian import wrap
from echobeam.estimation.intervals import quotient
from echobeam.physics.polar import POLAR
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import CoverageTable
from echobeam.schemes.configure import system_for
from echobeam.simulation.bound import bound_terms
from echobeam.simulation.track_statistics import NEEDED_OF_TRACKS, track_statistics
from echobeam.tracking.measurement import measurement_jacobian, predict_measurement
from echobeam.values import Array, BoolArray, with_beams

Statistics = dict[str, Array]

TRIAL = "trial_"
"""Prefix of sums over a trial's slots and objects, from which intervals over trials come."""


def per_trial(name: str) -> bool:
    """Return whether a statistic has a trial axis, ``(scheme, trial, ...)``; others are sums."""
    return name in ("sum_rate", "fallback") or name.startswith(TRIAL)


NEEDED = (
    "truth",
    "present",
    "uav_velocity",
    "mode",
    "covered",
    "predicted",
    "predicted_cov",
    "estimated",
    "estimated_cov",
    "measured",
    "measured_var",
    "true_var",
    "rate",
    "fallback",
)
"""Arrays of a block, or variables of a result, that the statistics are made of."""

Arrays = Mapping[str, npt.NDArray[np.generic]]


def needed(scenario: Scenario) -> tuple[str, ...]:
    """Return the variables that the statistics of a scenario's result are made of."""
    unlabelled = scenario.unlabelled
    return (*NEEDED, *NEEDED_OF_TRACKS, "beam", "sinr") if unlabelled else NEEDED


def statistics_of(arrays: Arrays, scenario: Scenario, names: Sequence[str]) -> Statistics:
    """Return the statistics of some trials.

    Parameters
    ----------
    arrays
        Named and laid out as in the result file, ``(scheme, trial, slot, object, ...)``.
    scenario
        The scenario that was run.
    names
        Schemes, whose own floors, covers and filters the statistics refer to.

    Returns
    -------
    dict
        ``sum_rate`` (scheme, trial, slot); ``fallback`` (scheme, trial): slots; sums over
        trials, (scheme, slot, object): ``squares_*`` and ``errors`` of the posterior; sums over
        trials and objects, (scheme, slot): ``nees``, ``nis`` with ``nees_count``,
        ``nis_degrees``, ``below``/``served`` (objects below their floor), ``inside``/``covered``
        (true angles inside the covered interval), ``known``/``there`` (objects with a track);
        all of these once more as sums over each trial's slots and objects, (scheme, trial), see
        `TRIAL`, where ``known``/``there`` are those of the last slot; `bound_terms`; and of
        unlabelled runs `track_statistics`.
    """
    present = np.asarray(arrays["present"], dtype=bool)
    rate = _floats(arrays["rate"])
    in_service = present & _directional(arrays)
    known = np.isfinite(_floats(arrays["estimated"])[..., 0])
    coverages = [_coverage(scenario, name) for name in names]
    floors = np.array([coverage.min_rate for coverage in coverages])[:, None, None, None]
    figures = {
        "sum_rate": sum_rate(rate, present),
        "fallback": np.asarray(arrays["fallback"], dtype=float).sum(axis=-1),
    }
    figures |= _sums("below", in_service & ~(rate >= floors))
    figures |= _sums("served", np.broadcast_to(in_service, rate.shape))
    figures |= _sums("known", present & known, last=True)
    figures |= _sums("there", np.broadcast_to(present, rate.shape), last=True)
    centres = [coverage.centre for coverage in coverages]
    figures |= _errors(arrays) | _innovations(arrays, scenario) | _cover(arrays, centres)
    if scenario.unlabelled:
        figures |= track_statistics(arrays, scenario)
    return figures | bound_terms(arrays, scenario)


def join(parts: Sequence[Statistics]) -> Statistics:
    """Return the statistics of several blocks, given in order."""
    return {
        name: np.concatenate([one[name] for one in parts], axis=1)
        if per_trial(name)
        else np.sum([one[name] for one in parts], axis=0)
        for name in parts[0]
    }


def of_scheme(whole: Statistics, index: int) -> Statistics:
    """Return one scheme's part, without the leading axis."""
    return {key: value[index] for key, value in whole.items()}


def sum_rate(rate: Array, present: BoolArray) -> Array:
    """Return the rate summed over the objects that are there, ``(..., K)`` to ``(...)``.

    An object without a rate adds nothing.
    """
    total: Array = np.where(present & np.isfinite(rate), rate, 0.0).sum(axis=-1)
    return total


def rmse(part: Statistics, component: str) -> Array:
    """Return one scheme's root mean square error of the posterior, ``(slot,)``.

    Over trials and objects; NaN where there is no track.

    Parameters
    ----------
    part
        See `of_scheme`.
    component
        ``"angle"`` (rad, differences wrapped), ``"distance"`` (m) or ``"velocity"`` (m/s).
    """
    errors = part["errors"].sum(axis=-1)
    root: Array = np.sqrt(quotient(part[f"squares_{component}"].sum(axis=-1), errors))
    return root


def posterior_errors(estimated: Array, truth: Array) -> Array:
    """Return estimate minus truth, ``(..., S)``, angles wrapped; NaN without either."""
    error: Array = estimated - truth
    for component in POLAR.angles:
        error[..., component] = wrap(error[..., component])
    return error


def error_sums(error: Array) -> Statistics:
    """Return sums of squared errors ``(scheme, trial, slot, object, S)``, see `statistics_of`."""
    found = np.isfinite(error[..., 0])
    sums: Statistics = {
        "errors": found.sum(axis=1).astype(float),
        f"{TRIAL}errors": found.sum(axis=(2, 3)).astype(float),
    }
    for index, name in enumerate(POLAR.names):
        square = error[..., index] ** 2
        sums[f"squares_{name}"] = np.nansum(square, axis=1)
        sums[f"{TRIAL}squares_{name}"] = np.nansum(square, axis=(2, 3))
    return sums


def cover_centre(predicted: Array, estimated: Array, centre: str) -> Array:
    """Return the angle around which each beam was designed, ``(..., slot, object)`` rad.

    It is the prediction, or the estimate of the slot before where that is the reading
    (``coverage.centre``) or where there is no prediction (a held estimate).

    Parameters
    ----------
    predicted, estimated
        ``(..., slot, object)`` rad.
    centre
        ``coverage.centre`` of the scheme.
    """
    before = np.full_like(estimated, np.nan)
    before[..., 1:, :] = estimated[..., :-1, :]
    first, second = (before, predicted) if centre == "previous" else (predicted, before)
    return np.where(np.isfinite(first), first, second)


@lru_cache(maxsize=64)
def _coverage(scenario: Scenario, name: str) -> CoverageTable:
    """Return a scheme's floor and cover; the look-ups take nearly as long as a block's sums."""
    return system_for(scenario, name).coverage


def _directional(arrays: Arrays) -> BoolArray:
    """Return ``(scheme, trial, slot, 1)``: whether beams are sent."""
    directional: BoolArray = with_beams(np.asarray(arrays["mode"]))[..., None]
    return directional


def _floats(values: npt.NDArray[np.generic]) -> Array:
    return np.asarray(values, dtype=np.float64)


def _sums(name: str, values: npt.NDArray[np.generic], *, last: bool = False) -> Statistics:
    """Return sums of ``(scheme, trial, slot, object)`` values over trials, and over a trial.

    What is not finite counts as nothing; ``last`` takes a trial's last slot alone.
    """
    numbers = np.asarray(values, dtype=float)
    numbers = np.where(np.isfinite(numbers), numbers, 0.0)
    own = numbers[:, :, -1:] if last else numbers
    return {name: numbers.sum(axis=(1, 3)), f"{TRIAL}{name}": own.sum(axis=(2, 3))}


def _positive(cov: Array) -> BoolArray:
    """Return where a covariance has positive variances, ``(...)``."""
    positive: BoolArray = np.all(np.diagonal(cov, axis1=-2, axis2=-1) > 0, axis=-1)
    return positive


def _errors(arrays: Arrays) -> Statistics:
    """Return errors of the posterior and their normalised squares."""
    error = posterior_errors(_floats(arrays["estimated"]), _floats(arrays["truth"]))
    cov = _floats(arrays["estimated_cov"])
    doubtful = _positive(cov)  # not so: unknown objects, and a genie's
    normalised = nees(
        np.where(doubtful[..., None], error, np.nan),
        np.where(doubtful[..., None, None], cov, np.eye(POLAR.size)),
        POLAR.angles,
    )
    return (
        error_sums(error) | _sums("nees", normalised) | _sums("nees_count", np.isfinite(normalised))
    )


def uav_motion(arrays: Arrays) -> tuple[Array, Array]:
    """Return the UAV's speed and heading in every slot, ``(slot, 1)`` m/s and rad."""
    velocity = _floats(arrays["uav_velocity"])
    speed = np.hypot(velocity[:, 0], velocity[:, 2])[:, None]
    return speed, np.arctan2(velocity[:, 2], velocity[:, 0])[:, None]


def _innovations(arrays: Arrays, scenario: Scenario) -> Statistics:
    """Return normalised squared innovations of the predicted objects that were measured."""
    prior, cov = _floats(arrays["predicted"]), _floats(arrays["predicted_cov"])
    value, variance = _floats(arrays["measured"]), _floats(arrays["measured_var"])
    speed, heading = uav_motion(arrays)
    carrier = scenario.radio.carrier
    predicted = np.isfinite(prior[..., 0]) & _positive(cov)
    mean = np.where(predicted[..., None], prior, 1.0)
    innovation = value - predict_measurement(mean, speed, heading, carrier)
    used = np.isfinite(innovation) & np.isfinite(variance) & predicted[..., None]
    squared = nis(
        np.where(used, innovation, np.nan),
        np.where(predicted[..., None, None], cov, np.eye(POLAR.size)),
        measurement_jacobian(mean, speed, heading, carrier),
        np.where(used, variance, np.inf),
        POLAR.angles,
    )
    measured = np.where(used.any(axis=-1), squared, np.nan)
    return _sums("nis", measured) | _sums("nis_degrees", used.sum(axis=-1))


def _cover(arrays: Arrays, centres: Sequence[str]) -> Statistics:
    """Return how often the true angle is inside the interval that a beam was designed to cover."""
    predicted, estimated = (_floats(arrays[name])[..., 0] for name in ("predicted", "estimated"))
    centre = np.stack(
        [
            cover_centre(one, other, each)
            for one, other, each in zip(predicted, estimated, centres, strict=True)
        ]
    )
    halfwidth, truth = _floats(arrays["covered"]), _floats(arrays["truth"])[..., 0]
    asked = np.isfinite(centre) & np.isfinite(halfwidth) & np.isfinite(truth)
    if "shared" in arrays:  # the cover of a shared beam is around the middle of several objects
        asked = asked & ~np.asarray(arrays["shared"], dtype=bool)
    off = np.abs(wrap(np.where(asked, centre - truth, 0.0)))
    inside = asked & (off <= np.where(asked, halfwidth, 0.0))
    return _sums("inside", inside) | _sums("covered", asked)
