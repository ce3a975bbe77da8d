"""Summary of a run: means with intervals, quantiles, errors, and the number of fallbacks.

Results are read in chunks of trials, so that a summary takes little memory however long the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from echobeam.estimation.intervals import (
    mean_interval,
    quantile_interval,
    quotient,
    ratio_of_means,
    share_interval,
)
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import geometry_of
from echobeam.simulation.bound import TERMS, bound_of
from echobeam.simulation.dataset import variables_of
from echobeam.simulation.layout import from_the_beginning
from echobeam.simulation.quantities import TRACK_PER_SLOT
from echobeam.simulation.statistics import (
    TRIAL,
    Statistics,
    join,
    needed,
    of_scheme,
    rmse,
    squares_of,
    statistics_of,
    sum_rate,
)
from echobeam.values import Array, BoolArray

if TYPE_CHECKING:
    import xarray as xr

CHUNK = 256
REFERENCE_SLOT = 6
"""The slot in which the paper states its improvement over the pilot scheme."""

GENIE = "genie"
"""The scheme whose rate bounds the others'."""


@dataclass(frozen=True, slots=True)
class SchemeSummary:
    """One scheme's figures; ``n`` slots, ``T`` trials.

    Attributes
    ----------
    rate_mean, rate_interval
        ``(n,)`` and ``(n, 2)`` bit/s/Hz: mean over trials of the sum rate over objects, and its
        95 % interval (Student's t; NaN for a single trial).
    frame_rate_mean, frame_rate_interval
        The same for the mean over slots.
    frame_rate_q05
        5 % quantile over trials and frames of a frame's mean sum rate.
    angle_rmse, distance_rmse
        ``(n,)`` rad, m: error of the posterior over trials and objects; NaN where there is none.
        In the ground's geometry there are ``position_rmse``, m, and ``velocity_rmse``, m/s, in
        their place, and so below.
    angle_over_bound, distance_over_bound
        ``(n,)``: these errors over the posterior Cramer-Rao bound, 1 for an efficient filter on
        what it measured; NaN where there is no bound (see `bound_of`).
    nees, nis
        ``(n,)``: normalised squared error of the posterior (the number of state components for an
        honest filter) and squared
        innovation per measured component (1 for an honest filter); NaN where there is none.
    frame_angle_rmse, frame_distance_rmse, frame_nees, frame_nis
        The same over all slots.
    coverage
        Share of true directions inside the cover (38f) that the beams were designed for; NaN for a
        scheme that designs none.
    outage
        Share of objects in the scene and directional slots whose rate is below ``min_rate``.
    lost
        Share of objects in the scene that are not known in a trial's last slot.
    fallbacks
        Number of trial-slots whose beams were a fallback.
    rate_over_genie, frame_rate_over_genie
        ``(n,)`` and of the mean over slots: mean sum rate over that of the scheme ``genie``; NaN
        without it.
    gospa, ospa
        ``(n,)`` m, unlabelled runs: set distances of the confirmed tracks to the objects, order 2,
        cutoff 10 m, mean over trials.
    gospa_localisation, gospa_missed, gospa_false
        ``(n,)`` m^2, unlabelled runs: the parts of the squared GOSPA, mean over trials.
    frame_gospa
        The same over all slots.
    detection_delay
        Slots from an object's appearance to its confirmed track, mean over the detected ones.
    false_tracks
        Confirmed tracks of nobody, per 100 slots.
    identity_switches
        Changes of the track that an object has, per trial.
    reacquisition
        Mean length of the gaps in an object's tracks, slots.
    tracked, shared
        Shares of object-slots with a confirmed track, and of those with a beam in turns.
    rate_lost_to_delay, rate_lost_to_gaps, rate_lost_to_false
        bit/s/Hz of the mean sum rate: what objects not yet tracked, or lost for a time, would
        have at the mean rate of tracked ones; and what beams for nobody take.
    intervals
        95 % interval of every figure of the whole run, see `SCALARS`: Student's t for means, the
        delta method for ratios of sums over trials, and of the quantile that of its ranks if the
        frames of one trial count as one.
    """

    rate_mean: Array
    rate_interval: Array
    frame_rate_mean: float
    frame_rate_interval: tuple[float, float]
    frame_rate_q05: float
    nees: Array
    nis: Array
    coverage: float
    outage: float
    lost: float
    fallbacks: int
    rate_over_genie: Array
    frame_rate_over_genie: float
    frame_nees: float
    frame_nis: float
    intervals: Mapping[str, tuple[float, float]]
    angle_rmse: Array | None = None
    distance_rmse: Array | None = None
    position_rmse: Array | None = None
    velocity_rmse: Array | None = None
    angle_over_bound: Array | None = None
    distance_over_bound: Array | None = None
    position_over_bound: Array | None = None
    velocity_over_bound: Array | None = None
    frame_angle_rmse: float | None = None
    frame_distance_rmse: float | None = None
    frame_position_rmse: float | None = None
    frame_velocity_rmse: float | None = None
    gospa: Array | None = None
    ospa: Array | None = None
    gospa_localisation: Array | None = None
    gospa_missed: Array | None = None
    gospa_false: Array | None = None
    frame_gospa: float | None = None
    detection_delay: float | None = None
    false_tracks: float | None = None
    identity_switches: float | None = None
    reacquisition: float | None = None
    tracked: float | None = None
    shared: float | None = None
    rate_lost_to_delay: float | None = None
    rate_lost_to_gaps: float | None = None
    rate_lost_to_false: float | None = None


