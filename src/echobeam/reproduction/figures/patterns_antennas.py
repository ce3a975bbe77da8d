"""Beam patterns of the first directional slot over the number of antennas (test2-2)."""

from __future__ import annotations

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.patterns import GRID, decibels, gain_at_truth, gains
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import ANTENNAS_FOR_TWO, multi
from echobeam.reproduction.tables import Table
from echobeam.simulation.summary import mean_interval
from echobeam.values import Array

SLOT = 2
LOOKS = (
    style.Look(style.GREEN, "", (0, (4.0, 1.5))),
    style.Look(style.BLACK, "", "-"),
    style.Look(style.PURPLE, "", (0, (5.0, 1.2, 1.0, 1.2))),
)
"""Looks of the numbers of antennas, in other colours than the objects'."""
QUANTILES = (0.05, 0.5, 0.95)


def total(results: Results, n: int) -> Array:
    """Return ``(trial, angle)``: the power that all beams send together."""
    return np.asarray(gains(results[multi(n).name], SLOT).sum(axis=1))


def tabulate(results: Results) -> Table:
    """Return the quantiles of the total pattern of every array."""
    rows: list[tuple[int | float, ...]] = []
    for n in ANTENNAS_FOR_TWO:
        quantiles = np.quantile(total(results, n), QUANTILES, axis=0)
        rows += [
            (n, float(angle), *map(float, quantiles[:, i]))
            for i, angle in enumerate(np.degrees(GRID))
        ]
    return Table(("antennas", "angle (deg)", "gain 5 %", "gain median", "gain 95 %"), rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw the median total patterns, and how much of its beam each object receives."""
    figure = style.new_figure(style.PAGE, 3.2)
    left, right = figure.subplots(1, 2, width_ratios=[2.2, 1])
    handles = []
    for n, look in zip(ANTENNAS_FOR_TWO, LOOKS, strict=True):
        low, centre, high = decibels(np.quantile(total(results, n), QUANTILES, axis=0))
        degrees = np.degrees(GRID)
        left.fill_between(degrees, low, high, color=look.colour, alpha=0.12, linewidth=0)
        label = f"$N_t$ = $N_r$ = {n}"
        handles += left.plot(degrees, centre, color=look.colour, linestyle=look.line, label=label)
    left.set(xlim=(0, 180), xticks=range(0, 181, 30), ylim=(-25, 17))
    left.set(xlabel="Angle θ (deg)", ylabel="Gain × power, both beams (dB)")
    outcome = results[multi().name]
    for k, theta in enumerate(np.degrees(outcome.kept["truth"][0, SLOT - 1, :, 0])):
        colour = style.object_look(k).colour
        left.axvline(theta, color=colour, linewidth=0.8)
        left.annotate(
            f"object {k + 1}", (theta, 15), (3, 0), textcoords="offset points", color=colour
        )
    for k in range(2):
        for slot, filled in ((SLOT, False), (10, True)):
            samples = [gain_at_truth(results[multi(n).name], slot)[:, k] for n in ANTENNAS_FOR_TWO]
            mean, interval = mean_interval(np.stack(samples, axis=1))
            look = style.object_look(k)
            right.errorbar(
                ANTENNAS_FOR_TWO,
                mean,
                np.abs(interval.T - mean),
                color=look.colour,
                marker=look.marker,
                linestyle="-",
                markerfacecolor=look.colour if filled else "white",
                label=f"object {k + 1}, slot {slot}",
                capsize=2,
            )
    right.plot(
        ANTENNAS_FOR_TWO, ANTENNAS_FOR_TWO, color="0.6", linestyle=":", label="matched beam, $N_t$"
    )
    right.set(
        xticks=ANTENNAS_FOR_TWO, xlabel="Antennas $N_t$ = $N_r$", ylabel="Array gain at the object"
    )
    right.set_ylim(0, 1.45 * max(ANTENNAS_FOR_TWO))
    right.legend(loc="upper left", fontsize="small")
    draw_as.titled(
        figure,
        f"Beam patterns in slot {SLOT} over the number of antennas",
        f"{draw_as.flight(outcome.scenario, antennas=False)}; {draw_as.objects(outcome.scenario)}",
        f"{outcome.point.trials} trials; left: medians with 5–95 % bands; right: means with 95 % "
        "intervals, per beam power",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(results))


FIGURE = Figure(
    "test2-2",
    "beam patterns of the first directional slot over the number of antennas",
    tuple(multi(n) for n in ANTENNAS_FOR_TWO),
    draw,
)
