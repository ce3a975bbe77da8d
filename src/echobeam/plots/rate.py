"""The sum rate per slot: the picture of the paper's main claim."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from echobeam.plots import style
from echobeam.plots.series import has_rate, sum_rates
from echobeam.plots.setting import check_variables, read_setting
from echobeam.plots.slot_axis import label_slots, limit_slots, shade_phases
from echobeam.simulation.summary import Improvement, improvement, mean_interval

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from echobeam.values import Array, IntArray

GAIN_OF, GAIN_OVER = "temporal", "pilot"
"""The comparison that the paper puts into numbers."""

_MOST_SLOTS_WITH_GAIN = 20


@style.styled()
def draw(result: xr.Dataset) -> Figure:
    """Draw the mean sum rate per slot of every scheme, with 95 % intervals of the mean.

    Parameters
    ----------
    result
        A result of a run; with one trial there are no intervals.

    Raises
    ------
    PlotError
        If the result holds no rates.
    """
    check_variables(result, "rate", "present", "phase")
    setting = read_setting(result)
    figure = style.new_figure(style.COLUMN, 2.75)
    figure.suptitle(setting.title(width=52))
    axes = figure.add_subplot()
    label_slots(axes, setting.slot)
    axes.set_ylabel("Sum rate (bit/s/Hz)")
    handles: list[Artist] = []
    if result.sizes["object"] == 0:
        style.add_note(axes, "no objects: sensing only")
    else:
        handles += _draw_schemes(axes, result)
    handles += shade_phases(axes, result)
    limit_slots(axes, result)
    style.add_legend(figure, handles)
    return figure


def _draw_schemes(axes: Axes, result: xr.Dataset) -> list[Artist]:
    names = [str(name) for name in result["scheme"].values]
    looks = style.scheme_looks(names)
    slots = result["slot"].values
    rates = sum_rates(result)
    handles: list[Artist] = []
    drawn: dict[str, Array] = {}
    for i, (name, usable) in enumerate(zip(names, has_rate(result), strict=True)):
        if usable:
            drawn[name], interval = mean_interval(rates[i])
            _draw_interval(axes, slots, interval, looks[name].colour)
            top = 3.0 if name == GAIN_OF else 2.5
            line = style.draw_line(axes, slots, drawn[name], looks[name], name, zorder=top)
            handles.append(line)
        else:
            handles.append(style.absent(looks[name], f"{name} (no rate)"))
    if not drawn:
        style.add_note(axes, "no rates in this result")
    elif result.sizes["trial"] > 1:
        handles.append(Patch(facecolor="0.6", alpha=0.5, label="95 % interval"))
    _scale_rates(axes, max((float(mean.max()) for mean in drawn.values()), default=0.0))
    if {GAIN_OF, GAIN_OVER} <= set(drawn) and len(slots) <= _MOST_SLOTS_WITH_GAIN:
        _mark_gain(axes, drawn, improvement(result, GAIN_OF, GAIN_OVER))
    return handles


def _draw_interval(axes: Axes, slots: IntArray, interval: Array, colour: str) -> None:
    if np.isfinite(interval).all():
        low, high = interval.T
        axes.fill_between(slots, low, high, color=colour, alpha=0.22, linewidth=0, zorder=1.5)


def _scale_rates(axes: Axes, highest: float) -> None:
    """Write the ticks in thousandths (millionths, ...) and say so in the label."""
    if highest <= 0.0:
        return
    axes.set_ylim(-0.02 * highest, 1.06 * highest)
    power = 3 * math.floor(math.log10(highest) / 3)
    if power:
        axes.set_ylabel(f"Sum rate ($10^{{{power}}}$ bit/s/Hz)")

    def write(y: float, _: int | None) -> str:
        ticks = axes.get_yticks() / 10.0**power
        exact = (d for d in range(4) if np.allclose(ticks, np.round(ticks, d), atol=1e-9))
        return f"{y / 10.0**power:.{next(exact, 4)}f}"

    axes.yaxis.set_major_formatter(FuncFormatter(write))


def _mark_gain(axes: Axes, means: dict[str, Array], gain: Improvement | None) -> None:
    """Mark how far the first scheme is ahead of the second, if it is."""
    if gain is None or not gain.ratio > 1.0:
        return
    ahead, behind = means[gain.scheme][gain.slot - 1], means[gain.over][gain.slot - 1]
    arrow = {"arrowstyle": "<->", "color": "0.25", "linewidth": 0.8, "shrinkA": 2, "shrinkB": 2}
    axes.annotate("", (gain.slot, ahead), (gain.slot, behind), arrowprops=arrow, zorder=4)
    axes.annotate(
        f"{100 * (gain.ratio - 1):+.0f} %",
        (gain.slot, (ahead + behind) / 2),
        xytext=(5, 0),
        textcoords="offset points",
        va="center",
        fontweight="bold",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        zorder=4,
    )