@dataclass(frozen=True, slots=True)
class Improvement:
    """How much one scheme's mean sum rate is above another's in one slot, over paired trials."""

    scheme: str
    over: str
    slot: int
    ratio: float
    interval: tuple[float, float]

    def __str__(self) -> str:
        """Say it as the paper does: in per cent above."""
        low, high = (100 * (value - 1) for value in self.interval)
        text = (
            f"{self.scheme} over {self.over} in slot {self.slot}: {100 * (self.ratio - 1):+.0f} %"
        )
        return text if np.isnan(low) else f"{text} (95 % interval {low:+.0f} to {high:+.0f} %)"


def summarise(result: xr.Dataset, scenario: Scenario) -> dict[str, SchemeSummary]:
    """Return the figures of every scheme of a result, read in chunks of trials."""
    names = [str(name) for name in result["scheme"].values]
    return summarise_statistics(result_statistics(result, scenario), names, scenario)


def result_statistics(result: xr.Dataset, scenario: Scenario) -> Statistics:
    """Return the statistics of a result, read in chunks of trials.

    Those of the bound are left out if the first slots are cut off.
    """
    names = [str(name) for name in result["scheme"].values]
    wanted = needed(scenario)
    whole = join([statistics_of(arrays, scenario, names) for arrays in _chunks(result, wanted)])
    left_out = () if from_the_beginning(result) else TERMS
    return {name: values for name, values in whole.items() if name not in left_out}


def summarise_statistics(
    whole: Statistics, names: Sequence[str], scenario: Scenario
) -> dict[str, SchemeSummary]:
    """Return the figures of every scheme from a run's statistics."""
    genie = whole["sum_rate"][names.index(GENIE)] if GENIE in names else None
    return {
        name: _summarise_scheme(of_scheme(whole, index), scenario, genie)
        for index, name in enumerate(names)
    }


def over_bound(part: Statistics, error: str, scenario: Scenario) -> Array:
    """Return one scheme's RMSE over the posterior Cramer-Rao bound, ``(n,)``.

    Both are root mean squares over the trials and those objects that have a bound; NaN where
    none has.

    Parameters
    ----------
    part
        The scheme's statistics, see `of_scheme`.
    error
        Name of an error that the geometry states, or of a component of the state.
    scenario
        What was run.
    """
    least, bounded = _bound_squares(part, error, scenario)
    squares = np.where(bounded, squares_of(part, _components(error, scenario)), 0.0)
    return np.sqrt(quotient(squares.sum(axis=-1), least.sum(axis=-1)))


def pooled_bound(part: Statistics, error: str, scenario: Scenario) -> tuple[Array, Array]:
    """Return sums over trials and objects of the squared bound, and their number, ``(n,)`` each.

    The root of their quotient is what `rmse` of an efficient filter comes to; arguments as in
    `over_bound`.
    """
    least, bounded = _bound_squares(part, error, scenario)
    return least.sum(axis=-1), np.where(bounded, part["errors"], 0.0).sum(axis=-1)


def _components(error: str, scenario: Scenario) -> tuple[str, ...]:
    """Return the components of the state that an error is made of, or the one of its name."""
    return geometry_of(scenario).errors.get(error, (error,))


