"""Loading of a trace file as the motion of the vehicles that a UAV serves."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from echobeam.traces.breaks import unbroken, whole
from echobeam.traces.collect import CONTEXT, OffRoad, Window, collect
from echobeam.traces.jitter import without_jitter
from echobeam.traces.motion import sight, sight_on_plane
from echobeam.traces.progress import meter
from echobeam.traces.repair import repair, spacing
from echobeam.traces.road import Road
from echobeam.traces.sample import SHORTEST_STEP, TraceWarning, fault
from echobeam.traces.service import TraceMotion, serve
from echobeam.traces.source import read_samples
from echobeam.traces.standing import Standing
from echobeam.traces.survey import Survey, extent_on, survey_trace
from echobeam.values import Array


def load_motion(
    path: str | Path,
    times: npt.ArrayLike,
    *,
    uav_x: npt.ArrayLike,
    max_objects: int,
    range_m: float,
    road: Road | None = None,
    origin: float | tuple[float, float] | None = None,
    start: float | None = None,
) -> TraceMotion:
    """Return the vehicles of a trace that a UAV serves, slot by slot.

    The file is read twice, sample by sample: first for its errors, time span, road and extent, then
    for the samples of these slots and this stretch of road. (A third time if some of the traffic
    is off the fitted road.) Data that are omitted or reinterpreted are reported by a
    `TraceWarning`.

    Parameters
    ----------
    path
        SUMO FCD XML or CSV with the header ``t,id,x,y[,speed]``, either may be gzip-compressed.
    times
        ``(slots,)`` s, increasing: times of the slots; only their differences matter.
    uav_x
        Point below the UAV, m along the road from its origin; scalar or ``(slots,)``. In a plane
        two coordinates, ``(2,)`` or ``(slots, 2)``.
    max_objects
        Largest number of vehicles served at once, from 0.
    range_m
        Largest distance along the road, or in the plane, from the point below the UAV to a served
        vehicle, m.
    road
        Axis of the road; `PLANE` for positions in two dimensions, not projected on any; default:
        fitted to the vehicles' paths.
    origin
        Position of x = 0, m along the road's axis; default: the middle of the stretch with
        vehicles anywhere in the trace. In a plane a point, default: the middle of their rectangle.
    start
        Time of the trace at slot 1, s; default: that of its first sample.

    Raises
    ------
    TraceError
        If the trace cannot be used or is inconsistent, or ends before the first or begins
        after the last slot.
    ValueError
        If another argument is not accepted.
    """
    file = Path(path)
    plane = road is not None and road.plane
    clock, ground = _checked(times, uav_x, max_objects, range_m, origin, start, plane)
    if os.path.exists(file) and not (os.path.isfile(file) or os.path.isdir(file)):
        raise fault(file, None, "is a pipe or device; accepted is a file that can be read twice")
    survey = survey_trace(file, read_samples(file, meter(file, 0, 2)), road)
    clock += survey.first if start is None else start
    _check_overlap(file, survey, clock)
    zero = np.asarray(_middle(file, survey) if origin is None else origin, dtype=float)
    below = ground.reshape(clock.size, -1)[:, 0] + zero.ravel()[0]
    window = Window(
        begin=clock[0] - SHORTEST_STEP - _rounding(survey),
        end=clock[-1] + SHORTEST_STEP + _rounding(survey),
        low=below.min() - range_m,
        high=below.max() + range_m,
    )
    off = OffRoad()
    again = read_samples(file, meter(file, 1, 2))
    visits = unbroken(again, {}) if survey.broken else whole(again)
    standing = Standing(survey.road, clock[0])
    samples = collect(standing.watched(visits), survey.road, window, off, _context(survey))
    repaired = repair(samples, survey)
    smooth = without_jitter(repaired.samples, plane=survey.road.plane)
    if smooth.nobody:
        raise fault(file, None, smooth.note)
    left_out = [f"{smooth.note}; left out"] if smooth.note else []
    for note in (*survey.notes, *_notes(survey, off), *repaired.notes, *left_out):
        warnings.warn(f"{file}: {note}", TraceWarning, stacklevel=2)
    sightings = (sight_on_plane if survey.road.plane else sight)(smooth.samples, clock)
    sightings = replace(sightings, position=sightings.position - zero)
    outside = np.flatnonzero((clock < survey.first) | (clock > survey.last))
    if outside.size:
        note = (
            f"{outside.size} of {clock.size} slots, first slot {outside[0] + 1}, are outside the "
            f"trace, which runs from {survey.first:g} s to {survey.last:g} s: nobody is there"
        )
        warnings.warn(f"{file}: {note}", TraceWarning, stacklevel=2)
    heading = standing.headings(samples.names)
    motion = serve(sightings, samples.names, heading, ground, max_objects, range_m, survey.dropped)
    if max_objects and not motion.present.any():
        note = f"no vehicle comes within {range_m:g} m of the UAV in these slots: none is served"
        warnings.warn(f"{file}: {note}", TraceWarning, stacklevel=2)
    return motion


def _middle(file: Path, survey: Survey) -> float | tuple[float, float]:
    """Return the middle of the stretch of road, or of the rectangle, with vehicles."""
    extent = survey.extent or extent_on(survey.road, read_samples(file))
    if survey.road.plane:
        assert survey.width is not None
        return sum(extent) / 2, sum(survey.width) / 2
    return sum(extent) / 2


def _rounding(survey: Survey) -> float:
    """Return the largest correction of times, s."""
    return 0.0 if survey.step is None else survey.step.digit


def _context(survey: Survey) -> int:
    """Return the number of samples on which the motion around an interval depends."""
    return (CONTEXT + 1) * max(1, math.ceil(spacing(survey) / survey.period))


def _notes(survey: Survey, off: OffRoad) -> Iterator[str]:
    """Yield a sentence on the vehicles off the road, if there are any."""
    if off.first is not None:
        count = len(off.farthest)
        yield (
            f"{count} of {survey.vehicles} vehicles {'is' if count == 1 else 'are'} off the road "
            f"(more than {survey.road.half_width:g} m from its axis, up to "
            f"{max(off.farthest.values()):.4g} m) in some samples or all, first "
            f"{off.first.name!r} in line {off.first.line}: not served there"
        )


def _checked(
    times: npt.ArrayLike,
    uav_x: npt.ArrayLike,
    max_objects: int,
    range_m: float,
    origin: float | tuple[float, float] | None,
    start: float | None,
    plane: bool,
) -> tuple[Array, Array]:
    """Return the times of the slots relative to the first, and the points below the UAV."""
    clock = np.array(times, dtype=float)
    if clock.ndim != 1 or clock.size == 0 or not np.isfinite(clock).all():
        raise ValueError("times must be finite, of shape (slots,), with at least one slot")
    if (np.diff(clock) <= 0).any():
        raise ValueError("times must increase")
    axes = (2,) if plane else ()
    ground = np.broadcast_to(np.asarray(uav_x, dtype=float), (*clock.shape, *axes))
    if not np.isfinite(ground).all():
        raise ValueError("uav_x must be finite")
    if max_objects < 0 or max_objects != int(max_objects):
        raise ValueError(f"max_objects must be a whole number from 0, not {max_objects!r}")
    if not 0 < range_m < float("inf"):
        raise ValueError(f"range_m must be positive and finite, not {range_m!r}")
    for name, value in (("origin", origin), ("start", start)):
        if value is not None and not np.isfinite(value).all():
            raise ValueError(f"{name} must be finite, not {value!r}")
    if origin is not None and np.shape(origin) != axes:
        raise ValueError(f"origin must be {'a point' if plane else 'a number'}, not {origin!r}")
    return clock - clock[0], ground


def _check_overlap(path: Path, survey: Survey, clock: Array) -> None:
    if clock[-1] < survey.first or clock[0] > survey.last:
        raise fault(
            path,
            None,
            f"the slots run from t = {clock[0]:g} s to {clock[-1]:g} s, the trace from "
            f"{survey.first:g} s to {survey.last:g} s; accepted is a start at which they meet",
        )
