"""Axes of a panel: labels, scales, limits and ticks."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from echobeam.plots.record import Axis

CHARACTERS_PER_INCH = 13
"""Of a text in a figure; legends and titles have 15 to 17 by measurement."""

_SLANTED: dict[str, Any] = {"rotation": 20, "ha": "right", "rotation_mode": "anchor"}


def set_axis(axes: Axes, axis: Axis, which: str) -> None:
    """Set label, scale, limits and ticks of one axis."""
    own = axes.xaxis if which == "x" else axes.yaxis
    set_limits = axes.set_xlim if which == "x" else axes.set_ylim
    own.set_label_text(_label(axes, axis, which))
    log = axis.log and _scale_log(axes, which)
    if axis.limits != (None, None):
        set_limits(*axis.limits)
    if log:
        _tick_log(axes, which)
    if axis.ticks:
        names = list(axis.names) or [f"{tick:g}" for tick in axis.ticks]
        room = 1.2 * CHARACTERS_PER_INCH * axes.get_window_extent().width / axes.figure.dpi
        slanted = which == "x" and bool(axis.names) and len("  ".join(names)) > room
        own.set_ticks(axis.ticks, names, **_SLANTED if slanted else {})
        own.set_minor_formatter(NullFormatter())
        own.set_tick_params(which="minor", length=0)
    elif not axis.log:
        integer = axis.name in ("Slot", "Horizon", "Frame")
        most = 7 if which == "y" else min(10 if integer else 6, round(2.4 * _inches_wide(axes)))
        own.set_major_locator(MaxNLocator(nbins=most, steps=[1, 2, 2.5, 5, 10], integer=integer,
                                           min_n_ticks=1 if integer else 2))  # fmt: skip
        if axis.unit and not integer:
            _scale_power(axes, axis, which)


def _label(axes: Axes, axis: Axis, which: str, power: str = "") -> str:
    """Return the label of an axis, wrapped at the height of its panel."""
    text = str(replace(axis, unit=power + axis.unit))
    high = axes.get_window_extent().height / axes.figure.dpi
    return text if which == "x" or "$" in axis.name else _folded(text, high + 0.4 * bool(power))


def _folded(text: str, inches: float) -> str:
    """Return a label in lines of a length, broken after commas where possible."""
    most = max(12, int(1.2 * CHARACTERS_PER_INCH * inches))
    if len(text) <= most or "\n" in text:
        return text
    return "\n".join(textwrap.fill(part, most) for part in re.split("(?<=,) ", text))


def _inches_wide(axes: Axes) -> float:
    """Return the approximate width of a panel, from the columns that it spans."""
    place = axes.get_subplotspec()
    width = float(axes.figure.bbox.width / axes.figure.dpi)
    if place is None:
        return width
    return width * len(place.colspan) / place.get_gridspec().ncols


def _scale_log(axes: Axes, which: str) -> bool:
    """Set a logarithmic scale if there is a positive value."""
    least = axes.dataLim.minposx if which == "x" else axes.dataLim.minposy
    if not math.isfinite(least):
        return False
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    (axes.set_xmargin if which == "x" else axes.set_ymargin)(0.08)
    axes.autoscale_view()
    return True


def _tick_log(axes: Axes, which: str) -> None:
    """Set tick labels of a logarithmic axis as plain numbers, several on a short axis."""
    own = axes.xaxis if which == "x" else axes.yaxis
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    finer = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0) if high < 12.0 * low else (1.0, 2.0, 5.0)
    subs = finer if high < 200.0 * low else (1.0,)
    own.set_major_locator(LogLocator(subs=subs, numticks=12 if high < 1e4 * low else 6))
    own.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    own.set_minor_formatter(NullFormatter())


def _scale_power(axes: Axes, axis: Axis, which: str) -> None:
    """Scale the ticks of small or large values by a power of 1000 given in the label."""
    own = axes.xaxis if which == "x" else axes.yaxis
    most = float(np.max(np.abs(axes.get_xlim() if which == "x" else axes.get_ylim())))
    power = 3 * math.floor(math.log10(most) / 3) if most > 0 and math.isfinite(most) else 0
    if power == 0 or 0.05 <= most < 2e4:
        return
    own.set_label_text(_label(axes, axis, which, f"$10^{{{power}}}$ "))

    def write(value: float, _: int | None) -> str:
        ticks = own.get_majorticklocs() / 10.0**power
        exact = (d for d in range(4) if np.allclose(ticks, np.round(ticks, d), atol=1e-9))
        return f"{value / 10.0**power:.{next(exact, 4)}f}".replace("-", "\N{MINUS SIGN}")

    own.set_major_formatter(FuncFormatter(write))


def label_outer(panels: Sequence[Axes], share: str) -> None:
    """Omit the labels that the panels below or to the left already have."""
    for axes in panels:
        place = axes.get_subplotspec()
        if place is None:
            continue
        alike = [other.get_subplotspec() for other in panels]
        below = any(o and o.rowspan.start > place.rowspan.start
                    and o.colspan.start == place.colspan.start for o in alike)  # fmt: skip
        if "x" in share:
            axes.set_xlabel("" if below else axes.get_xlabel())
            axes.tick_params(labelbottom=not below)
        if "y" in share and not place.is_first_col():
            axes.set_ylabel("")
            axes.tick_params(labelleft=False)