def _bound_squares(part: Statistics, error: str, scenario: Scenario) -> tuple[Array, BoolArray]:
    """Return the squared bound times the number of errors, and where there is one, ``(n, K)``."""
    if not set(TERMS) <= set(part):
        return np.zeros(part["errors"].shape), np.zeros(part["errors"].shape, dtype=bool)
    terms = {name: part[name] for name in TERMS}
    names = geometry_of(scenario).space.names
    chosen = [names.index(component) for component in _components(error, scenario)]
    bound = bound_of(terms, scenario)[..., chosen]
    bounded: BoolArray = np.asarray(np.isfinite(bound).all(axis=-1))
    squares = np.sum(np.where(bounded[..., None], bound, 0.0) ** 2, axis=-1)
    return squares * part["errors"], bounded


def improvement(
    result: xr.Dataset, scheme: str = "temporal", over: str = "pilot"
) -> Improvement | None:
    """Return the paper's headline figure.

    None if a result does not hold both schemes, or not the slots from the first one on.
    """
    names = [str(name) for name in result["scheme"].values]
    if scheme not in names or over not in names or not from_the_beginning(result):
        return None
    slot = min(REFERENCE_SLOT, result.sizes["slot"])
    above, below = (_slot_rate(result, names.index(name), slot - 1) for name in (scheme, over))
    if not below.mean() > 0:
        return None
    ratio, interval = ratio_of_means(above, below)
    return Improvement(scheme, over, slot, ratio, interval)


def _summarise_scheme(part: Statistics, scenario: Scenario, genie: Array | None) -> SchemeSummary:
    sum_rate = part["sum_rate"]
    best = np.zeros(sum_rate.shape) if genie is None else genie
    unlabelled = scenario.unlabelled
    of_tracks: dict[str, Any] = _tracks_per_slot(part) if unlabelled else {}
    frames = sum_rate.reshape(len(sum_rate), -1, scenario.frame.slots_per_frame).mean(axis=-1)
    rate_mean, rate_interval = _rate(sum_rate)
    stated = geometry_of(scenario).errors
    whole = _whole_run(part, frames, best, stated)
    errors: dict[str, Any] = {f"{name}_rmse": rmse(part, *of) for name, of in stated.items()}
    errors |= {f"{name}_over_bound": over_bound(part, name, scenario) for name in stated}
    if unlabelled:
        whole |= _tracks_of_run(part)
    of_run: dict[str, Any] = {k: value for k, (value, _) in whole.items() if k != "fallbacks"}
    return SchemeSummary(
        rate_mean=rate_mean,
        rate_interval=rate_interval,
        frame_rate_interval=whole["frame_rate_mean"][1],
        nees=quotient(part["nees"], part["nees_count"]),
        nis=quotient(part["nis"], part["nis_degrees"]),
        fallbacks=int(part["fallback"].sum()),
        rate_over_genie=quotient(rate_mean, best.mean(axis=0)),
        intervals={name: interval for name, (_, interval) in whole.items()},
        **errors,
        **of_tracks,
        **of_run,
    )


def _whole_run(
    part: Statistics, frames: Array, best: Array, errors: Mapping[str, tuple[str, ...]]
) -> dict[str, tuple[float, tuple[float, float]]]:
    """Return one scheme's figures of the whole run with their intervals over trials."""
    per_trial = part["sum_rate"].mean(axis=-1)
    lost = _share_of_trials(part, "known", "there")
    slots = np.full(len(frames), part["sum_rate"].shape[-1])
    share, (fewest, most) = _share(part["fallback"], slots)
    return {
        "frame_rate_mean": _pair(*_rate(per_trial)),
        "frame_rate_q05": quantile_interval(frames, 0.05),
        **{
            f"frame_{name}_rmse": _root(
                _positive_ratio(squares_of(part, of, TRIAL), part[f"{TRIAL}errors"])
            )
            for name, of in errors.items()
        },
        "frame_nees": _of_trials(part, "nees", "nees_count"),
        "frame_nis": _of_trials(part, "nis", "nis_degrees"),
        "coverage": _share_of_trials(part, "inside", "covered"),
        "outage": _share_of_trials(part, "below", "served"),
        "lost": (1.0 - lost[0], (1.0 - lost[1][1], 1.0 - lost[1][0])),
        "fallbacks": (share * slots.sum(), (fewest * slots.sum(), most * slots.sum())),
        "frame_rate_over_genie": ratio_of_means(per_trial, best.mean(axis=-1)),
    }


