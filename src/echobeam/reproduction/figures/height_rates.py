"""Rates against water-filling over the UAV's height (the paper's t7-1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.estimates import bootstrap
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import HEIGHTS, height
from echobeam.reproduction.tables import Table
from echobeam.simulation.summary import mean_interval
from echobeam.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

SCHEMES = {"temporal": "proposed (temporal)", "water-filling": "water-filling"}
SHOWN = (100, 105, 110)
TAIL = 0.05


def frame_rate(results: Results, metres: int, scheme: str) -> Array:
    """Return ``(trial,)`` bit/s/Hz: the mean rate over a trial's frame."""
    return np.asarray(results[height(metres).name].sum_rate(scheme).mean(axis=-1))


def tabulate(results: Results) -> Table:
    """Return mean and tail of the rate per slot, and of the frame's mean (slot 0)."""
    rows: list[tuple[str | int | float, ...]] = []
    for metres in HEIGHTS:
        for scheme in SCHEMES:
            slots = results[height(metres).name].sum_rate(scheme)
            columns = [slots.mean(axis=-1), *slots.T]
            for slot, values in enumerate(columns):
                mean, interval = mean_interval(values)
                tail = float(np.quantile(values, TAIL))
                rows.append((metres, scheme, slot, float(mean), *map(float, interval), tail))
    names = ("sum rate (bit/s/Hz)", "95 % low", "95 % high", "5 % quantile (bit/s/Hz)")
    return Table(("height (m)", "scheme", "slot (0: frame's mean)", *names), rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw a panel per height of the paper, and mean and tail of the frame over all heights."""
    figure = style.new_figure(style.PAGE, 4.6)
    panels = figure.subplots(2, 2)
    handles: list[Line2D] = []
    for axes, metres in zip(panels.flat, SHOWN, strict=False):
        handles = _draw_height(axes, results, metres)
    for axes in panels.flat[:3]:
        axes.set_ylim(0, panels[0, 0].get_ylim()[1])
    _draw_heights(panels[1, 1], results)
    outcome = results[height(SHOWN[0]).name]
    draw_as.titled(
        figure,
        "Rates of the proposed scheme and of water-filling over the height",
        f"{draw_as.flight(outcome.scenario, height=False)}; {draw_as.objects(outcome.scenario)}",
        f"{outcome.point.trials} trials: means (thick) and 5 % quantiles (thin) with 95 % bands; "
        "shaded: omni slot",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(results))


def _draw_height(axes: Axes, results: Results, metres: int) -> list[Line2D]:
    handles = []
    for scheme, label in SCHEMES.items():
        rate = draw_as.RATE_SCALE * results[height(metres).name].sum_rate(scheme)
        slots, look = np.arange(1, rate.shape[1] + 1), style.SCHEME_LOOKS[scheme]
        mean, band = mean_interval(rate)
        handles.append(draw_as.curve(axes, slots, mean, band, look, label))
        _draw_tail(axes, slots, list(rate.T), look)
    draw_as.slot_axis(axes, len(slots))
    axes.set_title(f"$h$ = {metres} m")
    axes.set_ylabel(f"Rate ({draw_as.RATE_UNIT})")
    return handles


def _draw_heights(axes: Axes, results: Results) -> None:
    for scheme in SCHEMES:
        look = style.SCHEME_LOOKS[scheme]
        rates = [draw_as.RATE_SCALE * frame_rate(results, metres, scheme) for metres in HEIGHTS]
        mean, band = mean_interval(np.stack(rates, axis=1))
        draw_as.curve(axes, HEIGHTS, mean, band, look, scheme)
        _draw_tail(axes, HEIGHTS, rates, look)
    axes.set(xticks=HEIGHTS, xlabel="Height $h$ (m)", ylim=(0, None))
    axes.set_title("rate over the frame, by height")
    axes.set_ylabel(f"Rate ({draw_as.RATE_UNIT})")


def _draw_tail(axes: Axes, x: npt.ArrayLike, samples: Sequence[Array], look: style.Look) -> None:
    """Draw the 5 % quantile of the samples at each x as a thin line with its bootstrap's band."""
    tails = [bootstrap(lambda one: np.quantile(one, TAIL, axis=-1), values) for values in samples]
    low, high = np.array([(one.low, one.high) for one in tails]).T
    axes.fill_between(x, low, high, color=look.colour, alpha=0.1, linewidth=0, zorder=1.4)
    axes.plot(
        x, [one.value for one in tails], color=look.colour, linestyle=look.line, linewidth=0.7
    )


FIGURE = Figure(
    "t7-1",
    "rates against water-filling over the UAV's height",
    tuple(height(metres) for metres in HEIGHTS),
    draw,
)
