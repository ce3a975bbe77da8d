"""Paths of the objects, true and tracked, and the forecasts of the tracker."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch
from matplotlib.ticker import MaxNLocator

from echobeam.plots import style
from echobeam.plots.cones import WAY, Cone, chosen_slots, draw_cone, make_cones
from echobeam.plots.ground import Scene, read_scene
from echobeam.plots.setting import (
    check_trial,
    check_variables,
    choose_scheme,
    read_scenario,
    read_setting,
)
from echobeam.schemes.configure import system_for

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from echobeam.values import Array, IntArray

_CLOSE_UPS = 4
_ELLIPSES = 3

# Half-axes of the ellipse that holds 95 % of a Gaussian in the plane: sqrt(-2 ln 0.05) sigmas.
_ELLIPSE_SIGMAS = float(np.sqrt(-2.0 * np.log(0.05)))
_FLATTEST = 4.0
_CROWDED = 0.08

# m: who moves less has no direction.
_STILL = 1e-6


@style.styled()
def draw(result: xr.Dataset, scheme: str | None = None, trial: int = 0) -> Figure:
    """Draw the UAV's and the objects' paths in one trial, with close-ups of the tracking.

    The scene shows true paths to scale where its shape allows it; each close-up shows one object's
    true path, its predicted and estimated positions, and ellipses that hold 95 % of the estimate's
    stated distribution. Arrows point in the direction of movement. Below, the positions along the
    road against the slot, with forecasts from a few slots as cones: the dashed way that is
    predicted without further measurements, and three standard deviations on either side.

    Parameters
    ----------
    result
        A result of a run.
    scheme
        Name of a scheme; by default ``temporal``, else the first one with directional slots.
    trial
        Counted from 0.

    Raises
    ------
    PlotError
        If the result holds no tracks, or not this scheme or trial.
    """
    check_variables(
        result, "position", "identity", "uav_position", "predicted", "estimated", "estimated_cov",
        "mode",
    )  # fmt: skip
    check_trial(result, trial)
    name = choose_scheme(result, scheme)
    setting = read_setting(result)
    scene = read_scene(result, name, trial)
    close = _longest(scene, _CLOSE_UPS)
    figure = style.new_figure(style.PAGE if close else style.COLUMN, 5.3 if close else 3.5)
    figure.suptitle(setting.title(name, trial, 100 if close else 50))
    left, right, ahead = _panels(figure, len(close), flat=_is_flat(scene))
    _draw_scene(left, scene)
    for above, below, (k, stay) in zip(right, ahead, close, strict=True):
        _draw_close_up(above, scene, k, stay)
        cones = _read_cones(result, name, trial, k, stay)
        _draw_road(below, result["slot"].values, scene, k, stay, cones)
    if close:
        ahead[0].set_ylabel("Position (m)")
        style.add_legend(figure, _legend())
    return figure


def _longest(scene: Scene, most: int) -> list[tuple[int, slice]]:
    """Return the objects that are in the scene longest, and when, in their order."""
    stays = [
        (k, max(stretches, key=lambda one: one.stop - one.start))
        for k, stretches in enumerate(scene.stretches)
        if stretches
    ]
    stays.sort(key=lambda stay: stay[1].start - stay[1].stop)
    return sorted(stays[:most], key=lambda stay: stay[0])


def _is_flat(scene: Scene) -> bool:
    """Return whether the scene is so much wider than high that it wants the figure's width."""
    points = np.concatenate([scene.uav, scene.true.reshape(-1, 2)])
    width, height = np.ptp(points[np.isfinite(points).all(axis=1)], axis=0)
    return bool(width > 1.8 * max(height, scene.uav[:, 1].max()))


