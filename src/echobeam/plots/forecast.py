"""Errors of forecasts against their horizon, beside those that the covariances promise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from echobeam.estimation.consistency import chi_square_band
from echobeam.plots import style
from echobeam.plots.setting import check_variables, read_scenario, read_setting
from echobeam.simulation.forecast import MOST_SLOTS, SIGMAS, forecast_errors

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from echobeam.scenario.model import Scenario
    from echobeam.values import Array

_PANELS = (
    ("angle", "Angle error, RMS (deg)", 180.0 / np.pi),
    ("position", "Position error, RMS (m)", 1.0),
)
_PROMISED = 99.73
_LEAST_SHARE = 98.0


@style.styled()
def draw(result: xr.Dataset) -> Figure:
    """Draw the error of forecasts without measurements against their horizon, up to 50 slots.

    Every horizon has the same forecasts: those made in the slots that `origins` chooses. Dotted
    is the root mean square that the forecasts' covariances promise, shaded the band in which 95 %
    of the root mean square errors of an honest filter lie; the last panel has the share of angles
    within three promised standard deviations.

    Parameters
    ----------
    result
        A result of a run; its length limits the horizon.

    Raises
    ------
    PlotError
        If the result lacks variables of a run.
    """
    check_variables(
        result, "truth", "identity", "uav_velocity", "predicted", "estimated", "estimated_cov"
    )
    setting, scenario = read_setting(result), read_scenario(result)
    figure = style.new_figure(style.PAGE, 2.9)
    axes = list(figure.subplots(1, 3, sharex=True))
    why = _unable(result, scenario)
    if why or scenario is None:
        figure.suptitle(setting.title())
        style.add_note(axes[1], why)
        return figure
    made = origins(result, scenario)
    slots = f"slot {made[0]}" if len(made) == 1 else f"slots {made[0]} to {made[-1]}"
    figure.suptitle(f"{setting.title()}; forecasts made in {slots}")
    style.add_legend(figure, draw_errors(axes, forecast_errors(result, scenario, made)))
    return figure


def origins(result: xr.Dataset, scenario: Scenario) -> range:
    """Return the slots in which forecasts are made.

    The first ends the first frame, or the first half of a single one, when velocities have been
    measured for a while; the last leaves room for the longest horizon that the first one has.
    """
    n, frame = result.sizes["slot"], scenario.frame.slots_per_frame
    first = frame if frame < n else max(1, n // 2)
    start = int(result["slot"].values[0])
    return range(start + first - 1, start + n - min(MOST_SLOTS, n - first))


def draw_errors(axes: list[Axes], found: xr.Dataset) -> list[Artist]:
    """Draw `forecast_errors` into three axes and return the legend's entries."""
    names = [str(name) for name in found["scheme"].values]
    looks = style.scheme_looks(names)
    handles: list[Artist] = []
    for one, (quantity, label, factor) in zip(axes, _PANELS, strict=False):
        one.set_ylabel(label)
        part = found.sel(quantity=quantity)
        lines = [_draw_scheme(one, part.sel(scheme=n), looks[n], n, factor) for n in names]
        handles = handles or [*lines]
        if any(line.axes is one for line in lines):
            style.scale_log(one)
        else:
            style.add_note(one, "nothing was forecast")
    _draw_shares(axes[2], found.sel(quantity="angle"), looks)
    for one in axes:
        one.set_xlabel("Horizon (slots)")
        one.xaxis.set_major_locator(MaxNLocator(nbins=6, integer=True, min_n_ticks=1))
    axes[0].set_xlim(0.5, found.sizes["horizon"] + 0.5)
    dotted = Line2D([], [], color=style.FAINT, label="promised by the covariances", **_DOTTED)
    band = Patch(facecolor="0.6", alpha=0.5, label="95 % band of the promise")
    return [*handles, dotted, band]


_DOTTED: dict[str, Any] = {"linewidth": 1.0, "linestyle": (0, (1.0, 1.0)), "zorder": 1.8}


def promise_band(promised: Array, degrees: Array) -> Array:
    """Return where 95 % of root mean square errors lie if the promise is kept, ``(n, 2)``.

    Parameters
    ----------
    promised
        ``(n,)``: root mean square of the promised standard deviations.
    degrees
        ``(n,)``: of freedom of the mean square error; NaN gives NaN.
    """
    band = [chi_square_band(1, one) if np.isfinite(one) else (np.nan, np.nan) for one in degrees]
    return np.asarray(promised[:, None] * np.sqrt(np.array(band)))


def _draw_scheme(
    axes: Axes, part: xr.Dataset, look: style.Look, name: str, factor: float
) -> Line2D:
    if not (part["count"] > 0).any():
        return style.absent(look, f"{name} (no forecast)")
    horizon = part["horizon"].values
    promised = factor * part["promised"].values
    low, high = promise_band(promised, part["degrees"].values).T
    axes.fill_between(horizon, low, high, color=look.colour, alpha=0.18, linewidth=0, zorder=1.5)
    axes.plot(horizon, promised, color=look.colour, **_DOTTED)
    return style.draw_line(axes, horizon, factor * part["rmse"].values, look, name)


def _draw_shares(axes: Axes, part: xr.Dataset, looks: dict[str, style.Look]) -> None:
    axes.set_ylabel(f"Angles inside ±{SIGMAS:g}σ (%)")
    axes.axhline(_PROMISED, color="0.25", linewidth=0.8, zorder=1.4)
    lowest = _LEAST_SHARE
    for name, look in looks.items():
        share = 100.0 * part["inside"].sel(scheme=name).values
        if np.isfinite(share).any():
            style.draw_line(axes, part["horizon"].values, share, look, name)
            lowest = min(lowest, float(np.nanmin(share)))
    axes.set_ylim(lowest - 0.06 * (100.0 - lowest), 100.0 + 0.06 * (100.0 - lowest))


def _unable(result: xr.Dataset, scenario: Scenario | None) -> str:
    """Return why there is nothing to draw, an empty text if there is something."""
    if scenario is None:
        return "the result does not say its scenario"
    if result.sizes["object"] == 0:
        return "no objects to forecast"
    return "" if result.sizes["slot"] > 1 else "one slot: nothing lies ahead"
