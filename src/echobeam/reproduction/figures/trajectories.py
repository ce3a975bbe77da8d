"""True and predicted trajectories of two objects under a UAV (the paper's t5)."""

from __future__ import annotations

import numpy as np

from echobeam.physics.geometry import offset
from echobeam.plots.looks import BLACK, Look, object_look
from echobeam.plots.record import Axis, FigureData, Note, Panel, Series, quantile_series
from echobeam.plots.scene import FORECAST, Cone, cone_series, make_cones
from echobeam.plots.trajectories import path_series
from echobeam.reproduction.captions import setting
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import trajectory
from echobeam.schemes.configure import system_for
from echobeam.values import Array

FORECAST_SLOTS = (10, 40, 70)
"""Slots from which a forecast is drawn, until the next one or the end."""

PREDICTED = Look("0.25", "x", "")


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


def data(results: Results) -> FigureData:
    """Return the scene, each object's way along the road, and the prediction's error."""
    outcome = results[trajectory().name]
    time = outcome.scenario.frame.slot * np.arange(outcome.scenario.n_slots, dtype=float)
    off = errors(outcome)[:, 1:]
    error = tuple(
        quantile_series(f"object {k + 1}", time[1:], off[..., k], object_look(k))
        for k in range(off.shape[-1])
    )
    count = off.shape[-1]
    return FigureData(
        "t5",
        "Trajectories and their prediction",
        (
            _scene(outcome),
            *(_road(outcome, k, time) for k in range(count)),
            Panel(Axis("Time", "s"), Axis("Position error", "m", log=True), error,
                  "error of the prediction"),
        ),
        setting(outcome.scenario),
        f"above and middle: one trial; error: {outcome.point.trials} trials, medians with 5–95 % "
        "bands; arrows: direction of movement; cones: forecasts with ±3σ",
        layout=((0,) * 2, tuple(range(1, count + 1)), (count + 1,) * 2),
        heights=(1.35, 1.0, 0.9),
        size=(7.16, 6.0),
        key=(("predicted one slot ahead", PREDICTED), ("forecast, with ±3σ", FORECAST)),
    )  # fmt: skip


def _scene(outcome: Outcome) -> Panel:
    uav, true = flight(outcome), positions(outcome, "truth")[0]
    road = Series("road", np.array([-75.0, 105.0]), np.zeros(2), look=Look("0.6"), kind="line",
                  width=1.5, legend=False)  # fmt: skip
    series, notes = [road, path_series("UAV", uav, Look(BLACK))], []
    for k in range(true.shape[1]):
        look, middle = object_look(k), true[len(true) // 2, k]
        series.append(path_series(f"object {k + 1}, true", true[:, k], look))
        notes.append(
            Note(f"object {k + 1}", float(middle[0]), float(middle[1]), look.colour,
                 offset=(0.0, -11.0), bold=True)
        )  # fmt: skip
    notes.append(Note("UAV", float(uav[-1, 0]), float(uav[-1, 1]), offset=(18.0, 0.0), bold=True))
    return Panel(
        Axis("Position along the road", "m", limits=(-75.0, 105.0)),
        Axis("Height", "m", limits=(-18.0, 92.0)),
        tuple(series), "the scene to scale", notes=tuple(notes), equal=True,
    )  # fmt: skip


def _road(outcome: Outcome, k: int, time: Array) -> Panel:
    true, predicted = positions(outcome, "truth")[0], positions(outcome, "predicted")[0]
    look = object_look(k)
    series = [
        Series("true", time, true[:, k, 0], look=look.plain("-"), kind="line", width=2.0,
               legend=False),
        Series("predicted one slot ahead", time[::4], predicted[::4, k, 0], look=PREDICTED,
               kind="points", legend=False),
    ]  # fmt: skip
    for cone in cones(outcome, k):
        series += cone_series(cone, time, look.colour)
    return Panel(
        Axis("Time", "s"), Axis("Position along the road", "m"), tuple(series), f"object {k + 1}"
    )


FIGURE = Figure(
    "t5",
    "true and predicted trajectories of two objects, with arrows",
    (trajectory(),),
    data,
    place=7,
)