def _tracks_per_slot(part: Statistics) -> dict[str, Array]:
    """Return the figures of the tracks in each slot."""
    trials = len(part["sum_rate"])
    return {name: part[name] / trials for name in TRACK_PER_SLOT}


def _tracks_of_run(part: Statistics) -> dict[str, tuple[float, tuple[float, float]]]:
    """Return the figures of the tracks over the whole run with their intervals over trials."""
    slots = np.full(len(part["sum_rate"]), float(part["sum_rate"].shape[-1]))
    each = quotient(part[f"{TRIAL}rate_tracked"].sum(), part[f"{TRIAL}tracked"].sum())
    return {
        "frame_gospa": _positive_ratio(part[f"{TRIAL}gospa"], slots),
        "detection_delay": _of_trials(part, "delay", "detected"),
        "false_tracks": _positive_ratio(100.0 * part[f"{TRIAL}false"], slots),
        "identity_switches": _positive_ratio(part[f"{TRIAL}switches"], np.ones_like(slots)),
        "reacquisition": _of_trials(part, "gap", "with_gaps"),
        "tracked": _share_of_trials(part, "tracked", "present"),
        "shared": _share_of_trials(part, "shared", "present"),
        "rate_lost_to_delay": _positive_ratio(each * part[f"{TRIAL}before"], slots),
        "rate_lost_to_gaps": _positive_ratio(each * part[f"{TRIAL}lost"], slots),
        "rate_lost_to_false": _positive_ratio(part[f"{TRIAL}rate_false"], slots),
    }


def _of_trials(part: Statistics, total: str, count: str) -> tuple[float, tuple[float, float]]:
    """Return the ratio of two sums over all trials with its interval, cut at zero."""
    return _positive_ratio(part[f"{TRIAL}{total}"], part[f"{TRIAL}{count}"])


def _share_of_trials(part: Statistics, total: str, count: str) -> tuple[float, tuple[float, float]]:
    """Return a share, of sums over all trials, with its interval."""
    return _share(part[f"{TRIAL}{total}"], part[f"{TRIAL}{count}"])


def _positive_ratio(total: Array, count: Array) -> tuple[float, tuple[float, float]]:
    ratio, (low, high) = ratio_of_means(total, count)
    return ratio, (max(low, 0.0) if np.isfinite(low) else low, high)


def _share(total: Array, count: Array) -> tuple[float, tuple[float, float]]:
    """Return a share with its interval; of none or all that of Clopper and Pearson over trials."""
    share, (low, high) = _positive_ratio(total, count)
    trials = int(np.sum(count > 0))
    if share in (0.0, 1.0) and trials > 1:
        return share, share_interval(round(share * trials), trials)
    return share, (low, min(high, 1.0) if np.isfinite(high) else high)


def _root(square: tuple[float, tuple[float, float]]) -> tuple[float, tuple[float, float]]:
    value, ends = square
    low, high = np.sqrt(ends)
    return float(np.sqrt(value)), (float(low), float(high))


def _rate(values: Array) -> tuple[Array, Array]:
    """Return mean over trials and interval of rates, which are not negative, cut at zero."""
    mean, ends = mean_interval(values)
    return mean, np.maximum(ends, 0.0)


def _pair(value: npt.ArrayLike, ends: Array) -> tuple[float, tuple[float, float]]:
    return float(np.asarray(value)), (float(ends[0]), float(ends[1]))


def _chunks(
    result: xr.Dataset, wanted: Sequence[str]
) -> Iterator[dict[str, npt.NDArray[np.generic]]]:
    """Yield what the statistics need, some trials at a time, with axes in the file's order."""
    dims = {name: variable.dims for name, variable in variables_of(wanted).items()}
    for first in range(0, result.sizes["trial"], CHUNK):
        part = result.isel(trial=slice(first, first + CHUNK))
        yield {name: part[name].transpose(*dims[name]).values for name in wanted}


def _slot_rate(result: xr.Dataset, scheme: int, slot: int) -> Array:
    part = result[["rate", "present"]].isel(slot=slot)
    rate = part["rate"].isel(scheme=scheme).values
    return sum_rate(rate, part["present"].values.astype(bool))
