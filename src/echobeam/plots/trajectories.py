"""Paths of the objects, true and tracked, and the forecasts of the tracker."""

from __future__ import annotations

import math

import numpy as np

from echobeam.plots.looks import BLACK, DOTTED, MAX_OBJECTS, RING, Look, object_look
from echobeam.plots.record import Axis, FigureData, Note, Panel, Series
from echobeam.plots.scene import FORECAST, Scene, chosen_slots, cone_series, framed, read_scene
from echobeam.plots.source import Source
from echobeam.schemes.configure import system_for
from echobeam.simulation.forecast import Cone, make_cones
from echobeam.values import Array

_CLOSE_UPS = 4
_ELLIPSES = 3

# Half-axes of the ellipse that holds 95 % of a Gaussian in the plane: sqrt(-2 ln 0.05) sigmas.
_ELLIPSE_SIGMAS = float(np.sqrt(-2.0 * np.log(0.05)))
_FLATTEST, _NARROWEST = 3.0, 0.7
"""Largest and smallest width of the scene over its height: a flatter one is not to scale, a
narrower one has room on both sides for its ticks."""

_BLACK = next(k for k in range(MAX_OBJECTS) if object_look(k).colour == BLACK)
"""Object whose colour is that of the estimates, which is left out over the time."""

PREDICTED = Look("0.25", "x", "")
_ESTIMATED = Look("0.25", "o", "-")


def trajectories(source: Source) -> FigureData:
    """Return the paths of UAV and objects in one trial, and the objects' tracks.

    A few objects have the scene to scale; for each object the true path, predicted and estimated
    positions, and 95 % ellipses of the estimate's stated covariance; and its position along the
    road with forecasts from a few slots as cones: the dashed path predicted without further
    measurements, with three standard deviations on either side. Objects that enter and leave are
    drawn along the road over time, with the error of their prediction below. On the ground the
    paths are those seen from above, without forecasts.
    """
    scene = read_scene(source)
    if source.scenario.trace is not None or len(scene.stays) > _CLOSE_UPS:
        return _over_time(source, scene)
    close = scene.stays[:_CLOSE_UPS]
    panels = [scene_panel(scene)]
    panels += [_close_up(scene, k, stay) for k, stay in close]
    if not scene.on_ground:
        panels += [_road_panel(source, scene, k, stay) for k, stay in close]
    return _figure(source, panels, len(close), forecasts=not scene.on_ground)


def _figure(source: Source, panels: list[Panel], close: int, *, forecasts: bool) -> FigureData:
    scheme = source.one_scheme()
    layout: tuple[tuple[int, ...], ...] = ((0,),)
    if close:
        # the scene beside the stacked close-ups, and the road below
        columns = max(close, 2)
        upper = [0] * columns
        lower = [1 + i % close for i in range(close)] + [-1] * (columns - close)
        road = [1 + close + i for i in range(close)] + [-1] * (columns - close)
        layout = (tuple(upper), tuple(lower), tuple(road))[: 2 + forecasts]
    key = [
        ("true path", Look("0.25")), ("estimated", _ESTIMATED), ("predicted", PREDICTED),
        ("95 % region (if within axes)", Look("0.3", RING, "")),
    ]  # fmt: skip
    if forecasts:
        key.append(("forecast, with ±3σ", FORECAST))
    return FigureData(
        "trajectories", source.title, tuple(panels), source.setting(scheme, one_trial=True),
        layout=layout, heights=(1.5, 1.1, 1.0)[: 2 + forecasts] if close else (),
        size=(7.16, 6.0 if forecasts else 4.6) if close else (3.5, 3.0),
        key=tuple(key) if close else (),
    )  # fmt: skip


def _over_time(source: Source, scene: Scene) -> FigureData:
    """Return positions along the road over time, and the prediction's error below."""
    time = source.result["time"].values[source.stretch]
    panels = [_way_panel(scene, time, axis) for axis in range(1 + scene.on_ground)]
    errors = []
    for number, (k, stay) in enumerate(scene.stays):
        off = np.hypot(*(scene.predicted[stay, k] - scene.true[stay, k]).T)
        errors.append(
            Series(f"stay {number + 1}, predicted", time[stay], off, look=_stay_look(number),
                   kind="line", width=0.8, legend=False)
        )  # fmt: skip
    rows = len(panels)
    return FigureData(
        "trajectories", source.title,
        (
            *panels,
            Panel(_time_axis(time), Axis("Error of the prediction", "m", log=True), tuple(errors),
                  empty="nothing was predicted"),
        ),
        source.setting(source.one_scheme(), one_trial=True),
        layout=tuple((row,) for row in range(rows + 1)), heights=(*(2.0,) * rows, 1.0),
        size=(7.16, 3.4 + 1.2 * rows), share="x",
        key=(("objects (a colour for each stay in service)", object_look(0).plain("-")),
             ("estimated", Look("black"))),
    )  # fmt: skip


