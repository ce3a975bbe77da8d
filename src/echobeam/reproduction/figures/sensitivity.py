"""How the two headline improvements hang on what the paper does not give: a map of our own."""

from __future__ import annotations

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.estimates import gain_percent
from echobeam.reproduction.figures.rates import PANELS
from echobeam.reproduction.records import Entry, Estimate, Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import VARIATIONS, Setup, multi, single, varied
from echobeam.reproduction.tables import Table
from echobeam.simulation.summary import REFERENCE_SLOT


def setups() -> tuple[Setup, ...]:
    """Return the defaults and everything that differs from them in one reading."""
    changed = [
        varied(base, variation)
        for base in ("multi", "single")
        for variation in VARIATIONS
        if base in variation.bases
    ]
    return (multi(), single(), *changed)


def entries(results: Results) -> list[Entry]:
    """Return the map, the default reading of each panel first."""
    found = []
    for base, (default, panel, paper) in zip(("multi", "single"), PANELS, strict=True):
        readings = {"default reading": default} | {
            variation.label: varied(base, variation)
            for variation in VARIATIONS
            if base in variation.bases
        }
        found += [
            Entry(panel, label, improvement(results, setup), paper, fallbacks(results, setup))
            for label, setup in readings.items()
        ]
    return found


def fallbacks(results: Results, setup: Setup) -> float:
    """Return the share of directional slots with fallback beams, of the scheme that has more."""
    outcome = results[setup.name]
    frame, counts = outcome.scenario.frame, outcome.digest["fallback"]
    return float(counts.mean(axis=1).max() / (frame.frames * (frame.slots_per_frame - 1)))


def improvement(results: Results, setup: Setup) -> Estimate:
    """Return the first scheme's improvement over the second in the paper's slot, per cent."""
    outcome = results[setup.name]
    above, below = (outcome.sum_rate(scheme)[:, REFERENCE_SLOT - 1] for scheme in setup.schemes)
    return gain_percent(above, below)


def tabulate(results: Results) -> Table:
    """Return the map with intervals."""
    rows = [
        (
            entry.objects,
            entry.change,
            entry.improvement.value,
            *_ends(entry.improvement),
            100 * entry.fallbacks,
        )
        for entry in entries(results)
    ]
    ends = ("95 % low (%)", "95 % high (%)")
    return Table(("objects", "change", "improvement (%)", *ends, "fallback beams (%)"), rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw a panel per headline: the improvement under every change, and the paper's value."""
    figure = style.new_figure(style.PAGE, 3.9)
    found = entries(results)
    for axes, (_, panel, paper) in zip(figure.subplots(1, 2), PANELS, strict=True):
        shown = [entry for entry in found if entry.objects == panel]
        rows = np.arange(len(shown))
        axes.axvspan(0.8 * paper, 1.2 * paper, color=style.SHADE, linewidth=0)
        axes.axvline(paper, color=style.VERMILION, linestyle="--")
        for row, entry in enumerate(shown):
            ours = entry.improvement
            axes.errorbar(
                ours.value, row, xerr=[[ours.value - ours.low], [ours.high - ours.value]],
                color=style.BLUE, marker="o", capsize=2,
                markerfacecolor="white" if entry.fallback else style.BLUE,
            )  # fmt: skip
        axes.set_yticks(rows, [entry.change for entry in shown])
        axes.invert_yaxis()
        axes.axvline(0.0, color="0.4", linewidth=0.8)
        axes.set(title=f"{panel}; paper: +{paper} %", xlabel="Improvement in slot 6 (%)")
    outcome = results[single().name]
    trials = results[varied("single", VARIATIONS[0]).name].point.trials
    draw_as.titled(
        figure,
        "Sensitivity of the headline improvements to what the paper does not give",
        draw_as.flight(outcome.scenario),
        f"one reading changed at a time, {trials} trials each; 95 % intervals; dashed: the paper's "
        "value, shaded: within 20 % of it\nhollow: most beams are a fallback, since none met all "
        "that was asked",
    )
    return Picture(figure, tabulate(results))


def _ends(estimate: Estimate) -> tuple[float, float]:
    return estimate.low, estimate.high


FIGURE = Figure(
    "sensitivity",
    "how the improvements of t1 hang on values that the paper does not give",
    setups(),
    draw,
)
