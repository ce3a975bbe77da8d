"""Beam patterns of planar arrays: power over the visible region of direction cosines."""

from __future__ import annotations

from typing import Final

import numpy as np

from echobeam.plots.field import Field, levels_below
from echobeam.plots.frames import choose_slots
from echobeam.plots.ground_run import GroundRun, edge, read_ground
from echobeam.plots.looks import BLACK, BLUE, MAX_OBJECTS, SHORT, Look, object_look
from echobeam.plots.record import Axis, FigureData, Note, Panel, Series, grid
from echobeam.plots.source import Source
from echobeam.values import Array, Mode, with_beams

COVER: Final = SHORT
"""Line of the edge of a cover."""

_POINTS = 129
_DEFAULT_SLOTS = (1, 2, 3, 4, 6, 10)
_STEP, _SHADES = 5.0, 6  # dB
_COLUMNS = 3
_SIZE = 2.35  # inches of a panel
_TRUE = Look(BLACK, "+", "")


def cosine_patterns(source: Source) -> FigureData:
    """Return the power sent in one trial over the direction cosines, in chosen slots.

    The shades are the sum over all beams of |a(u, v)^H w_k|^2 within the visible region, of two
    polarisations the sum of both, without the pattern of the elements themselves. Marks are the
    true and predicted directions; a dashed line is the edge of the ellipse that a
    beam was designed to cover, Eq. (38f). More than `MAX_OBJECTS` objects look alike, without
    numbers.
    """
    run = read_ground(source)
    chosen = choose_slots(source, run.slot, run.mode, run.has_beam, _DEFAULT_SLOTS)
    objects = run.objects(chosen)
    many = len(objects) > MAX_OBJECTS
    powers = [_power(run, index) for index in chosen]
    highest = max(float(np.nanmax(one)) for one in powers)
    levels = levels_below(highest, _STEP, _SHADES)
    panels = tuple(
        _panel(run, index, objects, Field("Power", "dB", _grid(), _grid(), power, levels))
        for index, power in zip(chosen, powers, strict=True)
    )
    other = BLUE if many else BLACK
    key = [("true direction", _TRUE), ("predicted direction", Look(other, "x", ""))]
    if any(run.has_cover(index, k) for index in chosen for k in objects):
        key.append((run.cover_words, Look(other, "", COVER)))
    layout = grid(len(chosen), min(_COLUMNS, len(chosen)))
    return FigureData(
        "patterns", source.title, panels, source.setting(source.one_scheme(), one_trial=True),
        caption=r"shaded: $\Sigma_k\, |\mathbf{a}^H(u, v)\,\mathbf{w}_k|^2$",
        layout=layout, size=(7.16, 0.5 + _SIZE * len(layout)), share="xy", key=tuple(key),
    )  # fmt: skip


def slot_title(run: GroundRun, index: int) -> str:
    """Return the slot of a panel, with its mode if that is without beams."""
    mode = Mode(int(run.mode[index]))
    beams = bool(with_beams(run.mode[index]))
    return f"slot {run.slot[index]}" + ("" if beams else f" ({mode.name.lower()})")


def _grid() -> Array:
    return np.linspace(-1.0, 1.0, _POINTS)


def _power(run: GroundRun, index: int) -> Array:
    """Return the power over the grid in dB, ``(v, u)``; NaN beyond the visible region."""
    cosines = np.stack(np.meshgrid(_grid(), _grid()), axis=-1)
    power = run.radiated(index, cosines)
    decibels = 10.0 * np.log10(np.maximum(power, 1e-300))
    return np.where(np.sum(cosines**2, axis=-1) <= 1.0, decibels, np.nan)


def _panel(run: GroundRun, index: int, objects: list[int], field: Field) -> Panel:
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    rim = Series("visible region", np.cos(turn), np.sin(turn), look=Look("0.3"), kind="line",
                 width=0.8, legend=False)  # fmt: skip
    series, notes = [rim], []
    true, predicted = run.cosines(run.truth)[index], run.centre[index]
    many = len(objects) > MAX_OBJECTS
    for k in objects:
        name, own = f"object {k + 1}", object_look(k).colour
        colour = BLUE if many else own
        if np.isfinite(predicted[k]).all():
            series.append(_mark(f"{name}, predicted direction", predicted[k],
                                Look(colour, "x", "")))  # fmt: skip
        if run.has_cover(index, k):
            points = edge(predicted[k], run.cover[index, k])
            series.append(
                Series(f"{name}, cover", points[:, 0], points[:, 1],
                       look=Look(colour, "", COVER), kind="line", width=1.1, legend=False)
            )  # fmt: skip
        if run.present[index, k] and np.isfinite(true[k]).all():
            look = _TRUE if many else Look(own, "+", "")
            series.append(_mark(f"{name}, true direction", true[k], look))
            if not many:
                notes.append(_number(run, index, k, true[k], predicted[k]))
    limits = (-1.04, 1.04)
    return Panel(
        Axis("Direction cosine u", limits=limits), Axis("Direction cosine v", limits=limits),
        tuple(series), slot_title(run, index), notes=tuple(notes), equal=True, field=field,
    )  # fmt: skip


def _number(run: GroundRun, index: int, k: int, true: Array, predicted: Array) -> Note:
    """Return the number of an object, outwards of the centre, so that it is beside the beam."""
    side = 1.0 if true[0] >= 0.0 else -1.0
    far = true[0]
    if run.has_cover(index, k):
        reach = side * float(np.sqrt(run.cover[index, k, 0, 0]))
        far = side * max(side * far, side * (predicted[0] + reach))
    return Note(str(k + 1), float(far), float(true[1]), object_look(k).colour,
                offset=(8.0 * side, 0.0), bold=True)  # fmt: skip


def _mark(name: str, at: Array, look: Look) -> Series:
    return Series(name, at[:1], at[1:], look=look, kind="points", legend=False, hollow=True)