def _way_panel(scene: Scene, time: Array, axis: int) -> Panel:
    """Return one coordinate of the UAV and of all objects over time."""
    ways = [Series("UAV", time, scene.uav[:, axis], look=Look(BLACK, "", DOTTED), kind="line")]
    for number, (k, stay) in enumerate(scene.stays):
        name = f"stay {number + 1}"
        ways.append(
            Series(f"{name}, true", time[stay], scene.true[stay, k, axis], look=_stay_look(number),
                   kind="line", width=2.0, legend=False)
        )  # fmt: skip
        ways.append(
            Series(f"{name}, estimated", time[stay], scene.estimated[stay, k, axis],
                   look=Look("black"), kind="line", width=0.6, legend=False)
        )  # fmt: skip
    return Panel(_time_axis(time), Axis(scene.names[axis], "m"), tuple(ways),
                 empty="no objects in the scene")  # fmt: skip


def _stay_look(number: int) -> Look:
    return object_look(number + (number % MAX_OBJECTS >= _BLACK)).plain("-")


def _time_axis(time: Array) -> Axis:
    return Axis("Time", "s", limits=(float(time[0]), float(time[-1])))


def path_series(name: str, path: Array, look: Look) -> Series:
    """Return a path ``(n, 2)`` m that ends in an arrow along the motion."""
    return Series(name, path[:, 0], path[:, 1], look=look.plain("-"), kind="line", width=1.6,
                  legend=False, arrow=True)  # fmt: skip


def scene_panel(scene: Scene) -> Panel:
    """Return all paths, to scale where the scene is not too flat."""
    series = [path_series("UAV", scene.uav, Look(BLACK))]
    series += [
        path_series(f"object {k + 1}", scene.true[stay, k], object_look(k))
        for k, stay in scene.stays
    ]
    notes = [Note("UAV", *_end(scene.uav[:1]), offset=(0, 10), bold=True)]
    notes += [
        Note(str(k + 1), *_end(scene.true[stay, k]), object_look(k).colour, offset=(0, -12),
             bold=True)
        for k, stay in scene.stays
    ]  # fmt: skip
    points = np.concatenate([scene.uav, *(scene.true[stay, k] for k, stay in scene.stays)])
    if scene.on_ground:
        return Panel(*_axes_around(points, 0.15, 20.0), tuple(series), notes=tuple(notes),
                     equal=True)  # fmt: skip
    low, high = _widened(points, 30.0)
    width, height = high - low
    room = max(0.0, _NARROWEST * height - width) / 2.0
    low[0], high[0], width = low[0] - room, high[0] + room, width + 2.0 * room
    road = Series("road", np.array([low[0], high[0]]), np.zeros(2), look=Look("0.6"), kind="line",
                  width=2.0, legend=False)  # fmt: skip
    return Panel(
        Axis(scene.names[0], "m", limits=(low[0], high[0])),
        Axis(scene.names[1], "m", limits=(low[1] - 0.08 * height, high[1] + 0.1 * height)),
        (road, *series),
        notes=tuple(notes),
        equal=bool(width < _FLATTEST * height),
    )


def _end(path: Array) -> tuple[float, float]:
    return float(path[-1, 0]), float(path[-1, 1])


def _widened(points: Array, least: float) -> tuple[Array, Array]:
    """Return the corners of the points' bounding box with a margin of at least ``least`` metres."""
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points.min(axis=0), points.max(axis=0)
    extra = np.maximum(0.1 * (high - low), (least - (high - low)) / 2.0)
    return low - extra, high + extra


def _close_up(scene: Scene, k: int, stay: slice) -> Panel:
    """Return one object's path, its predicted and estimated positions and their regions."""
    look = object_look(k)
    path, predicted, estimated = (
        positions[stay, k] for positions in (scene.true, scene.predicted, scene.estimated)
    )
    marked = _marked(len(path))
    ellipses = _ellipses(path, estimated, predicted, scene.spread[stay, k], look)
    series = [
        path_series("true", path, look),
        Series("predicted", predicted[marked, 0], predicted[marked, 1], look=PREDICTED,
               kind="points", legend=False),
        Series("estimated", estimated[marked, 0], estimated[marked, 1], look=_ESTIMATED,
               kind="points", legend=False, hollow=True),
        *ellipses,
    ]  # fmt: skip
    x, y = Axis("Position", "m"), Axis(scene.names[1], "m")
    if scene.on_ground:
        drawn = [np.stack([one.x, one.y], axis=-1).astype(float) for one in series]
        x, y = _axes_around(np.concatenate(drawn), 0.05, 0.5)
    return Panel(
        x, y, tuple(series), f"object {k + 1}", empty="no estimates", equal=scene.on_ground
    )


