"""Distributions over the trials: rate, angle error, and outage."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.plots.looks import FAINT, Look
from echobeam.plots.record import Axis, FigureData, Guide, Panel, Series
from echobeam.plots.source import Source, empty_figure
from echobeam.schemes.configure import geometry_of, system_for
from echobeam.simulation.statistics import posterior_errors
from echobeam.values import Array, with_beams

_POINTS = 400
_SHARE = (-0.02, 1.02)


def distribution(source: Source) -> FigureData:
    """Return the empirical distributions of rate, angle error and rate per object.

    - Rate: a frame's mean sum rate, over trials and frames; a trial's mean over the slots shown
    if these are not complete frames.
    - Error of the angle, on the ground of the position: its size, over trials, slots and objects
    in the scene. An object without a track has no error: the curve then ends below one, by the
    share of such objects.
    - Outage: share of objects and slots with beams whose rate is at or below a value; the
    scheme's rate floor is marked if it has one.
    """
    source.check("rate", "present", "truth", "estimated", "mode")
    if not source.result.sizes["object"]:
        return empty_figure(source, "distribution", "no objects: nothing to measure")
    samples = {name: _samples(source, index) for index, name in enumerate(source.names)}
    series = [
        tuple(_cumulative(name, samples[name][number], source.looks[name]) for name in source.names)
        for number in range(3)
    ]
    low = min((float(one.x[0]) for one in series[1] if one.x[0] > 0), default=None)
    ground = source.scenario.geometry == "ground"
    error, unit = ("position", "m") if ground else ("angle", "deg")
    part = "frame" if source.frame == source.scenario.frame.slots_per_frame else "trial"
    slots = f"{'frames of ' * (part == 'frame')}{source.frame} slot{'s' * (source.frame > 1)}"
    panels = (
        Panel(Axis(f"Mean sum rate of a {part}", "bit/s/Hz"),
              Axis(f"Share of {part}s at or below", limits=_SHARE),
              series[0], f"Rate ({slots})", empty="no rates"),
        Panel(Axis(f"Size of the {error} error", unit, log=True, limits=(low, None)),
              Axis("Share of estimates at or below", limits=_SHARE),
              series[1], f"{error.capitalize()} error", empty="no estimates"),
        Panel(Axis("Rate of an object", "bit/s/Hz"), Axis("Outage probability", limits=_SHARE),
              series[2], "Outage", _floors(source), empty="no beams"),
    )  # fmt: skip
    return FigureData("distribution", source.title, panels, source.setting(), size=(7.16, 2.6))


def _samples(source: Source, index: int) -> tuple[Array, Array, Array]:
    """Return a scheme's rates of frames, errors, and rates of objects.

    Errors are those of the angle in degrees, on the ground those of the position in m.

    A missing estimate counts as an infinite error.
    """
    one = source.result[["rate", "present", "truth", "estimated", "mode"]]
    one = one.isel(scheme=index, slot=source.shown).transpose("trial", "slot", "object", "state")
    present = one["present"].values.astype(bool)
    sum_rate = source.parts[source.names[index]]["sum_rate"][:, source.shown]
    frames = sum_rate.reshape(source.trials, -1, source.frame).mean(axis=-1)
    geometry = geometry_of(source.scenario)
    errors = posterior_errors(one["estimated"].values, one["truth"].values, geometry.space)[present]
    if geometry.axes == 1:
        error = np.abs(np.degrees(errors[:, 0]))
    else:
        error = np.hypot(errors[:, 0], errors[:, 1])
    directional = present & with_beams(one["mode"].values)[..., None]
    return frames.ravel(), np.where(np.isfinite(error), error, np.inf), one["rate"].values[
        directional
    ]  # fmt: skip


def _cumulative(name: str, samples: npt.ArrayLike, look: Look) -> Series:
    """Return an empirical distribution at no more than `_POINTS` of its steps."""
    ordered = np.sort(np.asarray(samples, dtype=float))
    ordered = ordered[~np.isnan(ordered)]
    finite = int(np.isfinite(ordered).sum())
    if not finite:
        return Series(name, np.full(1, np.nan), np.full(1, np.nan), look=look)
    first = ordered.size // 100  # a logarithmic axis would mostly show the smallest
    steps = np.unique(np.linspace(first, finite - 1, min(finite, _POINTS)).round().astype(int))
    return Series(name, ordered[steps], (steps + 1) / ordered.size, look=look.plain(), kind="line")


def _floors(source: Source) -> tuple[Guide, ...]:
    floors = {system_for(source.scenario, name).coverage.min_rate for name in source.names}
    return tuple(
        Guide("x", floor, look=Look(FAINT, "", (0, (2.0, 1.5))), name="rate floor of the design")
        for floor in sorted(floors)
        if floor > 0
    )
