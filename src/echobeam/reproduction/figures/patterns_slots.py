"""Beam patterns over the slots of a frame, omni slot first (the paper's test2-1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.patterns import GRID, decibels, gains, half_power_width, powers
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import multi
from echobeam.reproduction.tables import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from echobeam.values import Array

SLOTS = (2, 3, 4, 6, 10)
LOWEST, HIGHEST = -32.0, 26.0


def bands(outcome: Outcome, slot: int) -> Array:
    """Return ``(3, object, angle)``: 5 % quantile, median, 95 % quantile of the gains."""
    return np.asarray(np.quantile(gains(outcome, slot), [0.05, 0.5, 0.95], axis=0))


def tabulate(outcome: Outcome) -> Table:
    """Return the quantiles of the gains of every shown slot, object and angle."""
    rows: list[tuple[int | float, ...]] = [
        (1, 0, float(angle), *[outcome.scenario.radio.power] * 3) for angle in np.degrees(GRID)
    ]
    for slot in SLOTS:
        quantiles = bands(outcome, slot)
        rows += [
            (slot, k + 1, float(angle), *map(float, quantiles[:, k, i]))
            for k in range(quantiles.shape[1])
            for i, angle in enumerate(np.degrees(GRID))
        ]
    columns = ("slot", "object (0: all)", "angle (deg)", "gain 5 %", "gain median", "gain 95 %")
    return Table(columns, rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw a panel per slot: the median pattern of each object's beam with its 5-95 % band."""
    outcome = results[multi().name]
    figure = style.new_figure(style.PAGE, 4.4)
    panels = figure.subplots(2, 3, sharex=True, sharey=True)
    _draw_omni(panels[0, 0], outcome)
    for axes, slot in zip(panels.flat[1:], SLOTS, strict=True):
        _draw_slot(axes, outcome, slot)
    panels[0, 0].set(xlim=(0, 180), ylim=(LOWEST, HIGHEST), xticks=range(0, 181, 45))
    for axes in panels[:, 0]:
        axes.set_ylabel("Gain × power (dB)")
    for axes in panels[1]:
        axes.set_xlabel("Angle θ (deg)")
    draw_as.titled(
        figure,
        "Beam patterns over the slots of a frame",
        f"{draw_as.flight(outcome.scenario)}; {draw_as.objects(outcome.scenario)}",
        f"medians over {outcome.point.trials} trials with 5–95 % bands; vertical lines: true "
        "angles; an upright array repeats every lobe at 180° − θ",
    )
    handles = [line for line in panels[0, 1].get_lines() if line.get_label().startswith("object")]
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(outcome))


def _draw_omni(axes: Axes, outcome: Outcome) -> None:
    level = float(decibels(np.array(outcome.scenario.radio.power)))
    axes.plot([0, 180], [level, level], color="black")
    axes.set_title("slot 1: omni")
    _mark_truth(axes, outcome, 1)


def _draw_slot(axes: Axes, outcome: Outcome, slot: int) -> None:
    quantiles, degrees = bands(outcome, slot), np.degrees(GRID)
    width, power = half_power_width(gains(outcome, slot)), powers(outcome, slot)
    lines = []
    for k in range(quantiles.shape[1]):
        look = style.object_look(k)
        low, centre, high = decibels(quantiles[:, k])
        axes.fill_between(degrees, low, high, color=look.colour, alpha=0.2, linewidth=0)
        axes.plot(degrees, centre, color=look.colour, linestyle=look.line, label=f"object {k + 1}")
        lines.append(
            f"half-power width {width[:, k].mean():.1f}°, power {100 * power[:, k].mean():.0f} %"
        )
    for k, text in enumerate(lines):
        axes.text(
            0.03,
            0.97 - 0.09 * k,
            text,
            transform=axes.transAxes,
            va="top",
            color=style.object_look(k).colour,
            fontsize="small",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5},
        )
    axes.set_title(f"slot {slot}")
    _mark_truth(axes, outcome, slot)


def _mark_truth(axes: Axes, outcome: Outcome, slot: int) -> None:
    for k, theta in enumerate(np.degrees(outcome.kept["truth"][0, slot - 1, :, 0])):
        # The texts above stay free of the lines.
        axes.axvline(theta, ymax=0.8, color=style.object_look(k).colour, linewidth=0.8, alpha=0.7)


FIGURE = Figure("test2-1", "beam patterns over the slots of a frame, two objects", (multi(),), draw)
