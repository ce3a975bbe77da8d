"""Sensitivity of the claims to values that the paper does not give: the map, and two drawn."""

from __future__ import annotations

import numpy as np

from echobeam.plots.looks import BLUE, DASHED, SHADE, VERMILION, Look
from echobeam.plots.record import Axis, FigureData, Guide, Panel, Series
from echobeam.reproduction.captions import flight
from echobeam.reproduction.figures.rates import PANELS
from echobeam.reproduction.mapping import entries, setups
from echobeam.reproduction.records import Entry, Figure
from echobeam.reproduction.results import Results

DRAWN = ("multi-improvement", "single-improvement")
"""The headline claims, in the order of t1's panels."""


def data(results: Results) -> FigureData:
    """Return a panel per headline: the improvement under every change, and the paper's value."""
    found = entries(results)
    panels = []
    for claim, (_, words, paper) in zip(DRAWN, PANELS, strict=True):
        shown = [entry for entry in found if entry.finding.claim.id == claim]
        panels.append(_panel(shown, words, float(paper)))
    return FigureData(
        "sensitivity",
        "Sensitivity of the headline improvements to what the paper does not give",
        tuple(panels),
        flight(results[PANELS[0][0].name].scenario),
        "one reading changed at a time, min_rate in proportion to $P_T$; 95 % intervals\n"
        "hollow: most beams are a fallback, since none met all that was asked",
        size=(7.16, 3.6),
    )


def _panel(shown: list[Entry], words: str, paper: float) -> Panel:
    rows = np.arange(len(shown), dtype=float)
    fallback = np.array([entry.fallback for entry in shown])
    ours = [entry.finding.measured.headline for entry in shown]
    value = np.array([one.value for one in ours])
    band = np.array([(one.low, one.high) for one in ours])
    series = tuple(
        Series(name, value[some], rows[some], band[some], Look(BLUE, "o", ""), kind="points",
               sideways=True, hollow=hollow, legend=False)
        for name, some, hollow in (("ours", ~fallback, False), ("ours, mostly fallbacks",
                                                                fallback, True))
        if some.any()
    )  # fmt: skip
    return Panel(
        Axis("Improvement in slot 6", "%"),
        Axis("", limits=(len(shown) - 0.5, -0.5), ticks=tuple(map(float, rows)),
             names=tuple(entry.reading.replace("P_T", "$P_T$") for entry in shown)),
        series,
        f"{words}; paper: +{paper:g} %\n{_trials(shown)}",
        guides=(
            Guide("x", 0.8 * paper, 1.2 * paper, Look(SHADE), "within 20 % of the paper's"),
            Guide("x", paper, look=Look(VERMILION, "", DASHED), name="the paper's value"),
            Guide("x", 0.0),
        ),
    )  # fmt: skip


def _trials(shown: list[Entry]) -> str:
    default, *others = (entry.trials for entry in shown)
    if set(others) == {default}:
        return f"{default} trials each"
    return f"{default} trials by default, else {min(others)}"


FIGURE = Figure(
    "sensitivity",
    "sensitivity of the claims of t1 to t7-2 to values not given in the paper; drawn for t1's",
    setups(),
    data,
    place=12,
)
