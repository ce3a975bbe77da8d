"""Sum rate per slot: the picture of the paper's main claim."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import mean_interval
from echobeam.plots.record import Axis, FigureData, Note, Panel, Series, interval_series
from echobeam.plots.source import Source, empty_figure
from echobeam.simulation.summary import improvement

GAIN_OF, GAIN_OVER = "temporal", "pilot"
"""Schemes whose ratio of rates the paper states in numbers."""


def rate(source: Source) -> FigureData:
    """Return the mean sum rate per slot of every scheme, with 95 % intervals of the mean."""
    source.check("rate", "present")
    if not source.result.sizes["object"]:
        return empty_figure(source, "rate", "no objects: sensing only")
    rates = source.result["rate"].isel(slot=source.shown)
    has_rate = rates.notnull().any(("trial", "slot", "object")).values
    series = []
    for name, some in zip(source.names, has_rate, strict=True):
        values = source.pool(source.parts[name]["sum_rate"]) / source.pooled
        found = mean_interval(values if some else np.full_like(values, np.nan))
        series.append(interval_series(name, source.x, found, source.looks[name]))
    panels = [_panel(source, series, from_zero=True)]
    close = _close_curves(series)
    if close and source.pooled > 1:
        panels.append(_panel(source, close, from_zero=False))
    layout = tuple((number,) for number in range(len(panels)))
    return FigureData(
        "rate", source.title, tuple(panels), source.setting(), layout=layout,
        size=(3.5, 1.1 + 1.65 * len(panels)), share="x", band="95 % interval",
    )  # fmt: skip


def _panel(source: Source, series: list[Series], *, from_zero: bool) -> Panel:
    tops = [one.y if one.band is None else np.append(one.y, one.band) for one in series]
    highest = max((float(np.nanmax(top)) for top in tops if np.isfinite(top).any()), default=0.0)
    limits = (-0.02 * highest, 1.06 * highest) if highest > 0 and from_zero else (None, None)
    notes = _gain(source, series) if from_zero else ()
    return Panel(
        source.slot_axis(), Axis("Sum rate", "bit/s/Hz", limits=limits), tuple(series),
        guides=source.omni_guides(), notes=notes, empty="no rates in this result",
    )  # fmt: skip


def _close_curves(series: list[Series]) -> list[Series]:
    """Return the curves that overlap on the scale of one far below them."""
    means = {
        one.name: float(np.nanmean(np.asarray(one.y, dtype=float)))
        for one in series
        if not one.empty
    }
    most = max(means.values(), default=0.0)
    top = [one for one in series if means.get(one.name, 0.0) > 0.7 * most]
    return top if 2 <= len(top) < len(means) else []


def _gain(source: Source, series: list[Series]) -> tuple[Note, ...]:
    """Return a mark of the first scheme's gain over the second, if positive."""
    means = {one.name: one.y for one in series if not one.empty}
    if not {GAIN_OF, GAIN_OVER} <= set(means) or source.slots.size > 20:
        return ()
    gain = improvement(source.result, GAIN_OF, GAIN_OVER)
    if gain is None or not gain.ratio > 1.0 or gain.slot not in source.slots:
        return ()
    at = list(source.slots).index(gain.slot)
    ends = means[GAIN_OVER][at], means[GAIN_OF][at]
    text = f"{100 * (gain.ratio - 1):+.0f} %"
    middle = float(np.mean(ends))
    between = (float(ends[0]), float(ends[1]))
    return (Note(text, gain.slot, middle, offset=(5, 0), align="left", bold=True, between=between),)
