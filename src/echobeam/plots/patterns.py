"""Beam patterns over the angle per slot: beams narrow as the estimates improve."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.physics.array import LinearArray
from echobeam.physics.planar import linear
from echobeam.plots.frames import choose_slots
from echobeam.plots.looks import AREA, MAX_OBJECTS, SHORT, Look, object_look
from echobeam.plots.record import Axis, FigureData, Guide, Panel, Series, grid
from echobeam.plots.source import Source
from echobeam.schemes.configure import system_for
from echobeam.simulation.statistics import cover_centre
from echobeam.values import Array, BoolArray, ComplexArray, Mode, ModeArray, with_beams

_GRID = np.linspace(0.0, np.pi, 1801)
_RANGE_DB = 45.0
_COLUMNS = 3


class BeamRun(NamedTuple):
    """Beams and angles of one trial of one scheme.

    ``slot`` and ``mode`` are ``(slot,)``; ``present``, the angles ``truth``, ``predicted``,
    ``estimated`` and ``centre`` (of the cover) in rad and the half-width ``covered`` (rad) are
    ``(slot, object)``; ``beams`` is ``(slot, object, antenna)``, sqrt(power).
    """

    slot: npt.NDArray[np.int64]
    mode: ModeArray
    present: BoolArray
    truth: Array
    predicted: Array
    centre: Array
    covered: Array
    beams: ComplexArray


def patterns(source: Source) -> FigureData:
    """Return the beam patterns of one trial in chosen slots, one curve per object.

    Vertical lines are the true (solid) and predicted (dashed) angles; the shaded band is the
    interval that the beam was designed to cover, Eq. (38f). A vertical array cannot distinguish
    theta from 180 deg - theta, so every lobe has a mirror image.
    """
    run = _read(source)
    chosen = choose_slots(source, run.slot, run.mode, has_beam(run))
    seen = (run.present[chosen] | has_beam(run)[chosen]).any(axis=0)
    objects = [int(k) for k in np.flatnonzero(seen)]
    shown = objects[:MAX_OBJECTS]
    scenario = source.scenario
    system = system_for(scenario, source.one_scheme())
    array, power = linear(system.transmitter), scenario.radio.power
    top = 10.0 * math.log10(max(power * array.n, 1e-300)) + 3.0
    axis = Axis("Angle θ", "deg", limits=(0.0, 180.0), ticks=tuple(range(0, 181, 30)))
    gain = Axis(r"$|\mathbf{a}^H(\theta)\,\mathbf{w}_k|^2$", "dB", limits=(top - _RANGE_DB, top))
    panels = []
    for index in chosen:
        mode = Mode(int(run.mode[index]))
        directional = bool(with_beams(run.mode[index]))
        label = f"slot {run.slot[index]}" + ("" if directional else f" ({mode.name.lower()})")
        series = [] if directional else [_level(power)]
        series += [_pattern(run, index, k, array) for k in shown if has_beam(run)[index, k]]
        guides = tuple(guide for k in shown for guide in _angles(run, index, k))
        panels.append(Panel(axis, gain, tuple(series), label, guides, empty="no beams"))
    key = [(f"beam for object {k + 1}", object_look(k).plain()) for k in shown]
    key += [("true angle", Look("0.3")), ("predicted angle", Look("0.3", "", SHORT))]
    if np.isfinite(run.covered[chosen]).any():
        key.append((rf"covered, ±{system.coverage.width:g}$\sigma_\theta$", Look("0.75", AREA)))
    hidden = len(objects) - len(shown)
    layout = grid(len(chosen), min(_COLUMNS, len(chosen)))
    return FigureData(
        "patterns", source.title, tuple(panels), source.setting(source.one_scheme(),
                                                                one_trial=True),
        caption=f"{hidden} more objects are not drawn" if hidden > 0 else "",
        layout=layout, size=(7.16, 0.6 + 1.55 * len(layout)), share="xy", key=tuple(key),
    )  # fmt: skip


def beam_gain(beams: ComplexArray, angles: Array, array: LinearArray) -> Array:
    """Return the power radiated towards angles, |a(theta)^H w|^2 with a of Eq. (4).

    Parameters
    ----------
    beams
        ``(..., N)``, sqrt(power).
    angles
        ``(G,)`` rad.
    array
        The transmit array.

    Returns
    -------
    Array
        ``(..., G)``, power.
    """
    a = array.steering(angles)
    return np.asarray(np.abs(np.einsum("gn,...n->...g", a.conj(), beams)) ** 2)


def decibels(power: Array | float, least: float = 1e-300) -> Array:
    """Return a power in dB, not below ``least``."""
    return np.asarray(10.0 * np.log10(np.maximum(power, least)))


def has_beam(run: BeamRun) -> BoolArray:
    """Return ``(slot, object)``: whether a beam was sent for the object."""
    # NaN > 0 is false: no beams in omnidirectional and pilot slots.
    return np.asarray((np.abs(run.beams) > 0.0).any(axis=-1))


def _read(source: Source) -> BeamRun:
    one = source.one_trial(
        "truth", "present", "predicted", "estimated", "covered", "beam", "mode"
    ).transpose("slot", "object", "antenna", "part", ...)
    predicted, estimated = (one[name].sel(state="angle").values for name in
                            ("predicted", "estimated"))  # fmt: skip
    centre = system_for(source.scenario, source.one_scheme()).coverage.centre
    beam = one["beam"]
    return BeamRun(
        slot=one["slot"].values,
        mode=one["mode"].values,
        present=one["present"].values.astype(bool),
        truth=one["truth"].sel(state="angle").values,
        # the prediction, or the last estimate of a scheme without predictions (pilot)
        predicted=cover_centre(predicted, estimated, "predicted"),
        centre=cover_centre(predicted, estimated, centre),
        covered=one["covered"].values,
        beams=beam.sel(part="re").values + 1j * beam.sel(part="im").values,
    )


def _level(power: float) -> Series:
    """Return the pattern of an omnidirectional transmission."""
    ends = np.array([0.0, 180.0])
    level = np.full(2, float(decibels(power)))
    return Series("omnidirectional, $P_T$", ends, level, look=Look("black"), kind="line")


def _pattern(run: BeamRun, index: int, k: int, array: LinearArray) -> Series:
    gain = decibels(beam_gain(run.beams[index, k], _GRID, array))
    return Series(
        f"object {k + 1}", np.degrees(_GRID), gain, look=object_look(k).plain(), kind="line",
        width=1.1, legend=False,
    )  # fmt: skip


def _angles(run: BeamRun, index: int, k: int) -> list[Guide]:
    """Return the object's true and predicted angle and the covered interval of its beam."""
    colour, guides = object_look(k).colour, []
    if run.present[index, k] and np.isfinite(run.truth[index, k]):
        guides.append(Guide("x", float(np.degrees(run.truth[index, k])), look=Look(colour)))
    if np.isfinite(run.predicted[index, k]):
        at = float(np.degrees(run.predicted[index, k]))
        guides.append(Guide("x", at, look=Look(colour, "", SHORT)))
    ends = run.centre[index, k] + np.array([-1.0, 1.0]) * run.covered[index, k]
    if has_beam(run)[index, k] and np.isfinite(ends).all():
        low, high = np.degrees(np.clip(ends, 0.0, np.pi))
        guides.append(Guide("x", float(low), float(high), Look(colour), alpha=0.15))
    return guides
