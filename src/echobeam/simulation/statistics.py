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
from echobeam.estimation.gaussian import square_norm, wrap
from echobeam.estimation.intervals import quotient
from echobeam.physics.coordinates import Geometry, direction_of
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import CoverageTable
from echobeam.schemes.configure import geometry_of, system_for
from echobeam.schemes.models import measurement_model
from echobeam.simulation.bound import bound_terms, flown
from echobeam.simulation.track_statistics import NEEDED_OF_TRACKS, track_statistics
from echobeam.values import Array, BoolArray, StateSpace, with_beams

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
    names: tuple[str, ...] = NEEDED
    if scenario.geometry == "ground":
        names = ("uav_position", *("cover" if name == "covered" else name for name in NEEDED))
    return (*names, *NEEDED_OF_TRACKS, "beam", "sinr") if unlabelled else names


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
    geometry = geometry_of(scenario)
    figures |= _errors(arrays, geometry.space) | _innovations(arrays, scenario, geometry)
    figures |= _cover(arrays, centres, geometry)
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


def rmse(part: Statistics, *components: str) -> Array:
    """Return one scheme's root mean square error of the posterior, ``(slot,)``.

    Over trials and objects; NaN where there is no track.

    Parameters
    ----------
    part
        See `of_scheme`.
    components
        Of the state, whose squares are added: of the road ``"angle"`` (rad, differences wrapped),
        ``"distance"`` (m) or ``"velocity"`` (m/s).
    """
    errors = part["errors"].sum(axis=-1)
    squares = squares_of(part, components)
    root: Array = np.sqrt(quotient(squares.sum(axis=-1), errors))
    return root


def squares_of(part: Statistics, components: Sequence[str], prefix: str = "") -> Array:
    """Return the sums of the squared errors of some components, added; see `statistics_of`."""
    first, *others = (part[f"{prefix}squares_{component}"] for component in components)
    return sum(others, start=first)


def posterior_errors(estimated: Array, truth: Array, space: StateSpace) -> Array:
    """Return estimate minus truth, ``(..., S)``, angles wrapped; NaN without either."""
    error: Array = estimated - truth
    for component in space.angles:
        error[..., component] = wrap(error[..., component])
    return error


def error_sums(error: Array, space: StateSpace) -> Statistics:
    """Return sums of squared errors ``(scheme, trial, slot, object, S)``, see `statistics_of`."""
    found = np.isfinite(error[..., 0])
    sums: Statistics = {
        "errors": found.sum(axis=1).astype(float),
        f"{TRIAL}errors": found.sum(axis=(2, 3)).astype(float),
    }
    for index, name in enumerate(space.names):
        square = error[..., index] ** 2
        sums[f"squares_{name}"] = np.nansum(square, axis=1)
        sums[f"{TRIAL}squares_{name}"] = np.nansum(square, axis=(2, 3))
    return sums


def cover_centre(predicted: Array, estimated: Array, centre: str, axes: int = 1) -> Array:
    """Return the direction around which each beam was designed, of the shape of what is given.

    It is the prediction, or the estimate of the slot before where that is the reading
    (``coverage.centre``) or where there is no prediction (a held estimate).

    Parameters
    ----------
    predicted, estimated
        ``(..., slot, object)`` rad, or ``(trial, slot, object, 2)`` direction cosines.
    centre
        ``coverage.centre`` of the scheme.
    """
    before = np.full_like(estimated, np.nan)
    slot = estimated.ndim - 2 if axes == 1 else estimated.ndim - 3
    later, earlier = ([slice(None)] * estimated.ndim for _ in range(2))
    later[slot], earlier[slot] = slice(1, None), slice(None, -1)
    before[tuple(later)] = estimated[tuple(earlier)]
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


def _errors(arrays: Arrays, space: StateSpace) -> Statistics:
    """Return errors of the posterior and their normalised squares."""
    error = posterior_errors(_floats(arrays["estimated"]), _floats(arrays["truth"]), space)
    cov = _floats(arrays["estimated_cov"])
    doubtful = _positive(cov)  # not so: unknown objects, and a genie's
    normalised = nees(
        np.where(doubtful[..., None], error, np.nan),
        np.where(doubtful[..., None, None], cov, np.eye(space.size)),
        space.angles,
    )
    return (
        error_sums(error, space)
        | _sums("nees", normalised)
        | _sums("nees_count", np.isfinite(normalised))
    )


def _innovations(arrays: Arrays, scenario: Scenario, geometry: Geometry) -> Statistics:
    """Return normalised squared innovations of the predicted objects that were measured."""
    prior, cov = _floats(arrays["predicted"]), _floats(arrays["predicted_cov"])
    value, variance = _floats(arrays["measured"]), _floats(arrays["measured_var"])
    uav, model = flown(arrays), measurement_model(geometry, scenario.radio.carrier)
    predicted = np.isfinite(prior[..., 0]) & _positive(cov)
    mean = np.where(predicted[..., None], prior, 1.0)
    innovation = value - model.expected(mean, uav)
    used = np.isfinite(innovation) & np.isfinite(variance) & predicted[..., None]
    squared = nis(
        np.where(used, innovation, np.nan),
        np.where(predicted[..., None, None], cov, np.eye(geometry.space.size)),
        model.jacobian(mean, uav),
        np.where(used, variance, np.inf),
        geometry.measurement_angles,
    )
    measured = np.where(used.any(axis=-1), squared, np.nan)
    return _sums("nis", measured) | _sums("nis_degrees", used.sum(axis=-1))


def _cover(arrays: Arrays, centres: Sequence[str], geometry: Geometry) -> Statistics:
    """Return how often the true direction is inside what a beam was designed to cover."""
    uav, axes = flown(arrays), geometry.axes
    predicted, estimated, truth = (
        direction_of(geometry.place(_floats(arrays[name]), uav), axes)
        for name in ("predicted", "estimated", "truth")
    )
    centre = np.stack(
        [
            cover_centre(one, other, each, axes)
            for one, other, each in zip(predicted, estimated, centres, strict=True)
        ]
    )
    covered = _floats(arrays["covered" if axes == 1 else "cover"])
    if axes == 1:
        asked = np.isfinite(centre) & np.isfinite(covered) & np.isfinite(truth)
    else:
        known = np.asarray(np.isfinite(centre - truth).all(axis=-1))
        asked = known & np.isfinite(covered).all(axis=(-2, -1))
    if "shared" in arrays:  # the cover of a shared beam is around the middle of several objects
        asked = asked & ~np.asarray(arrays["shared"], dtype=bool)
    if axes == 1:
        off = np.abs(wrap(np.where(asked, centre - truth, 0.0)))
        inside = asked & (off <= np.where(asked, covered, 0.0))
    else:
        from_centre = np.where(asked[..., None], truth - centre, 0.0)
        matrix = np.where(asked[..., None, None], covered, np.eye(axes))
        inside = asked & (square_norm(from_centre, matrix) <= 1.0)
    return _sums("inside", inside) | _sums("covered", asked)
