"""Map of the ground: the beams' footprint, the UAV's and the objects' paths, and their regions."""

from __future__ import annotations

import numpy as np

from echobeam.physics.link import channel_loss
from echobeam.plots.cosines import COVER, slot_title
from echobeam.plots.field import Field, levels_below
from echobeam.plots.frames import choose_slots
from echobeam.plots.ground_run import REGION, SHARE, GroundRun, edge, read_ground
from echobeam.plots.looks import BLACK, BLUE, MAX_OBJECTS, RING, Look, object_look
from echobeam.plots.record import Axis, FigureData, Note, Panel, Series, grid
from echobeam.plots.scene import framed
from echobeam.plots.source import Source
from echobeam.values import Array

DEFAULT_SLOTS = (2, 3, 10)
"""Slots of a frame shown by default: the first beams, the next, and the last."""

_POINTS = 121
_STEP, _SHADES = 5.0, 6  # dB
_COLUMNS = 3
_MARGIN = 0.25
_LEAST = 40.0  # m
_ESTIMATED = Look("0.25", "o", "")
_ONE_OF_MANY = Look(BLACK, "+", ""), Look(BLUE, "o", "")


def ground_map(source: Source) -> FigureData:
    """Return the ground below the UAV in chosen slots of one trial of one scheme.

    The shades are the SNR on the ground of the sum of all beams, the power
    sum |a^H w_k|^2 over the noise and the path loss of a receiver there, Eqs. (3), (36). Lines are
    the paths of UAV and objects over the whole run; a ring is the region that holds 95 % of an
    object's predicted position (of the estimated one where there is no prediction), a dashed line
    the edge of the cover, Eq. (38f), projected from the direction cosines of its slot. More than
    `MAX_OBJECTS` objects look alike, without covers and numbers.
    """
    run = read_ground(source)
    chosen = choose_slots(source, run.slot, run.mode, run.has_beam, DEFAULT_SLOTS)
    objects = run.objects(chosen)
    many = len(objects) > MAX_OBJECTS
    places = np.where(run.present[..., None], run.truth[..., :2], np.nan)[:, objects]
    points = np.concatenate([run.uav[:, :2], places.reshape(-1, 2)])
    low, high = framed(points, _MARGIN, _LEAST)
    x, y = (np.linspace(low[axis], high[axis], _POINTS) for axis in range(2))
    radio = source.scenario.radio
    strengths = [footprint(run, index, x, y, radio.noise, radio.alpha0) for index in chosen]
    finite = [one[np.isfinite(one)] for one in strengths]
    highest = max((float(one.max()) for one in finite if one.size), default=0.0)
    levels = levels_below(highest, _STEP, _SHADES)
    panels = tuple(
        _panel(run, index, objects, Field("SNR on the ground", "dB", x, y, one, levels))
        for index, one in zip(chosen, strengths, strict=True)
    )
    key = _key_of_many() if many else _key()
    if not many and any(run.has_cover(index, k) for index in chosen for k in objects):
        key.append((run.cover_words, Look(BLACK, "", COVER)))
    columns = min(_COLUMNS, len(chosen))
    layout = grid(len(chosen), columns)
    return FigureData(
        "map", source.title, panels, source.setting(source.one_scheme(), one_trial=True),
        caption="shaded: SNR of the sum of all beams",
        layout=layout, size=_size(low, high, columns, len(layout)), share="xy", key=tuple(key),
    )  # fmt: skip


def footprint(run: GroundRun, index: int, x: Array, y: Array, noise: float, alpha0: float) -> Array:
    """Return the SNR in dB of all beams of a slot on a grid of the ground, ``(m, n)``.

    Parameters
    ----------
    run, index
        The run, and the index of the slot.
    x, y
        ``(n,)`` and ``(m,)`` m.
    noise, alpha0
        Noise power and amplitude of the channel at 1 m, see `channel_loss`.

    Returns
    -------
    Array
        NaN where the array sees nothing: no power.
    """
    cosines, distance = run.seen(index, np.stack(np.meshgrid(x, y), axis=-1))
    strength = run.radiated(index, cosines) / channel_loss(distance, noise, alpha0)
    decibels: Array = 10.0 * np.log10(np.where(strength > 0.0, strength, np.nan))
    return decibels


def _size(low: Array, high: Array, columns: int, rows: int) -> tuple[float, float]:
    """Return the size of the figure in inches, of panels to scale."""
    across, up = high - low
    width, wide = {1: (3.5, 2.3), 2: (5.2, 1.95)}.get(columns, (7.16, 1.9))  # of figure and panel
    return width, 0.75 + rows * (0.25 + wide * up / across)


def _panel(run: GroundRun, index: int, objects: list[int], field: Field) -> Panel:
    uav = Series("UAV", run.uav[:, 0], run.uav[:, 1], look=Look(BLACK), kind="line", width=1.6,
                 legend=False, arrow=True)  # fmt: skip
    series: list[Series] = [uav]
    lowest = float(field.y[0] + 0.1 * (field.y[-1] - field.y[0]))
    many = len(objects) > MAX_OBJECTS
    beside = (24.0, 14.0) if many else (0.0, 10.0)
    notes = [Note("UAV", float(run.uav[-1, 0]), float(run.uav[-1, 1]), offset=beside, bold=True)]
    if many:
        series += _many(run, index, objects)
    for k in () if many else objects:
        own, note = _object(run, index, k, lowest)
        series += own
        notes += note
    x, y = (
        Axis(name, "m", limits=(float(at[0]), float(at[-1])))
        for name, at in (("x", field.x), ("y", field.y))
    )
    return Panel(x, y, tuple(series), slot_title(run, index), notes=tuple(notes), equal=True,
                 field=field)  # fmt: skip


