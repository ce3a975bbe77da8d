"""Mean rate against the angular resolution, over height and antennas (the paper's aa_acr)."""

from __future__ import annotations

from itertools import product

import numpy as np

from echobeam.estimation.intervals import mean_interval
from echobeam.plots.looks import parameter_look
from echobeam.plots.record import Axis, FigureData, Panel, Series, interval_series
from echobeam.reproduction.captions import flight, initial
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import RESOLUTION_LINES, RESOLUTIONS, RIPPLES, resolution
from echobeam.values import Array

PANELS = (
    ("$N_t$ = $N_r$ = 30", ((30, 85), (30, 90), (30, 95)), "$h$ = {1} m"),
    ("$h$ = 90 m", ((25, 90), (30, 90), (35, 90)), "$N_t$ = $N_r$ = {0}"),
)
"""Panels: title, lines, and labels of the lines."""


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


def data(results: Results) -> FigureData:
    """Return a panel over the height and one over the antennas."""
    outcome = results[resolution(30, 90, RESOLUTIONS[0]).name]
    panels = tuple(_panel(results, *panel) for panel in PANELS)
    where = flight(outcome.scenario, height=False, antennas=False)
    return FigureData(
        "aa_acr",
        "Mean rate of the proposed scheme against the angular resolution of the covered grid",
        panels,
        f"{where}; {initial(outcome.scenario.objects[0])}",
        f"means of {outcome.point.trials} trials; ripple {RIPPLES[0]:g} $N_t$ (with markers) and "
        f"{RIPPLES[1]:g} $N_t$ (plain)",
        size=(7.16, 2.9),
        share="y",
        band="95 % interval",
    )


def _panel(results: Results, title: str, lines: tuple[tuple[int, int], ...], label: str) -> Panel:
    marked, plain = [], []
    for number, (n, metres) in enumerate(lines):
        name, look = label.format(n, metres), parameter_look(number)
        found = line(results, n, metres, RIPPLES[0])
        marked.append(interval_series(name, RESOLUTIONS, found, look))
        mean, band = line(results, n, metres, RIPPLES[1])
        plain.append(
            Series(f"{name}, ripple {RIPPLES[1]:g} $N_t$", np.array(RESOLUTIONS), mean, band,
                   look.plain(), kind="line", width=0.8, legend=False)
        )  # fmt: skip
    return Panel(
        Axis("Angular resolution", "deg", log=True, ticks=RESOLUTIONS),
        Axis("Mean rate of the frame", "bit/s/Hz", limits=(0.0, None)),
        (*marked, *plain),
        title,
        legend=True,
    )


FIGURE = Figure(
    "aa_acr",
    "mean rate against the angular resolution, over height and antennas",
    tuple(
        resolution(n, metres, degrees, ripple)
        for (n, metres), degrees, ripple in product(RESOLUTION_LINES, RESOLUTIONS, RIPPLES)
    ),
    data,
    place=11,
)
