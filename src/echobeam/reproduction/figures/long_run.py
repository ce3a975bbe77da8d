"""500 ms of service: dips at the omni slots, and throughput per frame (the paper's t6)."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import mean_interval
from echobeam.plots.looks import GREEN, SCHEME_LOOKS, SHADE, Look
from echobeam.plots.record import Axis, FigureData, Guide, Panel, interval_series
from echobeam.reproduction.captions import setting
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import long, manoeuvre
from echobeam.values import Array

SCHEMES = {"temporal": "proposed (temporal)", "pilot": "pilot", "posterior": "posterior"}
GAP = Look(GREEN, "^", (0, (1.0, 1.2)))


def throughput(outcome: Outcome, scheme: str) -> Array:
    """Return ``(trial, frame)`` bit/s/Hz: mean sum rate over each frame's slots."""
    rate = outcome.sum_rate(scheme)
    frames = rate.reshape(len(rate), -1, outcome.scenario.frame.slots_per_frame)
    return np.asarray(frames.mean(axis=-1))


def data(results: Results) -> FigureData:
    """Return the rate over time, and beside it the throughput of each frame and its gap."""
    outcome = results[long().name]
    frame = outcome.scenario.frame
    time = 1e3 * frame.slot * np.arange(outcome.scenario.n_slots)
    rates = [
        interval_series(label, time, mean_interval(outcome.sum_rate(scheme)), SCHEME_LOOKS[scheme])
        for scheme, label in SCHEMES.items()
    ]
    half = 0.5e3 * frame.slot
    shaded = tuple(
        Guide("x", float(first) - half, float(first) + half, Look(SHADE), "omni or pilot slot")
        for first in time[:: frame.slots_per_frame]
    )
    frames = {scheme: throughput(outcome, scheme) for scheme in SCHEMES}
    numbers = np.arange(1, frame.frames + 1)
    bars = [
        interval_series(label, numbers, mean_interval(frames[scheme]), SCHEME_LOOKS[scheme])
        for scheme, label in SCHEMES.items()
    ]
    gap = mean_interval(frames["temporal"] - frames["pilot"])
    bars.append(interval_series("gap between the two", numbers, gap, GAP))
    left = Axis("Time", "ms", limits=(-2 * half, float(time[-1]) + 2 * half))
    right = Axis("Frame", "100 ms each", ticks=tuple(map(float, numbers)))
    return FigureData(
        "t6",
        "Long-term service of two objects",
        (
            Panel(left, Axis("Sum rate", "bit/s/Hz"), tuple(rates), guides=shaded),
            Panel(
                right, Axis("Throughput of a frame", "bit/s/Hz", limits=(0.0, None)), tuple(bars)
            ),
        ),
        setting(outcome.scenario),
        f"means of {outcome.point.trials} trials",
        widths=(2.0, 1.0),
        size=(7.16, 2.7),
        band="95 % interval",
    )


FIGURE = Figure(
    "t6",
    "500 ms of service: dips at the omni slots, throughput per frame",
    (long(), manoeuvre()),
    data,
    place=8,
)