def _axes_around(points: Array, margin: float, least: float) -> tuple[Axis, Axis]:
    """Return the axes of the ground around some points; arguments as in `framed`."""
    low, high = framed(points, margin, least)
    x, y = (
        Axis(name, "m", limits=(float(low[i]), float(high[i]))) for i, name in enumerate(("x", "y"))
    )
    return x, y


def _marked(points: int) -> list[int]:
    """Return the points with markers: all of the first few, and about twenty in total."""
    step = max(1, math.ceil(points / 20))
    return sorted({*range(min(points, 5)), *range(0, points, step)})


def _ellipses(
    path: Array, estimated: Array, predicted: Array, spreads: Array, look: Look
) -> list[Series]:
    """Return the estimates' 95 % ellipses at a few slots, if they fit into the panel.

    Omitted are ellipses larger than all other marks together, as often in the first slots, unless
    the last one, which is always drawn, is half their size.
    """
    some = np.flatnonzero(
        np.isfinite(spreads).all(axis=(1, 2)) & np.isfinite(estimated).all(axis=1)
    )
    if not some.size:
        return []
    marks = np.concatenate([path, estimated, predicted])
    marks = marks[np.isfinite(marks).all(axis=1)]
    reach = _ELLIPSE_SIGMAS * np.sqrt(np.maximum(np.diagonal(spreads, axis1=1, axis2=2), 0.0))
    room = np.maximum(np.ptp(marks, axis=0), 4.0 * reach[some[-1]])
    some = some[(2.0 * reach[some] <= room).all(axis=-1)]
    some = some[np.unique(np.linspace(0, some.size - 1, _ELLIPSES).astype(int))]
    turn = np.linspace(0.0, 2.0 * np.pi, 49)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    found = []
    for i in some:
        values, vectors = np.linalg.eigh(spreads[i])
        shape = vectors * (_ELLIPSE_SIGMAS * np.sqrt(np.maximum(values, 0.0)))
        x, z = estimated[i][:, None] + shape @ circle
        found.append(
            Series("95 % region", x, z, look=look.plain("-"), kind="line", width=0.7, legend=False)
        )
    return found


def _road_panel(source: Source, scene: Scene, k: int, stay: slice) -> Panel:
    """Return one object's path along the road, with forecasts from a few slots of its stay."""
    one = source.one_trial("estimated", "estimated_cov", "uav_position", "uav_velocity")
    one = one.isel(slot=source.stretch)
    mean = one["estimated"].isel(object=k).transpose("slot", "state").values
    cov = one["estimated_cov"].isel(object=k).transpose("slot", "state", "state_b").values
    position, velocity = (
        one[name].transpose("slot", "axis").values for name in ("uav_position", "uav_velocity")
    )
    system = system_for(source.scenario, source.one_scheme())
    starts = chosen_slots(stay)
    cones = make_cones(mean, cov, starts, stay.stop, (position, velocity), system)
    return road_panel(Axis("Slot"), one["slot"].values, scene, (k, stay), cones)


def road_panel(
    axis: Axis, at: Array, scene: Scene, stay: tuple[int, slice], cones: list[Cone]
) -> Panel:
    """Return true and predicted positions of one object along the road, and its forecasts.

    Parameters
    ----------
    axis, at
        Axis of the slots, and the positions ``(n,)`` of all slots on it.
    scene
        Positions.
    stay
        An object and its slots.
    cones
        Its forecasts.
    """
    k, slots = stay
    look, x = object_look(k), at[slots]
    true, predicted = scene.true[slots, k, 0], scene.predicted[slots, k, 0]
    marked = _marked(x.size)
    series = [
        Series("true", x, true, look=look.plain("-"), kind="line", width=2.2, legend=False),
        Series("predicted", x[marked], predicted[marked], look=PREDICTED, kind="points",
               legend=False),
    ]  # fmt: skip
    series += [part for cone in cones for part in cone_series(cone, axis, at, look.colour)]
    notes = () if cones else (Note("no forecast", 0.5, 0.85, "0.45", inside=True),)
    y = Axis("Position", "m")
    return Panel(axis, y, tuple(series), f"object {k + 1}", notes=notes)
