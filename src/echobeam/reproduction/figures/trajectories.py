"""True and predicted trajectories of two objects under a UAV (the paper's t5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D

from echobeam.physics.geometry import offset
from echobeam.plots import style
from echobeam.plots.cones import WAY, Cone, draw_cone, make_cones
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import trajectory
from echobeam.reproduction.tables import Table
from echobeam.schemes.configure import system_for
from echobeam.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUANTILES = (0.05, 0.5, 0.95)

FORECAST_SLOTS = (10, 40, 70)
"""Slots from which a forecast is drawn, until the next one or the end."""


def flight(outcome: Outcome) -> Array:
    """Return ``(slot, 2)`` m: the UAV's position along the road and its height."""
    return np.asarray(outcome.kept["uav_position"][:, [0, 2]])


def positions(outcome: Outcome, variable: str) -> Array:
    """Return ``(trial, slot, object, 2)`` m: where the objects are, or are believed to be."""
    state = outcome.kept["truth"] if variable == "truth" else outcome.of(variable, "temporal")
    return np.asarray(flight(outcome)[:, None] + offset(state))


def errors(outcome: Outcome) -> Array:
    """Return ``(trial, slot, object)`` m: how far the predicted position is from the true one."""
    off = positions(outcome, "predicted") - positions(outcome, "truth")
    return np.asarray(np.hypot(off[..., 0], off[..., 1]))


def cones(outcome: Outcome, k: int) -> list[Cone]:
    """Return the forecasts of one object in the first trial."""
    mean = outcome.of("estimated", "temporal")[0, :, k]
    cov = outcome.of("estimated_cov", "temporal")[0, :, k]
    starts = [slot - 1 for slot in FORECAST_SLOTS]
    uav = outcome.kept["uav_position"], outcome.kept["uav_velocity"]
    return make_cones(mean, cov, starts, len(mean), uav, system_for(outcome.scenario, "temporal"))


def tabulate(outcome: Outcome) -> Table:
    """Return true and predicted positions of the first trial, and all trials' error quantiles."""
    true, predicted = positions(outcome, "truth")[0], positions(outcome, "predicted")[0]
    quantiles = np.quantile(errors(outcome), QUANTILES, axis=0)
    time = outcome.scenario.frame.slot * np.arange(outcome.scenario.n_slots)
    rows = [
        (n + 1, float(time[n]), k + 1, *map(float, (*true[n, k], *predicted[n, k])),
         *map(float, quantiles[:, n, k]))
        for n in range(len(time))
        for k in range(true.shape[1])
    ]  # fmt: skip
    state = ("true x", "true height", "predicted x", "predicted height")
    error = ("error 5 %", "error median", "error 95 %")
    columns = ("slot", "time (s)", "object", *(f"{name} (m)" for name in (*state, *error)))
    return Table(columns, rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw the scene, the objects' way along the road, and the prediction's error."""
    outcome = results[trajectory().name]
    figure = style.new_figure(style.PAGE, 4.0)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.15, 1])
    _draw_scene(figure.add_subplot(grid[:, 0]), outcome)
    upper = figure.add_subplot(grid[0, 1])
    handles = _draw_road(upper, outcome)
    _draw_errors(figure.add_subplot(grid[1, 1], sharex=upper), outcome)
    draw_as.titled(
        figure,
        "Trajectories and their prediction",
        f"{draw_as.flight(outcome.scenario)}; {draw_as.objects(outcome.scenario)}",
        f"left and above: one trial; below: {outcome.point.trials} trials, medians with 5–95 % "
        "bands; arrows: direction of movement; cones: ±3σ",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(outcome))


def _draw_scene(axes: Axes, outcome: Outcome) -> None:
    axes.axhline(0.0, color="0.6", linewidth=1.5, zorder=1)
    uav, true = flight(outcome), positions(outcome, "truth")[0]
    predicted = positions(outcome, "predicted")[0]
    _path(axes, uav, "black", "UAV", (14, 0))
    for k in range(true.shape[1]):
        colour = style.object_look(k).colour
        sight = np.stack([uav[-1], true[-1, k]])
        axes.plot(*sight.T, color="0.7", linewidth=0.6, linestyle=":", zorder=1)
        _path(axes, true[:, k], colour, f"object {k + 1}", (0, -12))
        axes.plot(*predicted[::4, k].T, color="0.25", marker="x", linestyle="", zorder=4)
    axes.set(
        xlabel="Position along the road (m)", ylabel="Height (m)", xlim=(-62, 98), ylim=(-22, 92)
    )
    axes.set_aspect("equal")


def _path(axes: Axes, path: Array, colour: str, name: str, away: tuple[float, float]) -> None:
    axes.plot(*path.T, color=colour, linewidth=2.0, zorder=3)
    arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.5, "mutation_scale": 11}
    step = path[-1] - path[-2]
    tip = path[-1] + 6.0 * step / np.hypot(*step)
    axes.annotate("", tuple(tip), tuple(path[-1]), arrowprops=arrow, zorder=5)
    middle = path[len(path) // 2]
    axes.annotate(
        name, tuple(middle), away, textcoords="offset points", color=colour, ha="center",
        va="center", fontweight="bold",
    )  # fmt: skip


def _draw_road(axes: Axes, outcome: Outcome) -> list[Line2D]:
    true, predicted = positions(outcome, "truth")[0], positions(outcome, "predicted")[0]
    time = outcome.scenario.frame.slot * np.arange(len(true))
    handles: list[Line2D] = []
    for k in range(true.shape[1]):
        colour = style.object_look(k).colour
        handles += axes.plot(time, true[:, k, 0], color=colour, label=f"object {k + 1}, true")
        marks = axes.plot(
            time[::4], predicted[::4, k, 0], color="0.25", marker="x", linestyle="",
            label="predicted one slot ahead",
        )  # fmt: skip
        for cone in cones(outcome, k):
            draw_cone(axes, cone, time, colour)
    axes.set(ylabel="Position along\nthe road (m)")
    ahead = Line2D([], [], label="forecast, with ±3σ", **WAY)
    return [*handles, *marks, ahead]


def _draw_errors(axes: Axes, outcome: Outcome) -> None:
    low, centre, high = np.quantile(errors(outcome)[:, 1:], QUANTILES, axis=0)
    time = outcome.scenario.frame.slot * np.arange(1, len(centre) + 1)
    for k in range(centre.shape[1]):
        look, band = style.object_look(k), np.stack([low[:, k], high[:, k]], axis=-1)
        draw_as.curve(axes, time, centre[:, k], band, look, f"object {k + 1}")
    style.scale_log(axes)
    axes.set(xlabel="Time (s)", ylabel="Position error (m)")


FIGURE = Figure(
    "t5", "true and predicted trajectories of two objects, with arrows", (trajectory(),), draw
)
