"""Beam patterns over the slots of a frame, omni slot first (the paper's test2-1)."""

from __future__ import annotations

import numpy as np

from echobeam.plots.looks import Look, object_look
from echobeam.plots.patterns import decibels
from echobeam.plots.record import Axis, FigureData, Guide, Note, Panel, Series, quantile_series
from echobeam.reproduction.captions import setting
from echobeam.reproduction.patterns import ANGLE, FLOOR, GRID, gains, half_power_angles, powers
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import multi

SLOTS = (2, 3, 4, 6, 10)
GAIN = Axis("Gain × power", "dB", limits=(-32.0, 26.0))


def data(results: Results) -> FigureData:
    """Return a panel per slot: the median pattern of each object's beam with its 5-95 % band."""
    outcome = results[multi().name]
    return FigureData(
        "test2-1",
        "Beam patterns over the slots of a frame",
        (_omni(outcome), *(_panel(outcome, slot) for slot in SLOTS)),
        setting(outcome.scenario),
        f"medians over {outcome.point.trials} trials with 5–95 % bands; vertical lines: true "
        "angles; −3 dB: angles above half power, a lobe with its mirror image at 180°−θ together",
        layout=((0, 1, 2), (3, 4, 5)),
        size=(7.16, 3.9),
        share="xy",
        key=tuple((f"beam for object {k + 1}", object_look(k).plain()) for k in range(2)),
    )


def _omni(outcome: Outcome) -> Panel:
    level = np.full(2, float(decibels(outcome.scenario.radio.power)))
    series = Series("omni", np.array([0.0, 180.0]), level, look=Look("black"), kind="line",
                    legend=False)  # fmt: skip
    return Panel(ANGLE, GAIN, (series,), "slot 1: omni", _truth(outcome, 1))


def _panel(outcome: Outcome, slot: int) -> Panel:
    gain, power = gains(outcome, slot), powers(outcome, slot)
    width = half_power_angles(gain)
    series, notes = [], []
    for k in range(gain.shape[1]):
        look = object_look(k)
        one = quantile_series(f"object {k + 1}", np.degrees(GRID), decibels(gain[:, k], FLOOR))
        series.append(
            Series(one.name, one.x, one.y, one.band, look.plain(), kind="line", legend=False)
        )
        text = f"−3 dB: {width[:, k].mean():.0f}°; power {100 * power[:, k].mean():.0f} %"
        notes.append(Note(text, 0.03, 0.93 - 0.1 * k, look.colour, inside=True, align="left"))
    return Panel(ANGLE, GAIN, tuple(series), f"slot {slot}", _truth(outcome, slot), tuple(notes))


def _truth(outcome: Outcome, slot: int) -> tuple[Guide, ...]:
    angles = np.degrees(outcome.kept["truth"][0, slot - 1, :, 0])
    # the texts above stay free of the lines
    return tuple(
        Guide("x", float(theta), look=Look(object_look(k).colour), alpha=0.7, reach=0.78)
        for k, theta in enumerate(angles)
    )


FIGURE = Figure(
    "test2-1", "beam patterns over the slots of a frame, two objects", (multi(),), data, place=3
)
