"""Beam patterns of the first directional slot over the number of antennas (test2-2)."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import mean_interval
from echobeam.plots.looks import DOTTED, Look, object_look, parameter_look
from echobeam.plots.patterns import decibels
from echobeam.plots.record import Axis, FigureData, Guide, Note, Panel, Series, quantile_series
from echobeam.reproduction.captions import ANTENNAS, setting
from echobeam.reproduction.patterns import ANGLE, FLOOR, GRID, gain_at_truth, gains
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import ANTENNAS_FOR_TWO, multi
from echobeam.values import Array

SLOT, LAST = 2, 10


def total(results: Results, n: int) -> Array:
    """Return ``(trial, angle)``: the total power radiated by all beams."""
    return np.asarray(gains(results[multi(n).name], SLOT).sum(axis=1))


def data(results: Results) -> FigureData:
    """Return each array's total pattern, their medians together, and each object's gain."""
    outcome = results[multi().name]
    truth = np.degrees(outcome.kept["truth"][0, SLOT - 1, :, 0])
    guides = tuple(
        Guide("x", float(theta), look=Look(object_look(k).colour), name=f"object {k + 1}")
        for k, theta in enumerate(truth)
    )
    patterns = {
        n: quantile_series(ANTENNAS.format(n), np.degrees(GRID), decibels(total(results, n), FLOOR),
                           parameter_look(number).plain())
        for number, n in enumerate(ANTENNAS_FOR_TWO)
    }  # fmt: skip
    y = Axis("Gain × power, both beams", "dB", limits=(-25.0, 17.0))
    above = [
        Panel(ANGLE, y, (_line(series),), ANTENNAS.format(n), guides=guides)
        for n, series in patterns.items()
    ]
    medians = tuple(
        _line(Series(one.name, one.x, one.y, look=one.look)) for one in patterns.values()
    )
    return FigureData(
        "test2-2",
        f"Beam patterns in slot {SLOT} over the number of antennas",
        (*above, Panel(ANGLE, y, medians, "medians", guides=guides), _gains(results)),
        setting(outcome.scenario, antennas=False),
        f"{outcome.point.trials} trials; patterns: medians with 5–95 % bands; gains: means with "
        "95 % intervals, per beam power",
        layout=((0, 1, 2), (3, 3, 4)),
        size=(7.16, 4.2),
    )


def _line(series: Series) -> Series:
    return Series(series.name, series.x, series.y, series.band, series.look, kind="line", width=1.1)


def _gains(results: Results) -> Panel:
    """Return the array gain of each object's own beam."""
    numbers, series, notes = np.array(ANTENNAS_FOR_TWO), [], []
    for k in range(2):
        for slot in (SLOT, LAST):
            samples = [gain_at_truth(results[multi(n).name], slot)[:, k] for n in ANTENNAS_FOR_TWO]
            mean, interval = mean_interval(np.stack(samples, axis=1))
            series.append(
                Series(f"object {k + 1}, slot {slot}", numbers, mean, interval, object_look(k),
                       kind="points", hollow=slot == SLOT, legend=False)
            )  # fmt: skip
            notes.append(
                Note(f"slot {slot}", float(numbers[-1]), float(mean[-1]), object_look(k).colour,
                     offset=(5.0, 0.0), align="left")
            )  # fmt: skip
    series.append(
        Series("matched beam, $N_t$", numbers, numbers.astype(float), look=Look("0.5", "", DOTTED),
               kind="line")
    )  # fmt: skip
    return Panel(
        Axis("Antennas $N_t$ = $N_r$", ticks=tuple(map(float, numbers)), limits=(28.0, 58.0)),
        Axis("Array gain at the object", limits=(0.0, 1.05 * max(ANTENNAS_FOR_TWO))),
        tuple(series),
        "gain of an object's own beam",
        notes=tuple(notes),
    )


FIGURE = Figure(
    "test2-2",
    "beam patterns of the first directional slot over the number of antennas",
    tuple(multi(n) for n in ANTENNAS_FOR_TWO),
    data,
    place=4,
)
