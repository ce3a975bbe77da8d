"""Drawing of fields: filled contours in greys, light where the value is high."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure

from echobeam.plots.field import Field

_SHADES = LinearSegmentedColormap.from_list("shades", ["0.55", "1.0"])
"""Greys to white: what is drawn around a peak has a white ground, and black is seen on all."""


def shade(axes: Axes, field: Field) -> QuadContourSet:
    """Draw a field and return the mappable of its colour bar."""
    levels = np.array(field.levels)
    # A small distance from the ends: values beyond them have the shades of the ends.
    inside = 1e-9 * (levels[-1] - levels[0])
    values = np.clip(field.values, levels[0] + inside, levels[-1] - inside)
    return axes.contourf(
        field.x, field.y, np.ma.masked_invalid(values), levels=levels, cmap=_SHADES, zorder=0.2
    )


def add_bar(figure: Figure, panels: Sequence[Axes], shaded: QuadContourSet, field: Field) -> None:
    """Add the colour bar of a field that some panels share.

    Parameters
    ----------
    figure, panels
        Figure, and the panels beside which the bar stands.
    shaded
        Of one panel.
    field
        One of the fields, which have the same levels.
    """
    bar = figure.colorbar(
        shaded, ax=list(panels), label=str(field), ticks=list(field.levels[::2]),
        shrink=0.8, aspect=20.0, pad=0.015,
    )  # fmt: skip
    bar.ax.tick_params(length=2.0)
    bar.outline.set_linewidth(0.6)
