"""Beam patterns over the angle, slot by slot: how the beams narrow as the estimates improve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from echobeam.plots import style
from echobeam.plots.beams import (
    BeamRun,
    beam_gain,
    believed_angles,
    has_beam,
    read_beams,
)
from echobeam.plots.setting import (
    PlotError,
    Setting,
    check_trial,
    check_variables,
    choose_scheme,
    read_setting,
)
from echobeam.simulation.statistics import cover_centre
from echobeam.values import Mode

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from echobeam.values import Array

DEFAULT_SLOTS = (1, 2, 4, 6, 10)
"""The slots of a frame that are shown: omni, the first directional one, and how it goes on."""

_GRID = np.linspace(0.0, np.pi, 1801)
_RANGE_DB = 45.0
_COLUMNS = 3
_ANGLE_LABEL = "Angle θ (deg)"
_OMNI: dict[str, Any] = {"color": "black", "linewidth": 1.3, "linestyle": "-", "zorder": 3}
_LEVEL: dict[str, Any] = _OMNI | {"color": "0.35", "linewidth": 0.8, "zorder": 2}
_TRUE: dict[str, Any] = {"linewidth": 0.8, "linestyle": "-"}
_PREDICTED: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (2.0, 1.5))}


@style.styled()
def draw(
    result: xr.Dataset,
    scheme: str | None = None,
    trial: int = 0,
    slots: Sequence[int] | None = None,
) -> Figure:
    """Draw the beam patterns of one trial in chosen slots, one curve per object.

    Vertical lines are the true (solid) and predicted (dashed) angles; the shaded band is what
    the beam was designed to cover, Eq. (38f). A vertical array cannot tell theta from
    180 deg - theta, so every lobe has its mirror.

    Parameters
    ----------
    result
        A result of a run.
    scheme
        Name of a scheme; by default ``temporal``, else the first one with directional slots.
    trial
        Counted from 0.
    slots
        Slots counted from 1; by default `DEFAULT_SLOTS` of the frame with the most beams.

    Raises
    ------
    PlotError
        If the result holds no beams, or not this scheme, trial or slot.
    """
    check_variables(result, "truth", "present", "predicted", "estimated", "covered", "beam", "mode")
    check_trial(result, trial)
    name = choose_scheme(result, scheme)
    run, setting = read_beams(result, name, trial), read_setting(result, name)
    chosen = choose_slots(run, slots)
    objects = _choose_objects(run, chosen)
    columns = min(_COLUMNS, len(chosen))
    rows = math.ceil(len(chosen) / columns)
    figure = style.new_figure(style.PAGE, 0.75 + 1.5 * rows)
    figure.suptitle(setting.title(name, trial))
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, index in zip(panels.flat, chosen, strict=False):
        _draw_panel(axes, run, index, objects, setting)
    _label_panels(list(panels.flat), columns, len(chosen), setting)
    handles = _legend(run, chosen, objects, setting)
    spare = panels.flat[len(chosen) :]
    for axes in spare:
        axes.set_axis_off()
    if len(spare):
        spare[0].legend(handles=handles, loc="center")
        figure.supxlabel(_ANGLE_LABEL, fontsize="medium")
    else:
        for axes in panels[-1]:
            axes.set_xlabel(_ANGLE_LABEL)
        style.add_legend(figure, handles)
    return figure


def choose_slots(run: BeamRun, wanted: Sequence[int] | None) -> list[int]:
    """Return the indices of the slots to show.

    Raises
    ------
    PlotError
        If a wanted slot is not in the run.
    """
    numbers = [int(slot) for slot in run.slot]
    if wanted is not None:
        unknown = [str(slot) for slot in wanted if slot not in numbers]
        if unknown or not wanted:
            raise PlotError(
                f"the result holds no slot {', '.join(unknown) or '(none given)'}; "
                f"it holds {numbers[0]} to {numbers[-1]}"
            )
        return [numbers.index(slot) for slot in wanted]
    first, end = _busiest_frame(run)
    return [first + slot - 1 for slot in DEFAULT_SLOTS if first + slot <= end]


def _busiest_frame(run: BeamRun) -> tuple[int, int]:
    """Return first index and end of the frame with the most beams; the first frame of equals.

    A frame begins with a slot without directional beams. A run without beams is one frame, and
    so is one that is always directional.
    """
    beams = has_beam(run).sum(axis=1)
    starts = np.flatnonzero(run.mode != Mode.DIRECTIONAL)
    bounds = np.unique([0, *starts, len(beams)]) if beams.any() else np.array([0, len(beams)])
    busiest = int(np.argmax(np.add.reduceat(beams, bounds[:-1])))
    return int(bounds[busiest]), int(bounds[busiest + 1])


def _choose_objects(run: BeamRun, chosen: Sequence[int]) -> list[int]:
    """Return the objects to show: those in the scene or beamed at, as many as can be told apart."""
    seen = run.present[chosen] | has_beam(run)[chosen]
    return [int(k) for k in np.flatnonzero(seen.any(axis=0))[: style.MAX_OBJECTS]]


def _draw_panel(
    axes: Axes, run: BeamRun, index: int, objects: Sequence[int], setting: Setting
) -> None:
    mode = Mode(int(run.mode[index]))
    directional = mode == Mode.DIRECTIONAL
    axes.set_title(f"slot {run.slot[index]}" + ("" if directional else f" ({mode.name.lower()})"))
    axes.axhline(float(_decibel(setting.power)), **(_LEVEL if directional else _OMNI))
    believed = believed_angles(run, index)
    centre = cover_centre(run.predicted, run.estimated, setting.centre)[index]
    beamed = has_beam(run)[index]
    for k in objects:
        colour = style.object_look(k).colour
        if run.present[index, k] and np.isfinite(run.truth[index, k]):
            axes.axvline(np.rad2deg(run.truth[index, k]), color=colour, zorder=1.5, **_TRUE)
        if np.isfinite(believed[k]):
            axes.axvline(np.rad2deg(believed[k]), color=colour, zorder=1.6, **_PREDICTED)
        if beamed[k]:
            _draw_coverage(axes, centre[k], run.covered[index, k], colour)
        if beamed[k]:
            gain = beam_gain(run.beams[index, k], _GRID, setting.array)
            look = style.object_look(k)
            axes.plot(
                np.rad2deg(_GRID),
                _decibel(gain),
                color=look.colour,
                linestyle=look.line,
                linewidth=1.1,
                zorder=3,
            )
    if directional and not beamed.any():
        style.add_note(axes, "no beams")


def _draw_coverage(axes: Axes, centre: float, halfwidth: float, colour: str) -> None:
    if np.isfinite(centre) and np.isfinite(halfwidth):
        low, high = np.rad2deg(np.clip([centre - halfwidth, centre + halfwidth], 0.0, np.pi))
        axes.axvspan(low, high, color=colour, alpha=0.15, linewidth=0, zorder=1)


def _decibel(power: Array | float) -> Array:
    return np.asarray(10.0 * np.log10(np.maximum(power, 1e-300)))


def _label_panels(panels: list[Axes], columns: int, count: int, setting: Setting) -> None:
    top = 10.0 * math.log10(max(setting.power * max(setting.n_tx, 1), 1e-300)) + 3.0
    panels[0].set_ylim(top - _RANGE_DB, top)
    panels[0].set_xlim(0.0, 180.0)
    panels[0].xaxis.set_major_locator(MultipleLocator(30.0))
    panels[0].yaxis.set_major_locator(MultipleLocator(10.0))
    for i, axes in enumerate(panels[:count]):
        if i % columns == 0:
            axes.set_ylabel(r"$|\mathbf{a}^H(\theta)\,\mathbf{w}_k|^2$ (dB)")
        axes.tick_params(labelbottom=True)


def _legend(
    run: BeamRun, chosen: Sequence[int], objects: Sequence[int], setting: Setting
) -> list[Artist]:
    handles: list[Artist] = [
        Line2D(
            [], [], color=style.object_look(k).colour, linestyle=style.object_look(k).line,
            label=f"beam for object {k + 1}",
        )
        for k in objects
    ]  # fmt: skip
    hidden = int(run.present.any(axis=0).sum()) - len(objects)
    handles.append(Line2D([], [], label="omnidirectional, $P_T$", **_OMNI))
    if objects:
        handles.append(Line2D([], [], color="0.3", label="true angle", **_TRUE))
        handles.append(Line2D([], [], color="0.3", label="predicted angle", **_PREDICTED))
        if np.isfinite(run.covered[np.ix_(chosen, objects)]).any():
            band = rf"covered, ± {setting.width:g}$\sigma_\theta$"
            handles.append(Patch(facecolor="0.3", alpha=0.25, linewidth=0, label=band))
    else:
        handles.append(Line2D([], [], linestyle="", label="no objects in these slots"))
    if objects and hidden > 0:
        handles.append(Line2D([], [], linestyle="", label=f"({hidden} more objects not drawn)"))
    return handles
