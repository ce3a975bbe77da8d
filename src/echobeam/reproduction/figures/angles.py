"""Angle estimates over the slots, proposed against pilot, for several arrays (the paper's t3)."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import rms_interval
from echobeam.plots.looks import SCHEME_LOOKS, Look
from echobeam.plots.record import Axis, FigureData, Panel, Series, interval_series, quantile_series
from echobeam.reproduction.captions import ANTENNAS as WORDS
from echobeam.reproduction.captions import omni_slots, setting, slot_axis
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import ANTENNAS, single
from echobeam.values import Array

SCHEMES = {"temporal": "proposed (temporal)", "pilot": "pilot (held)", "posterior": "posterior"}


def estimates(results: Results, n: int, scheme: str) -> Array:
    """Return ``(trial, slot)`` deg: the single object's estimated angle."""
    return np.asarray(np.degrees(results[single(n).name].of("estimated", scheme)[:, :, 0, 0]))


def rmse(results: Results, n: int, scheme: str) -> tuple[Array, Array]:
    """Return the estimate's error per slot, deg, and its 95 % band."""
    error = results[single(n).name].error(scheme, "angle")[:, :, 0]
    return rms_interval(np.degrees(error))


def data(results: Results) -> FigureData:
    """Return a column per array: the estimates, and below them their errors."""
    outcome = results[single().name]
    above = [_estimates(results, n) for n in ANTENNAS]
    below = [_errors(results, n) for n in ANTENNAS]
    return FigureData(
        "t3",
        "Angle tracking, proposed against pilot scheme",
        (*above, *below),
        setting(outcome.scenario, antennas=False),
        f"{outcome.point.trials} trials; estimates: medians with 5–95 % bands; errors: RMSE with "
        "95 % intervals",
        layout=((0, 1, 2), (3, 4, 5)),
        size=(7.16, 3.9),
    )


def _estimates(results: Results, n: int) -> Panel:
    truth = np.degrees(results[single(n).name].kept["truth"][0, :, 0, 0])
    slots = np.arange(1, len(truth) + 1)
    series = [Series("true angle", slots, truth, look=Look("black"), kind="line", width=1.0)]
    series += [
        quantile_series(label, slots, estimates(results, n, scheme), SCHEME_LOOKS[scheme])
        for scheme, label in SCHEMES.items()
    ]
    limits = (float(truth.mean()) - 9.0, float(truth.mean()) + 9.0)
    return Panel(
        slot_axis(len(truth)), Axis("Angle estimate", "deg", limits=limits), tuple(series),
        f"estimate, {WORDS.format(n)}", guides=omni_slots("omni or pilot slot"),
    )  # fmt: skip


def _errors(results: Results, n: int) -> Panel:
    found = {scheme: rmse(results, n, scheme) for scheme in SCHEMES}
    series = tuple(
        interval_series(label, range(1, 11), found[scheme], SCHEME_LOOKS[scheme])
        for scheme, label in SCHEMES.items()
    )
    # one range for all arrays: the comparison of the panels is the figure
    everything = np.concatenate(
        [rmse(results, one, scheme)[0] for one in ANTENNAS for scheme in SCHEMES]
    )
    limits = (0.85 * float(everything.min()), 1.15 * float(everything.max()))
    return Panel(
        slot_axis(10), Axis("Angle RMSE", "deg", log=True, limits=limits), series,
        f"error, {WORDS.format(n)}", guides=omni_slots("omni or pilot slot"),
    )  # fmt: skip


FIGURE = Figure(
    "t3",
    "angle estimates over the slots, proposed against pilot, for several arrays",
    tuple(single(n) for n in ANTENNAS),
    data,
    place=5,
)