def _panels(figure: Figure, close_ups: int, *, flat: bool) -> tuple[Axes, list[Axes], list[Axes]]:
    """Return the axes of the scene, of the close-ups beside it or below a flat one, of the road."""
    if not close_ups:
        return figure.add_subplot(), [], []
    halves = figure.add_gridspec(2, 1, height_ratios=[2.1, 1.0])
    if flat:
        grid = halves[0].subgridspec(2, 1, height_ratios=[1.0, 0.9])
        columns = close_ups
    else:
        grid = halves[0].subgridspec(1, 2, width_ratios=[1.0, 1.15])
        columns = 1 if close_ups <= 2 else 2
    inner = grid[1].subgridspec(math.ceil(close_ups / columns), columns)
    cells = [inner[i // columns, i % columns] for i in range(close_ups)]
    below = halves[1].subgridspec(1, close_ups)
    return (
        figure.add_subplot(grid[0]),
        [figure.add_subplot(cell) for cell in cells],
        [figure.add_subplot(below[0, i]) for i in range(close_ups)],
    )


def _read_cones(
    result: xr.Dataset, scheme: str, trial: int, k: int, stay: slice
) -> list[Cone] | None:
    """Return the forecasts of one object in its stay, None if the scenario is not known."""
    scenario = read_scenario(result)
    if scenario is None:
        return None
    one = result[["estimated", "estimated_cov"]].isel(trial=trial, object=k).sel(scheme=scheme)
    mean = one["estimated"].transpose("slot", "state").values
    cov = one["estimated_cov"].transpose("slot", "state", "state_b").values
    position, velocity = (
        result[name].transpose("slot", "axis").values for name in ("uav_position", "uav_velocity")
    )
    system = system_for(scenario, scheme)
    return make_cones(mean, cov, chosen_slots(stay), stay.stop, (position, velocity), system)


def _draw_road(
    axes: Axes,
    slots: IntArray,
    scene: Scene,
    k: int,
    stay: slice,
    cones: list[Cone] | None,
) -> None:
    """Draw one object's true position along the road and what was forecast of it."""
    colour = style.object_look(k).colour
    axes.set_title(f"object {k + 1}", color=colour)
    axes.set_xlabel("Slot")
    axes.plot(slots[stay], scene.true[stay, k, 0], color=colour, linewidth=2.2, zorder=2)
    for cone in cones or []:
        draw_cone(axes, cone, slots, colour)
    if not cones:
        style.add_note(axes, "no forecast", height=0.8)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=5, integer=True, min_n_ticks=1))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=5))
    axes.margins(x=0.04)


def _draw_scene(axes: Axes, scene: Scene) -> None:
    axes.axhline(0.0, color="0.6", linewidth=2.0, zorder=1)
    axes.set(xlabel="Position along the road (m)", ylabel="Height (m)")
    _draw_path(axes, scene.uav, "black")
    _name(axes, scene.uav[-1], "UAV", (20, 0), "black")
    for k, stretches in enumerate(scene.stretches):
        for stay in stretches:
            sight = np.stack([scene.uav[stay.stop - 1], scene.true[stay.stop - 1, k]])
            axes.plot(*sight.T, color="0.7", linewidth=0.6, linestyle=":", zorder=1)
            _draw_path(axes, scene.true[stay, k], style.object_look(k).colour)
    if not any(scene.stretches):
        style.add_note(axes, "no objects in the scene")
    _widen(axes, 30.0)
    _number_objects(axes, scene)
    width, height = np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())
    if max(width, height) < _FLATTEST * min(width, height):
        axes.set_aspect("equal")


def _number_objects(axes: Axes, scene: Scene) -> None:
    """Write the objects' numbers below the road, in two rows if one would be crowded."""
    ends = sorted(
        (float(scene.true[stay.stop - 1, k, 0]), k)
        for k, stretches in enumerate(scene.stretches)
        for stay in stretches
    )
    gaps = np.diff([x for x, _ in ends])
    rows = 2 if (gaps < _CROWDED * np.ptp(axes.get_xlim())).any() else 1
    for i, (x, k) in enumerate(ends):
        below = (0, -10 - 9 * (i % rows))
        _name(axes, np.array([x, 0.0]), str(k + 1), below, style.object_look(k).colour)
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.09 * rows * (high - low), high)


def _draw_path(axes: Axes, path: Array, colour: str) -> None:
    axes.plot(*path.T, color=colour, linewidth=1.6, zorder=3)
    _draw_arrow(axes, path, colour)


def _name(axes: Axes, where: Array, text: str, offset: tuple[float, float], colour: str) -> None:
    """Write a name beside a point, at an offset in points."""
    axes.annotate(
        text, tuple(where), xytext=offset, textcoords="offset points", ha="center", va="center",
        color=colour, fontweight="bold", zorder=5,
    )  # fmt: skip


