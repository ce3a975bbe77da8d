"""Rate per slot, proposed against pilot scheme, for two objects and for one (the paper's t1)."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import mean_interval
from echobeam.plots.looks import SCHEME_LOOKS
from echobeam.plots.record import Axis, FigureData, Note, Panel, interval_series
from echobeam.reproduction.captions import flight, initial, omni_slots, slot_axis
from echobeam.reproduction.estimates import gain_percent
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import Setup, headline, multi, single
from echobeam.simulation.summary import REFERENCE_SLOT

PANELS = (
    (headline("paper-multi"), "two objects", 156),
    (headline("paper-single"), "one object", 136),
)
"""Setups, their titles, and the paper's improvement in slot 6, %."""

SCHEMES = {"temporal": "proposed (temporal)", "pilot": "pilot", "posterior": "posterior"}


def data(results: Results) -> FigureData:
    """Return both panels with the improvement in the paper's slot."""
    outcome = results[PANELS[0][0].name]
    return FigureData(
        "t1",
        "Rate per slot, proposed against pilot scheme",
        tuple(_panel(results, *panel) for panel in PANELS),
        flight(outcome.scenario),
        f"means of {outcome.point.trials} trials",
        size=(7.16, 3.4),
        band="95 % interval",
    )


def _panel(results: Results, setup: Setup, words: str, paper: int) -> Panel:
    outcome = results[setup.name]
    series = [
        interval_series(label, range(1, 11), mean_interval(outcome.sum_rate(scheme)),
                        SCHEME_LOOKS[scheme])
        for scheme, label in SCHEMES.items()
    ]  # fmt: skip
    slot = REFERENCE_SLOT - 1
    above, below = (outcome.sum_rate(scheme)[:, slot] for scheme in ("temporal", "pilot"))
    gain = gain_percent(above, below)
    ends = float(below.mean()), float(above.mean())
    text = f"{gain.value:+.0f} %\n({gain.low:+.0f} to {gain.high:+.0f})\npaper: {paper:+d} %"
    note = Note(text, slot + 1.2, float(np.mean(ends)), align="left")
    arrow = Note("", slot + 1.0, float(np.mean(ends)), between=ends)
    highest = max(float(np.nanmax(one.band)) for one in series if one.band is not None)
    objects = "; ".join(initial(one) for one in outcome.scenario.objects)
    return Panel(
        slot_axis(10),
        Axis("Sum rate", "bit/s/Hz", limits=(-0.03 * highest, 1.05 * highest)),
        tuple(series),
        f"{words}: {objects}",
        guides=omni_slots("omni or pilot slot"),
        notes=(arrow, note),
    )


FIGURE = Figure(
    "t1",
    "rate per slot, proposed against pilot scheme, two objects and one",
    (multi(), single(), headline("paper-multi"), headline("paper-single")),
    data,
    place=2,
)
