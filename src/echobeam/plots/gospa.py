"""Set distances of the confirmed tracks to the objects, with their parts and their numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echobeam.plots.looks import Look
from echobeam.plots.record import Axis, FigureData, Panel, Series
from echobeam.plots.source import Source
from echobeam.simulation.statistics import needed
from echobeam.values import Array, Status

_PARTS = ("localisation", "missed", "false")
_ZERO = 1e-9  # m^2: smaller distances are rounding errors of the genie, which knows the truth


def gospa(source: Source) -> FigureData:
    """Return GOSPA of every scheme, slot by slot, its squared parts, and the numbers of tracks.

    All are means over trials. The parts are those of the squared distance: of tracks off their
    objects, of objects without a confirmed track, and of confirmed tracks without an object; order
    and cutoff are those of the summary. A coasting track counts as confirmed.
    """
    source.check(*needed(source.scenario))
    panels = [_panel(source, Axis("GOSPA", "m"), "gospa"), _numbers(source)]
    for part in _PARTS:
        axis = Axis(f"{part.capitalize()} part", "m²", log=part == "localisation")
        panels.append(_panel(source, axis, f"gospa_{part}"))
    return FigureData(
        "gospa", source.title, tuple(panels), source.setting(),
        layout=((0, 0, 0, 1, 1, 1), (2, 2, 3, 3, 4, 4)), size=(7.16, 4.2),
    )  # fmt: skip


def _panel(source: Source, axis: Axis, name: str) -> Panel:
    """Return a figure of the tracks, mean over trials, a curve per scheme."""
    series = []
    for scheme in source.names:
        values = source.pool(source.parts[scheme][name]) / (source.trials * source.pooled)
        shown = np.where(values > _ZERO, values, np.nan) if axis.log else values
        series.append(Series(scheme, source.x, shown, look=source.looks[scheme]))
    return _drawn(source, axis, series)


def _numbers(source: Source) -> Panel:
    """Return the numbers of objects in the scene and of confirmed tracks, means over trials."""
    present = source.result["present"].transpose("trial", "slot", "object").values
    status = source.result["track_status"].transpose("scheme", "trial", "slot", "track").values
    tracks = (status >= Status.CONFIRMED).sum(axis=-1)

    def mean(count: Array) -> Array:
        values: Array = source.pool(count.mean(axis=0)) / source.pooled
        return values

    series = [
        Series("objects in the scene", source.x, mean(present.astype(bool).sum(axis=-1)),
               look=Look("0.65"), kind="line", width=3.0)
    ]  # fmt: skip
    series += [
        Series(scheme, source.x, mean(tracks[index]), look=source.looks[scheme])
        for index, scheme in enumerate(source.names)
    ]
    return _drawn(source, Axis("Objects and tracks"), series)


def _drawn(source: Source, axis: Axis, series: list[Series]) -> Panel:
    """Return a panel over slots, its axis from zero unless it is logarithmic."""
    high = max((float(np.nanmax(one.y)) for one in series if not one.empty), default=0.0) or 1.0
    limits = (None, None) if axis.log else (-0.03 * high, 1.06 * high)
    return Panel(
        source.slot_axis(), replace(axis, limits=limits), tuple(series),
        guides=source.omni_guides(), empty="no confirmed track of an object",
    )  # fmt: skip
