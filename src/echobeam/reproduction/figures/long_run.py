"""500 ms of service: dips at the omni slots, and throughput per frame (the paper's t6)."""

from __future__ import annotations

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import long
from echobeam.reproduction.tables import Table
from echobeam.simulation.summary import mean_interval
from echobeam.values import Array

SCHEMES = {"temporal": "proposed (temporal)", "pilot": "pilot"}
GAP = style.Look(style.GREEN, "^", (0, (1.0, 1.2)))


def throughput(outcome: Outcome, scheme: str) -> Array:
    """Return ``(trial, frame)`` bit/s/Hz: mean sum rate over each frame's slots."""
    rate = outcome.sum_rate(scheme)
    frames = rate.reshape(len(rate), -1, outcome.scenario.frame.slots_per_frame)
    return np.asarray(frames.mean(axis=-1))


def marked(slots: int, per_frame: int) -> list[int]:
    """Return which slots have markers: the first of every frame and every third after it."""
    return [slot for slot in range(slots) if slot % per_frame % 3 == 0]


def tabulate(outcome: Outcome) -> Table:
    """Return mean rates per slot and per frame with their intervals."""
    rows: list[tuple[str | int | float, ...]] = []
    for scheme in SCHEMES:
        for kind, values in (
            ("slot", outcome.sum_rate(scheme)),
            ("frame", throughput(outcome, scheme)),
        ):
            mean, interval = mean_interval(values)
            rows += [
                (scheme, kind, i + 1, float(mean[i]), *map(float, interval[i]))
                for i in range(len(mean))
            ]
    columns = ("scheme", "per", "number", "sum rate (bit/s/Hz)", "95 % low", "95 % high")
    return Table(columns, rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw the rate over time, and beside it the throughput of each frame and its gap."""
    outcome = results[long().name]
    frame = outcome.scenario.frame
    figure = style.new_figure(style.PAGE, 3.1)
    left, right = figure.subplots(1, 2, width_ratios=[2, 1])
    time = 1e3 * frame.slot * np.arange(outcome.scenario.n_slots)
    handles = []
    for scheme, label in SCHEMES.items():
        mean, band = mean_interval(draw_as.RATE_SCALE * outcome.sum_rate(scheme))
        look = style.SCHEME_LOOKS[scheme]
        line = draw_as.curve(left, time, mean, band, look, label)
        line.set_markevery(marked(outcome.scenario.n_slots, frame.slots_per_frame))
        handles.append(line)
    width = 1e3 * frame.slot
    for first in time[:: frame.slots_per_frame]:
        left.axvspan(first - width / 2, first + width / 2, color=style.SHADE, linewidth=0, zorder=0)
    left.set(xlim=(-width, time[-1] + width), xlabel="Time (ms)")
    left.set_ylabel(f"Sum rate ({draw_as.RATE_UNIT})")
    samples = {scheme: draw_as.RATE_SCALE * throughput(outcome, scheme) for scheme in SCHEMES}
    gap = samples["temporal"] - samples["pilot"]
    numbers = range(1, frame.frames + 1)
    for scheme, values in samples.items():
        draw_as.curve(right, numbers, *mean_interval(values), style.SCHEME_LOOKS[scheme], scheme)
    handles.append(draw_as.curve(right, numbers, *mean_interval(gap), GAP, "gap between the two"))
    right.set(xticks=numbers, xlabel="Frame (100 ms each)", ylim=(0, None))
    right.set_ylabel(f"Throughput of a frame\n({draw_as.RATE_UNIT})")
    draw_as.titled(
        figure,
        "Long-term service of two objects",
        f"{draw_as.flight(outcome.scenario)}; {draw_as.objects(outcome.scenario)}",
        f"means of {outcome.point.trials} trials with 95 % bands; shaded: omni or pilot slots",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(outcome))


FIGURE = Figure(
    "t6", "500 ms of service: dips at the omni slots, throughput per frame", (long(),), draw
)