def _widen(axes: Axes, least: float) -> None:
    """Leave a margin around the data, and see at least so many metres in either direction."""
    axes.margins(0.12)
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    extra = np.maximum(least - (high - low), 0.0) / 2
    axes.set_xlim(low[0] - extra[0], high[0] + extra[0])
    axes.set_ylim(low[1] - extra[1], high[1] + extra[1])


def _draw_arrow(axes: Axes, path: Array, colour: str) -> None:
    """Point an arrow of fixed size along the movement; draw a dot if there is none."""
    step = path[-1] - path[max(len(path) - 10, 0)]
    length = float(np.hypot(*step))
    if length < _STILL:
        axes.plot(*path[-1:].T, color=colour, marker="o", linestyle="", zorder=4)
        return
    tail = -14.0 * step / length
    axes.annotate(
        "", tuple(path[-1]), xytext=tuple(tail), textcoords="offset points", zorder=4,
        arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.2, "shrinkA": 0,
                    "shrinkB": 0, "mutation_scale": 9},
    )  # fmt: skip


def _draw_close_up(axes: Axes, scene: Scene, k: int, stay: slice) -> None:
    colour = style.object_look(k).colour
    axes.set_title(f"object {k + 1}", color=colour)
    axes.set(xlabel="Position (m)", ylabel="Height (m)")
    path, predicted, estimated = (
        positions[stay, k] for positions in (scene.true, scene.predicted, scene.estimated)
    )
    axes.plot(*path.T, color=colour, linewidth=2.2, zorder=2)
    _draw_arrow(axes, path, colour)
    marked = style.marked_points(len(path))
    axes.plot(*predicted.T, markevery=marked, **_PREDICTED)
    axes.plot(*estimated.T, markevery=marked, **_ESTIMATED)
    if not np.isfinite(estimated).any():
        style.add_note(axes, "no estimates", height=0.8)
    _draw_ellipses(axes, estimated, scene.spread[stay, k], colour)
    _widen(axes, 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=5))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=4))


_PREDICTED: dict[str, Any] = {
    "label": "predicted",
    "color": "0.25", "marker": "x", "linestyle": "", "markersize": 4.5, "zorder": 4,
}  # fmt: skip
_ESTIMATED: dict[str, Any] = {
    "label": "estimated",
    "color": "0.25", "marker": "o", "linestyle": "-", "linewidth": 0.6, "markersize": 3.5,
    "markerfacecolor": "white", "zorder": 3,
}  # fmt: skip


def _draw_ellipses(axes: Axes, centres: Array, spreads: Array, colour: str) -> None:
    """Draw the estimates' 95 % ellipses at a few slots, of those that are seen whole.

    Left out are ellipses larger than all other marks together, as those of the first slots often
    are, unless the last one, which is always drawn, is half their size.
    """
    usable = np.isfinite(spreads).all(axis=(1, 2)) & np.isfinite(centres).all(axis=1)
    some = np.flatnonzero(usable)
    if not some.size:
        return
    reach = _ELLIPSE_SIGMAS * np.sqrt(np.maximum(np.diagonal(spreads, axis1=1, axis2=2), 0.0))
    room = np.maximum(np.ptp(axes.dataLim.get_points(), axis=0), 4.0 * reach[some[-1]])
    some = some[(2.0 * reach[some] <= room).all(axis=-1)]
    some = some[np.unique(np.linspace(0, some.size - 1, _ELLIPSES).astype(int))]
    for i in some:
        values, vectors = np.linalg.eigh(spreads[i])
        minor, major = 2.0 * _ELLIPSE_SIGMAS * np.sqrt(np.maximum(values, 0.0))
        tilt = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
        ellipse = Ellipse(
            tuple(centres[i]), major, minor, angle=float(tilt), facecolor="none",
            edgecolor=colour, linewidth=0.7, zorder=1.5,
        )  # fmt: skip
        axes.add_artist(ellipse)
    axes.update_datalim(np.concatenate([centres[some] - reach[some], centres[some] + reach[some]]))


def _legend() -> list[Artist]:
    return [
        Line2D([], [], color="0.25", linewidth=2.2, label="true path"),
        Line2D([], [], **_ESTIMATED),
        Line2D([], [], **_PREDICTED),
        Patch(facecolor="none", edgecolor="0.3", label="95 % region (if within axes)"),
        Line2D([], [], **WAY, label="forecast"),
        Patch(facecolor="0.8", label="its ±3σ"),
    ]