def _key() -> list[tuple[str, Look]]:
    return [("true path (arrow: heading)", Look(BLACK)), ("estimated position", _ESTIMATED),
            (f"{100 * SHARE:g} % region of the prediction", Look("0.3", RING, ""))]  # fmt: skip


def _key_of_many() -> list[tuple[str, Look]]:
    true, estimated = _ONE_OF_MANY
    return [("true path", Look("0.3")), ("true position", true), ("estimated position", estimated),
            (f"{100 * SHARE:g} % region of the prediction", Look(BLUE, RING, ""))]  # fmt: skip


def _many(run: GroundRun, index: int, objects: list[int]) -> list[Series]:
    """Return the paths, places, estimates and regions of many objects in a slot, all alike."""
    true, estimated = _ONE_OF_MANY  # the true ones last: they are the thinner marks
    paths = np.where(run.present[..., None], run.truth[..., :2], np.nan)[:, objects]
    regions = [region(run, index, k) for k in objects]
    gap = np.full((1, 2), np.nan)
    lines = {
        "true paths": (list(np.moveaxis(paths, 0, 1)), Look("0.3"), 0.8),
        "regions": (regions, Look(BLUE), 0.9),
    }
    series = []
    for name, (parts, look, width) in lines.items():
        x, y = np.concatenate([piece for part in parts for piece in (part, gap)]).T
        series.append(Series(name, x, y, look=look, kind="line", width=width, legend=False))
    places = {
        "estimated positions": (run.estimated[index, objects, :2], estimated),
        "true positions": (paths[index], true),
    }
    for name, (place, look) in places.items():
        series.append(
            Series(name, place[:, 0], place[:, 1], look=look, kind="points", legend=False,
                   hollow=True)
        )  # fmt: skip
    return series


def _object(run: GroundRun, index: int, k: int, lowest: float) -> tuple[list[Series], list[Note]]:
    """Return an object's path, its estimate, its region and its cover in a slot, and its number.

    ``lowest`` is the least y, m, below which there is no room for the number.
    """
    look, name = object_look(k), f"object {k + 1}"
    path = np.where(run.present[:, k, None], run.truth[:, k, :2], np.nan)
    series = [
        Series(f"{name}, true path", path[:, 0], path[:, 1], look=look.plain("-"),
               kind="line", width=1.6, legend=False, arrow=True)
    ]  # fmt: skip
    estimated = run.estimated[index, k, :2]
    if np.isfinite(estimated).all():
        series.append(
            Series(f"{name}, estimated position", estimated[:1], estimated[1:],
                   look=Look(look.colour, "o", ""), kind="points", legend=False, hollow=True)
        )  # fmt: skip
    lines = {f"{name}, {100 * SHARE:g} % region": (region(run, index, k), look.plain("-"), 0.9)}
    if run.has_cover(index, k):
        points = run.on_ground(index, edge(run.centre[index, k], run.cover[index, k]))
        lines[f"{name}, cover"] = points, Look(look.colour, "", COVER), 1.1
    series += [
        Series(text, points[:, 0], points[:, 1], look=own, kind="line", width=width, legend=False)
        for text, (points, own, width) in lines.items()
        if np.isfinite(points).any()
    ]
    drawn = np.concatenate([path, *(points for points, _, _ in lines.values())])
    if (drawn[:, 1] < lowest).any():  # a region that leaves the map is no place for a number
        drawn = path
    return series, _number(k, drawn[np.isfinite(drawn).all(axis=-1)], lowest)


def _number(k: int, points: Array, lowest: float) -> list[Note]:
    """Return the number of an object below what is drawn of it, above where there is no room."""
    if not points.size:
        return []
    i = int(np.argmin(points[:, 1]))
    below = points[i, 1] > lowest
    if not below:
        i = int(np.argmax(points[:, 1]))
    x, y, up = float(points[i, 0]), float(points[i, 1]), -9.0 if below else 9.0
    return [Note(str(k + 1), x, y, object_look(k).colour, offset=(0.0, up), bold=True)]


def region(run: GroundRun, index: int, k: int) -> Array:
    """Return the edge ``(n, 2)`` m of an object's region in a slot, NaN where nothing is in doubt.

    It is that of the prediction, or of the estimate without one.
    """
    mean, cov = run.predicted[index, k], run.predicted_cov[index, k]
    if not np.isfinite(mean).all():
        mean, cov = run.estimated[index, k], run.estimated_cov[index, k]
    if not (np.isfinite(mean).all() and np.diagonal(cov)[:2].min() > 0.0):
        return np.full((1, 2), np.nan)
    return edge(mean[:2], REGION * cov[:2, :2])
