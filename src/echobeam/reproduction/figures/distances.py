"""Distance error over the slots for several arrays (the paper's t4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.estimates import rms_with_band
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import ANTENNAS_FOR_TWO, multi
from echobeam.reproduction.tables import Table
from echobeam.values import Array

if TYPE_CHECKING:
    from matplotlib.lines import Line2D


def rmse(results: Results, n: int, k: int) -> tuple[Array, Array]:
    """Return an object's distance error per slot, m, and its 95 % band."""
    return rms_with_band(results[multi(n).name].error("temporal", "distance")[:, :, k])


def tabulate(results: Results) -> Table:
    """Return the errors of every array, object and slot."""
    rows: list[tuple[int | float, ...]] = []
    for n in ANTENNAS_FOR_TWO:
        for k in range(2):
            error, band = rmse(results, n, k)
            rows += [(n, k + 1, i + 1, float(error[i]), *map(float, band[i])) for i in range(10)]
    columns = ("antennas", "object", "slot", "distance RMSE (m)", "95 % low (m)", "95 % high (m)")
    return Table(columns, rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw a panel per object with a curve per array."""
    figure = style.new_figure(style.PAGE, 3.0)
    outcome = results[multi().name]
    handles: list[Line2D] = []
    for k, axes in enumerate(figure.subplots(1, 2, sharey=True)):
        handles = []
        for n, look in zip(ANTENNAS_FOR_TWO, draw_as.LOOKS, strict=False):
            error, band = rmse(results, n, k)
            slots = range(1, len(error) + 1)
            label = f"$N_t$ = $N_r$ = {n}"
            handles.append(draw_as.curve(axes, slots, error, band, look, label))
        style.scale_log(axes)
        draw_as.slot_axis(axes, 10)
        one = outcome.scenario.model_copy(update={"objects": (outcome.scenario.objects[k],)})
        axes.set_title(f"object {k + 1}: {draw_as.objects(one)}")
        axes.set_ylabel("Distance RMSE (m)" if k == 0 else "")
    draw_as.titled(
        figure,
        "Distance tracking of the proposed scheme over the number of antennas",
        draw_as.flight(outcome.scenario, antennas=False),
        f"RMSE over {outcome.point.trials} trials with 95 % bands; shaded: omni slot",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(results))


FIGURE = Figure(
    "t4",
    "distance error over the slots for several arrays, two objects",
    tuple(multi(n) for n in ANTENNAS_FOR_TWO),
    draw,
)
