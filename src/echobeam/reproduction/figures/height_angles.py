"""Angle tracking against water-filling over the UAV's height (the paper's t7-2)."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import rms, rms_interval
from echobeam.plots.looks import SCHEME_LOOKS
from echobeam.plots.record import Axis, FigureData, Panel, Series, interval_series
from echobeam.reproduction.captions import omni_slots, setting, slot_axis
from echobeam.reproduction.estimates import bootstrap
from echobeam.reproduction.figures.height_rates import SCHEMES, SHOWN
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import HEIGHTS, height
from echobeam.values import Array

TAIL = 0.95


def errors(results: Results, metres: int, scheme: str) -> Array:
    """Return ``(trial, slot)`` deg: the estimate's error, NaN where the track is lost."""
    return np.asarray(np.degrees(results[height(metres).name].error(scheme, "angle")[:, :, 0]))


def lost_percent(error: Array) -> Array:
    """Return the share of trials without an estimate, ``(trial, slot)`` to ``(slot,)`` %."""
    return np.asarray(100.0 * np.isnan(error).mean(axis=0))


def data(results: Results) -> FigureData:
    """Return a panel per height of the paper, and the last slot's error over all heights."""
    outcome = results[height(SHOWN[0]).name]
    curves = {metres: _curves(results, metres) for metres in SHOWN}
    values = np.concatenate([one.y for each in curves.values() for one in each])
    limits = (0.8 * float(np.nanmin(values)), 1.25 * float(np.nanmax(values)))
    axis = Axis("Angle error", "deg", log=True, limits=limits)
    panels = [
        Panel(slot_axis(10), axis, each, f"$h$ = {metres} m", guides=omni_slots())
        for metres, each in curves.items()
    ]
    over = Axis("Height $h$", "m", ticks=tuple(map(float, HEIGHTS)))
    last = tuple(_over_heights(results, scheme) for scheme in SCHEMES)
    panels.append(Panel(over, Axis("Angle RMSE", "deg", log=True), last, "slot 10, by height"))
    lost = lost_percent(errors(results, SHOWN[-1], "water-filling"))[-1]
    return FigureData(
        "t7-2",
        "Angle tracking of the proposed scheme and of water-filling over the height",
        tuple(panels),
        setting(outcome.scenario, height=False),
        f"{outcome.point.trials} trials: RMSE (with markers) and 95 % quantiles of the error's "
        f"size (plain), of the tracks kept;\nat {SHOWN[-1]} m water-filling has lost {lost:.1f} %",
        layout=((0, 1), (2, 3)),
        size=(7.16, 4.2),
        band="95 % interval",
    )


def _curves(results: Results, metres: int) -> tuple[Series, ...]:
    found = {scheme: errors(results, metres, scheme) for scheme in SCHEMES}
    rmse = [
        interval_series(SCHEMES[scheme], range(1, 11), rms_interval(off), SCHEME_LOOKS[scheme])
        for scheme, off in found.items()
    ]
    tails = [
        Series(f"{SCHEMES[scheme]}, 95 % quantile", np.arange(1, 11),
               np.nanquantile(np.abs(off), TAIL, axis=0), look=SCHEME_LOOKS[scheme].plain(),
               kind="line", width=0.8, legend=False)
        for scheme, off in found.items()
    ]  # fmt: skip
    return (*rmse, *tails)


def _over_heights(results: Results, scheme: str) -> Series:
    found = [bootstrap(rms, errors(results, metres, scheme)[:, -1]) for metres in HEIGHTS]
    band = np.array([(one.low, one.high) for one in found])
    values = np.array([one.value for one in found])
    return interval_series(SCHEMES[scheme], HEIGHTS, (values, band), SCHEME_LOOKS[scheme])


FIGURE = Figure(
    "t7-2",
    "angle tracking against water-filling over the UAV's height",
    tuple(height(metres) for metres in HEIGHTS),
    data,
    place=10,
)
