"""Mean rate against the angular resolution, over height and antennas (the paper's aa_acr)."""

from __future__ import annotations

from itertools import product

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import RESOLUTION_LINES, RESOLUTIONS, RIPPLES, resolution
from echobeam.reproduction.tables import Table
from echobeam.simulation.summary import mean_interval
from echobeam.values import Array

PANELS = (
    ("$N_t$ = $N_r$ = 30", ((30, 85), (30, 90), (30, 95)), "$h$ = {1} m"),
    ("$h$ = 90 m", ((25, 90), (30, 90), (35, 90)), "$N_t$ = $N_r$ = {0}"),
)
"""Title of each panel, its lines, and their labels."""


def frame_rate(
    results: Results, n: int, metres: int, degrees: float, ripple: float = RIPPLES[0]
) -> Array:
    """Return ``(trial,)`` bit/s/Hz: the mean rate over a trial's frame."""
    rate = results[resolution(n, metres, degrees, ripple).name].sum_rate("temporal")
    return np.asarray(rate.mean(axis=-1))


def line(results: Results, n: int, metres: int, ripple: float) -> tuple[Array, Array]:
    """Return mean and interval over all resolutions."""
    rates = [frame_rate(results, n, metres, degrees, ripple) for degrees in RESOLUTIONS]
    return mean_interval(np.stack(rates, axis=1))


def tabulate(results: Results) -> Table:
    """Return the mean rate of every line and resolution."""
    rows: list[tuple[int | float, ...]] = []
    for (n, metres), ripple in product(RESOLUTION_LINES, RIPPLES):
        mean, interval = line(results, n, metres, ripple)
        rows += [
            (n, metres, ripple, degrees, float(mean[i]), *map(float, interval[i]))
            for i, degrees in enumerate(RESOLUTIONS)
        ]
    names = ("antennas", "height (m)", "ripple per antenna", "resolution (deg)")
    return Table((*names, "mean rate of the frame (bit/s/Hz)", "95 % low", "95 % high"), rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw a panel over the height and one over the antennas."""
    figure = style.new_figure(style.PAGE, 3.2)
    axes_pair = figure.subplots(1, 2, sharey=True)
    for axes, (title, lines, label) in zip(axes_pair, PANELS, strict=True):
        for (n, metres), look in zip(lines, draw_as.LOOKS, strict=False):
            thin, _ = line(results, n, metres, RIPPLES[1])
            axes.plot(
                RESOLUTIONS,
                draw_as.RATE_SCALE * thin,
                color=look.colour,
                linestyle=look.line,
                linewidth=0.7,
            )
            mean, band = line(results, n, metres, RIPPLES[0])
            draw_as.curve(
                axes,
                RESOLUTIONS,
                draw_as.RATE_SCALE * mean,
                draw_as.RATE_SCALE * band,
                look,
                label.format(n, metres),
            )
        axes.set_xscale("log")
        axes.set_xticks(RESOLUTIONS, [f"{degrees:g}" for degrees in RESOLUTIONS])
        axes.minorticks_off()
        axes.set_title(title)
        axes.set_xlabel("Angular resolution (deg)")
        axes.legend(loc="lower left")
    axes_pair[0].set_ylim(bottom=0)
    axes_pair[0].set_ylabel(f"Mean rate of the frame ({draw_as.RATE_UNIT})")
    outcome = results[resolution(30, 90, RESOLUTIONS[0]).name]
    flight = draw_as.flight(outcome.scenario, height=False, antennas=False)
    draw_as.titled(
        figure,
        "Mean rate of the proposed scheme against the angular resolution of the covered grid",
        f"{flight}; {draw_as.objects(outcome.scenario)}",
        f"means of {outcome.point.trials} trials with 95 % bands; ripple {RIPPLES[0]:g} $N_t$ "
        f"(thick) and {RIPPLES[1]:g} $N_t$ (thin)",
    )
    return Picture(figure, tabulate(results))


FIGURE = Figure(
    "aa_acr",
    "mean rate against the angular resolution, over height and antennas",
    tuple(
        resolution(n, metres, degrees, ripple)
        for (n, metres), degrees, ripple in product(RESOLUTION_LINES, RESOLUTIONS, RIPPLES)
    ),
    draw,
)
