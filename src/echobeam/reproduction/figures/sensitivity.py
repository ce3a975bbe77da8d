"""How the claims hang on what the paper does not give: the map of them all, two of them drawn."""

from __future__ import annotations

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.figures.rates import PANELS
from echobeam.reproduction.mapping import entries, setups
from echobeam.reproduction.records import Entry, Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.tables import Table

DRAWN = ("multi-improvement", "single-improvement")
"""The headline claims, in the order of t1's panels."""


def tabulate(found: list[Entry]) -> Table:
    """Return the map, a row per claim and reading: its first number, interval and verdict."""
    rows = []
    for entry in found:
        measured = entry.finding.measured
        ours = measured.headline
        rows.append(
            (
                entry.finding.claim.id,
                entry.reading,
                next(iter(measured.estimates)),
                ours.value,
                ours.low,
                ours.high,
                measured.unit,
                entry.trials,
                100 * entry.fallbacks,
                entry.judgement,
            )
        )
    numbers = ("quantity", "ours", "95 % low", "95 % high", "unit", "trials", "fallback beams (%)")
    return Table(("claim", "reading", *numbers, "verdict"), rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw a panel per headline: the improvement under every change, and the paper's value."""
    figure = style.new_figure(style.PAGE, 4.1)
    found = entries(results)
    for axes, claim, (_, panel, paper) in zip(figure.subplots(1, 2), DRAWN, PANELS, strict=True):
        shown = [entry for entry in found if entry.finding.claim.id == claim]
        rows = np.arange(len(shown))
        axes.axvspan(0.8 * paper, 1.2 * paper, color=style.SHADE, linewidth=0)
        axes.axvline(paper, color=style.VERMILION, linestyle="--")
        for row, entry in enumerate(shown):
            ours = entry.finding.measured.headline
            axes.errorbar(
                ours.value, row, xerr=[[ours.value - ours.low], [ours.high - ours.value]],
                color=style.BLUE, marker="o", capsize=2,
                markerfacecolor="white" if entry.fallback else style.BLUE,
            )  # fmt: skip
        axes.set_yticks(rows, [entry.reading.replace("P_T", "$P_T$") for entry in shown])
        axes.invert_yaxis()
        axes.axvline(0.0, color="0.4", linewidth=0.8)
        axes.set(
            title=f"{panel}; paper: +{paper} %\n{_trials(shown)}",
            xlabel="Improvement in slot 6 (%)",
        )
    draw_as.titled(
        figure,
        "Sensitivity of the headline improvements to what the paper does not give",
        draw_as.flight(results[PANELS[0][0].name].scenario),
        "one reading changed at a time, min_rate in proportion to $P_T$; 95 % intervals\n"
        "dashed: the paper's value, shaded: within 20 % of it\n"
        "hollow: most beams are a fallback, since none met all that was asked",
    )
    return Picture(figure, tabulate(found))


def _trials(shown: list[Entry]) -> str:
    default, *others = (entry.trials for entry in shown)
    if set(others) == {default}:
        return f"{default} trials each"
    return f"{default} trials by default, else {min(others)}"


FIGURE = Figure(
    "sensitivity",
    "how the claims of t1 to t7-2 hang on values that the paper does not give; drawn for t1's",
    setups(),
    draw,
)
