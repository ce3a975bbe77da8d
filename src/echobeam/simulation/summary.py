"""What a run comes to: means with intervals, quantiles, errors and how often a design fell back.

Results are read in chunks of trials, so that a summary takes little memory however long the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from echobeam.scenario.model import Scenario
from echobeam.simulation.digest import NEEDED, Digest, digest, join
from echobeam.values import Array

if TYPE_CHECKING:
    import xarray as xr

CHUNK = 256
CONFIDENCE = 0.95
REFERENCE_SLOT = 6
"""The slot in which the paper states its improvement over the pilot scheme."""


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
    nees, nis
        ``(n,)``: normalised squared error of the posterior (3 for an honest filter) and squared
        innovation per measured component (1 for an honest filter); NaN where there is none.
    coverage
        Share of true angles inside the interval of (38f) around the prediction, whatever the
        scheme does with it.
    outage
        Share of objects in the scene and directional slots whose rate is below ``min_rate``.
    lost
        Share of objects in the scene that are not known in a trial's last slot.
    fallbacks
        Number of trial-slots whose beams were a fallback.
    """

    rate_mean: Array
    rate_interval: Array
    frame_rate_mean: float
    frame_rate_interval: tuple[float, float]
    frame_rate_q05: float
    angle_rmse: Array
    distance_rmse: Array
    nees: Array
    nis: Array
    coverage: float
    outage: float
    lost: float
    fallbacks: int


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
    parts = [
        digest({name: part[name].values for name in NEEDED}, scenario) for part in _chunks(result)
    ]
    names = [str(name) for name in result["scheme"].values]
    return summarise_digest(join(parts), names, scenario)


def summarise_digest(
    whole: Digest, names: Sequence[str], scenario: Scenario
) -> dict[str, SchemeSummary]:
    """Return the figures of every scheme from a run's digest."""
    return {
        name: _summarise_scheme({key: value[index] for key, value in whole.items()}, scenario)
        for index, name in enumerate(names)
    }


def improvement(
    result: xr.Dataset, scheme: str = "temporal", over: str = "pilot"
) -> Improvement | None:
    """Return the paper's headline figure, or None if a result does not hold both schemes."""
    names = [str(name) for name in result["scheme"].values]
    if scheme not in names or over not in names:
        return None
    slot = min(REFERENCE_SLOT, result.sizes["slot"])
    above, below = (_slot_rate(result, names.index(name), slot - 1) for name in (scheme, over))
    if not below.mean() > 0:
        return None
    ratio, interval = ratio_of_means(above, below)
    return Improvement(scheme, over, slot, ratio, interval)


def ratio_of_means(above: Array, below: Array) -> tuple[float, tuple[float, float]]:
    """Return mean(above) / mean(below) over paired samples and its 95 % interval (delta method)."""
    ratio = float(above.mean() / below.mean())
    deviation = np.std(above - ratio * below, ddof=1) if above.size > 1 else np.nan
    half = float(_half_width(deviation, above.size) / below.mean())
    return ratio, (ratio - half, ratio + half)


def mean_interval(values: Array) -> tuple[Array, Array]:
    """Return mean over the first axis and its 95 % interval ``(..., 2)`` (Student's t)."""
    n = values.shape[0]
    mean = values.mean(axis=0)
    deviation = values.std(axis=0, ddof=1) if n > 1 else np.full(mean.shape, np.nan)
    half = _half_width(deviation, n)
    return mean, np.stack([mean - half, mean + half], axis=-1)


def _half_width(deviation: npt.ArrayLike, n: int) -> Array:
    from scipy.special import stdtrit

    quantile = float(stdtrit(max(n - 1, 1), 0.5 + CONFIDENCE / 2))
    half: Array = np.asarray(deviation) * (quantile / np.sqrt(n))
    return half


def _summarise_scheme(part: Digest, scenario: Scenario) -> SchemeSummary:
    sum_rate = part["sum_rate"]
    frames = sum_rate.reshape(len(sum_rate), -1, scenario.frame.slots_per_frame).mean(axis=-1)
    rate_mean, rate_interval = mean_interval(sum_rate)
    frame_mean, frame_interval = mean_interval(sum_rate.mean(axis=-1))
    return SchemeSummary(
        rate_mean=rate_mean,
        rate_interval=rate_interval,
        frame_rate_mean=float(frame_mean),
        frame_rate_interval=(float(frame_interval[0]), float(frame_interval[1])),
        frame_rate_q05=float(np.quantile(frames, 0.05)),
        angle_rmse=np.sqrt(_quotient(part["squares_angle"], part["errors"])),
        distance_rmse=np.sqrt(_quotient(part["squares_distance"], part["errors"])),
        nees=_quotient(part["nees"], part["nees_count"]),
        nis=_quotient(part["nis"], part["nis_degrees"]),
        coverage=float(_quotient(part["inside"].sum(), part["covered"].sum())),
        outage=float(_quotient(part["below"].sum(), part["served"].sum())),
        lost=1.0 - float(_quotient(part["known"][-1], part["there"][-1])),
        fallbacks=int(part["fallback"].sum()),
    )


def _quotient(total: npt.ArrayLike, count: npt.ArrayLike) -> Array:
    """Return total over count, NaN where there is nothing to count."""
    total, count = np.asarray(total, dtype=float), np.asarray(count, dtype=float)
    quotient: Array = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
    return quotient


def _chunks(result: xr.Dataset) -> Iterator[xr.Dataset]:
    varying = [name for name in NEEDED if name != "phase"]
    for first in range(0, result.sizes["trial"], CHUNK):
        yield result[varying].isel(trial=slice(first, first + CHUNK)).load()


def _slot_rate(result: xr.Dataset, scheme: int, slot: int) -> Array:
    part = result[["rate", "present"]].isel(slot=slot)
    rate = part["rate"].isel(scheme=scheme).values
    total: Array = np.where(part["present"].values, rate, 0.0).sum(axis=-1)
    return total
