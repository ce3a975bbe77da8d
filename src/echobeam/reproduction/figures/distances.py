"""Distance error over the slots for several arrays (the paper's t4)."""

from __future__ import annotations

from echobeam.estimation.intervals import rms_interval
from echobeam.plots.looks import parameter_look
from echobeam.plots.record import Axis, FigureData, Panel, interval_series
from echobeam.reproduction.captions import ANTENNAS, flight, initial, omni_slots, slot_axis
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import ANTENNAS_FOR_TWO, multi
from echobeam.values import Array


def rmse(results: Results, n: int, k: int) -> tuple[Array, Array]:
    """Return an object's distance error per slot, m, and its 95 % band."""
    return rms_interval(results[multi(n).name].error("temporal", "distance")[:, :, k])


def data(results: Results) -> FigureData:
    """Return a panel per object with a curve per array."""
    outcome = results[multi().name]
    panels = tuple(
        Panel(
            slot_axis(10),
            Axis("Distance RMSE", "m", log=True),
            tuple(
                interval_series(
                    ANTENNAS.format(n), range(1, 11), rmse(results, n, k), parameter_look(number)
                )
                for number, n in enumerate(ANTENNAS_FOR_TWO)
            ),
            f"object {k + 1}: {initial(one)}",
            guides=omni_slots(),
        )
        for k, one in enumerate(outcome.scenario.objects)
    )
    return FigureData(
        "t4",
        "Distance tracking of the proposed scheme over the number of antennas",
        panels,
        flight(outcome.scenario, antennas=False),
        f"RMSE over {outcome.point.trials} trials",
        size=(7.16, 2.6),
        share="y",
        band="95 % interval",
    )


FIGURE = Figure(
    "t4",
    "distance error over the slots for several arrays, two objects",
    tuple(multi(n) for n in ANTENNAS_FOR_TWO),
    data,
    place=6,
)
