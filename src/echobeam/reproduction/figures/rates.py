"""Rate per slot, proposed against pilot scheme, for two objects and for one (the paper's t1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.estimates import gain_percent
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import headline, multi, single
from echobeam.reproduction.tables import Table
from echobeam.simulation.summary import REFERENCE_SLOT, mean_interval

if TYPE_CHECKING:
    from matplotlib.lines import Line2D

PANELS = (
    (headline("paper-multi"), "two objects", 156),
    (headline("paper-single"), "one object", 136),
)
"""Setup, what it is called, and the paper's improvement in its slot 6, per cent."""

SCHEMES = {"temporal": "proposed (temporal)", "pilot": "pilot"}


def tabulate(results: Results) -> Table:
    """Return mean sum rates per slot with their intervals."""
    rows: list[tuple[str | int | float, ...]] = []
    for setup, panel, _ in PANELS:
        for scheme in SCHEMES:
            mean, interval = mean_interval(results[setup.name].sum_rate(scheme))
            rows += [
                (panel, scheme, slot + 1, *map(float, (mean[slot], *interval[slot])))
                for slot in range(len(mean))
            ]
    columns = ("objects", "scheme", "slot", "sum rate (bit/s/Hz)", "95 % low", "95 % high")
    return Table(columns, rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw both panels with the improvement in the paper's slot."""
    figure = style.new_figure(style.PAGE, 3.1)
    handles: list[Line2D] = []
    for axes, (setup, panel, paper) in zip(figure.subplots(1, 2), PANELS, strict=True):
        outcome = results[setup.name]
        handles = []
        for scheme, label in SCHEMES.items():
            mean, band = mean_interval(draw_as.RATE_SCALE * outcome.sum_rate(scheme))
            look, slots = style.SCHEME_LOOKS[scheme], np.arange(1, len(mean) + 1)
            handles.append(draw_as.curve(axes, slots, mean, band, look, label))
        slot = REFERENCE_SLOT - 1
        above, below = (outcome.sum_rate(scheme)[:, slot] for scheme in SCHEMES)
        gain = gain_percent(above, below)
        x, ends = slot + 1, [draw_as.RATE_SCALE * one.mean() for one in (above, below)]
        arrow = {"arrowstyle": "<->", "color": "0.25", "linewidth": 0.8}
        axes.annotate("", (x, ends[0]), (x, ends[1]), arrowprops=arrow)
        axes.text(
            x + 0.2,
            np.mean(ends),
            f"{gain.value:+.0f} %\n({gain.low:+.0f} to {gain.high:+.0f})\npaper: {paper:+d} %",
            va="center",
        )
        draw_as.slot_axis(axes, len(mean))
        axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
        axes.set_ylabel(f"Sum rate ({draw_as.RATE_UNIT})")
        axes.set_title(f"{panel}: {draw_as.objects(outcome.scenario)}")
    trials = outcome.point.trials
    draw_as.titled(
        figure,
        "Rate per slot, proposed against pilot scheme",
        draw_as.flight(outcome.scenario),
        f"means of {trials} trials with 95 % bands; shaded: omni or pilot slot",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(results))


FIGURE = Figure(
    "t1",
    "rate per slot, proposed against pilot scheme, two objects and one",
    (multi(), single(), headline("paper-multi"), headline("paper-single")),
    draw,
)
