"""Angle tracking against water-filling over the UAV's height (the paper's t7-2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.estimates import bootstrap, rms, rms_with_band
from echobeam.reproduction.figures.height_rates import SCHEMES, SHOWN
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import HEIGHTS, height
from echobeam.reproduction.tables import Table
from echobeam.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

TAIL = 0.95


def errors(results: Results, metres: int, scheme: str) -> Array:
    """Return ``(trial, slot)`` deg: the estimate's error, NaN where the track is lost."""
    return np.asarray(np.degrees(results[height(metres).name].error(scheme, "angle")[:, :, 0]))


def tabulate(results: Results) -> Table:
    """Return root mean square and tail of the error of every height, scheme and slot."""
    rows: list[tuple[str | int | float, ...]] = []
    for metres in HEIGHTS:
        for scheme in SCHEMES:
            off = errors(results, metres, scheme)
            rmse, band = rms_with_band(off)
            tail, lost = _tail(off), lost_percent(off)
            rows += [
                (metres, scheme, i + 1, *map(float, (rmse[i], *band[i], tail[i], lost[i])))
                for i in range(len(rmse))
            ]
    names = ("RMSE", "95 % low", "95 % high", "95 % quantile of |error|")
    errors_of = (f"{name} (deg)" for name in names)
    return Table(("height (m)", "scheme", "slot", *errors_of, "tracks lost (%)"), rows)


def lost_percent(error: Array) -> Array:
    """Return the share of trials ``(trial, slot)`` without an estimate, ``(slot,)`` %."""
    return np.asarray(100.0 * np.isnan(error).mean(axis=0))


def _tail(error: Array) -> Array:
    return np.asarray(np.nanquantile(np.abs(error), TAIL, axis=0))


@style.styled()
def draw(results: Results) -> Picture:
    """Draw a panel per height of the paper, and the last slot's error over all heights."""
    figure = style.new_figure(style.PAGE, 4.75)
    panels = figure.subplots(2, 2)
    handles: list[Line2D] = []
    for axes, metres in zip(panels.flat, SHOWN, strict=False):
        handles = _draw_height(axes, results, metres)
    low, high = zip(*(axes.get_ylim() for axes in panels.flat[:3]), strict=True)
    for axes in panels.flat[:3]:
        axes.set_ylim(min(low), max(high))
    _draw_heights(panels[1, 1], results)
    outcome = results[height(SHOWN[0]).name]
    draw_as.titled(
        figure,
        "Angle tracking of the proposed scheme and of water-filling over the height",
        f"{draw_as.flight(outcome.scenario, height=False)}; {draw_as.objects(outcome.scenario)}",
        f"{outcome.point.trials} trials: RMSE with 95 % bands (thick) and 95 % quantiles of the "
        f"error's size (thin)\nof the tracks kept; at {SHOWN[-1]} m water-filling has lost "
        f"{lost_percent(errors(results, SHOWN[-1], 'water-filling'))[-1]:.1f} %",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(results))


def _draw_height(axes: Axes, results: Results, metres: int) -> list[Line2D]:
    handles = []
    for scheme, label in SCHEMES.items():
        off, look = errors(results, metres, scheme), style.SCHEME_LOOKS[scheme]
        rmse, band = rms_with_band(off)
        slots = np.arange(1, len(rmse) + 1)
        handles.append(draw_as.curve(axes, slots, rmse, band, look, label))
        axes.plot(slots, _tail(off), color=look.colour, linestyle=look.line, linewidth=0.7)
    style.scale_log(axes)
    draw_as.slot_axis(axes, len(slots))
    axes.set_title(f"$h$ = {metres} m")
    axes.set_ylabel("Angle error (deg)")
    return handles


def _draw_heights(axes: Axes, results: Results) -> None:
    for scheme in SCHEMES:
        found = [bootstrap(rms, errors(results, metres, scheme)[:, -1]) for metres in HEIGHTS]
        band = np.array([(one.low, one.high) for one in found])
        values = np.array([one.value for one in found])
        draw_as.curve(axes, HEIGHTS, values, band, style.SCHEME_LOOKS[scheme], scheme)
    style.scale_log(axes)
    axes.set(xticks=HEIGHTS, xlabel="Height $h$ (m)")
    axes.set_title("slot 10")
    axes.set_ylabel("Angle RMSE (deg)")


FIGURE = Figure(
    "t7-2",
    "angle tracking against water-filling over the UAV's height",
    tuple(height(metres) for metres in HEIGHTS),
    draw,
)
