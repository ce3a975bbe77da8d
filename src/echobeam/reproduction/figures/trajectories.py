"""Trajectories, true and predicted, of two objects under a UAV (the paper's t5)."""

from __future__ import annotations

import numpy as np

from echobeam.physics.geometry import offset
from echobeam.plots.looks import object_look
from echobeam.plots.record import Axis, FigureData, Panel, quantile_series
from echobeam.plots.scene import FORECAST, Scene
from echobeam.plots.trajectories import PREDICTED, road_panel, scene_panel
from echobeam.reproduction.captions import setting
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import trajectory
from echobeam.schemes.configure import system_for
from echobeam.simulation.forecast import Cone, make_cones
from echobeam.values import Array

FORECAST_SLOTS = (10, 40, 70)
"""Slots from which a forecast is drawn, until the next one or the end."""


def flight(outcome: Outcome) -> Array:
    """Return ``(slot, 2)`` m: the UAV's position along the road and its height."""
    return np.asarray(outcome.kept["uav_position"][:, [0, 2]])


def positions(outcome: Outcome, variable: str) -> Array:
    """Return ``(trial, slot, object, 2)`` m: true, predicted or estimated positions."""
    state = outcome.kept["truth"] if variable == "truth" else outcome.of(variable, "temporal")
    return np.asarray(flight(outcome)[:, None] + offset(state))


def errors(outcome: Outcome) -> Array:
    """Return ``(trial, slot, object)`` m: distance of the predicted from the true position."""
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
    """Return the scene, each object's path along the road, and the prediction's error."""
    outcome = results[trajectory().name]
    scene, off = _scene(outcome), errors(outcome)[:, 1:]
    time = outcome.scenario.frame.slot * np.arange(outcome.scenario.n_slots, dtype=float)
    axis = Axis("Time", "s")
    roads = [road_panel(axis, time, scene, stay, cones(outcome, stay[0])) for stay in scene.stays]
    error = tuple(
        quantile_series(f"object {k + 1}", time[1:], off[..., k], object_look(k))
        for k, _ in scene.stays
    )
    y = Axis("Position error", "m", log=True)
    return FigureData(
        "t5",
        "Trajectories and their prediction",
        (scene_panel(scene), *roads, Panel(axis, y, error, "error of the prediction")),
        setting(outcome.scenario),
        f"above and middle: one trial; error: {outcome.point.trials} trials, medians with 5–95 % "
        "bands; arrows: direction of movement; cones: forecasts with ±3σ",
        layout=((0, 0), (1, 2), (3, 3)),
        heights=(1.35, 1.0, 0.9),
        size=(7.16, 6.0),
        key=(("predicted one slot ahead", PREDICTED), ("forecast, with ±3σ", FORECAST)),
    )


def _scene(outcome: Outcome) -> Scene:
    """Return the positions in the first trial; regions of estimates are not drawn here."""
    true, predicted, estimated = (
        positions(outcome, name)[0] for name in ("truth", "predicted", "estimated")
    )
    stays = [(k, slice(0, len(true))) for k in range(true.shape[1])]
    no_region = np.full((*true.shape, 2), np.nan)
    return Scene(flight(outcome), true, predicted, estimated, no_region, stays)


FIGURE = Figure(
    "t5",
    "true and predicted trajectories of two objects, with arrows",
    (trajectory(),),
    data,
    place=7,
)
