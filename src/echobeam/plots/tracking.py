"""Angle and distance errors per slot, against the posterior Cramer-Rao bound."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from echobeam.plots import style
from echobeam.plots.series import estimation_errors, pooled_bound
from echobeam.plots.setting import check_variables, read_setting
from echobeam.plots.slot_axis import label_slots, limit_slots, shade_phases

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    from echobeam.values import Array

_PANELS = (
    ("angle", "Angle RMSE (deg)", 180.0 / np.pi),
    ("distance", "Distance RMSE (m)", 1.0),
)

# Errors below this (deg, m) are rounding: the genie's, which knows the truth.
_ZERO = 1e-9

_BOUND: dict[str, Any] = {"linewidth": 1.0, "linestyle": (0, (1.0, 1.0)), "zorder": 1.8}


@style.styled()
def draw(result: xr.Dataset) -> Figure:
    """Draw the error of the estimated angle and distance of every scheme, slot by slot.

    The root mean square is taken over trials and the objects in the scene. Where the result
    carries a posterior Cramer-Rao bound (variable ``bound``, see `pooled_bound`) it is drawn in
    the scheme's colour.

    Parameters
    ----------
    result
        A result of a run.

    Raises
    ------
    PlotError
        If the result holds no estimates.
    """
    check_variables(result, "truth", "present", "predicted", "estimated", "phase")
    setting = read_setting(result)
    figure = style.new_figure(style.COLUMN, 4.1)
    figure.suptitle(setting.title(width=52))
    panels = figure.subplots(2, 1, sharex=True)
    handles: list[Line2D | Patch] = []
    for axes, (component, label, factor) in zip(panels, _PANELS, strict=True):
        axes.set_ylabel(label)
        if result.sizes["object"] == 0:
            style.add_note(axes, "no objects: nothing to track")
            continue
        lines = _draw_panel(axes, result, component, factor)
        # The panels share one legend, that of the angle.
        handles = handles or lines
    label_slots(panels[-1], setting.slot)
    limit_slots(panels[-1], result)
    style.add_legend(figure, handles)
    return figure


def _draw_panel(
    axes: Axes, result: xr.Dataset, component: str, factor: float
) -> list[Line2D | Patch]:
    """Draw one component's errors and bounds and return the legend's entries."""
    names = [str(name) for name in result["scheme"].values]
    looks = style.scheme_looks(names)
    errors = estimation_errors(result, component)
    handles: list[Line2D | Patch] = [
        _draw_errors(axes, result, factor * errors.rmse[i], looks[name], name)
        for i, name in enumerate(names)
    ]
    drawn = [i for i, handle in enumerate(handles) if handle.axes is axes]
    if not drawn:
        style.add_note(axes, "no estimates, or none with an error")
        return handles
    bound = pooled_bound(result, component, errors.trials)
    bounded = [] if bound is None else [i for i in drawn if np.isfinite(bound[i]).any()]
    if bound is not None and bounded:
        for i in bounded:
            values = _positive(factor * bound[i])
            axes.plot(result["slot"].values, values, color=looks[names[i]].colour, **_BOUND)
        label = "posterior Cramér–Rao bound"
        handles.append(Line2D([], [], color=style.FAINT, label=label, **_BOUND))
    style.scale_log(axes)
    return handles + shade_phases(axes, result)


def _draw_errors(
    axes: Axes, result: xr.Dataset, errors: Array, look: style.Look, name: str
) -> Line2D:
    if not np.isfinite(errors).any():
        return style.absent(look, f"{name} (no estimate)")
    if not (errors > _ZERO).any():
        return style.absent(look, f"{name} (no error)")
    return style.draw_line(axes, result["slot"].values, _positive(errors), look, name)


def _positive(values: Array) -> Array:
    """Leave gaps where a logarithmic axis has no place for a value."""
    return np.where(values > _ZERO, values, np.nan)
