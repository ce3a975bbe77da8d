"""Pictures of a result: each kind is a function from a result to a record of all numbers shown.

Read `record` first: a `FigureData` holds panels of labelled series. `drawing` makes a picture of
it, `saving` a file. A new kind is a function in a new file and a line in `KINDS`, or in `OF_TRACKS`
if it draws what only unlabelled runs have. The package does not use pyplot or its global state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from echobeam.plots.consistency import consistency
from echobeam.plots.cosines import cosine_patterns
from echobeam.plots.distribution import distribution
from echobeam.plots.forecast import forecast
from echobeam.plots.gospa import gospa
from echobeam.plots.ground_map import ground_map
from echobeam.plots.ground_tracks import ground_tracks
from echobeam.plots.patterns import patterns
from echobeam.plots.rate import rate
from echobeam.plots.record import FigureData
from echobeam.plots.source import Choice, PlotError, Source
from echobeam.plots.sweep import sweep
from echobeam.plots.tracking import tracking
from echobeam.plots.tracks import tracks
from echobeam.plots.trajectories import trajectories

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["KINDS", "OF_TRACKS", "SWEEP", "Choice", "FigureData", "PlotError", "Source", "figures"]

KINDS: dict[str, Callable[[Source], FigureData]] = {
    "rate": rate,
    "tracking": tracking,
    "patterns": patterns,
    "trajectories": trajectories,
    "consistency": consistency,
    "forecast": forecast,
    "distribution": distribution,
}
"""Kinds of pictures of a run, with the functions that make their records."""

OF_TRACKS: dict[str, Callable[[Source], FigureData]] = {"tracks": tracks, "gospa": gospa}
"""The same of unlabelled runs, besides the others."""

ON_GROUND: dict[str, Callable[[Source], FigureData]] = {
    "map": ground_map,
    "patterns": cosine_patterns,
    "tracks": ground_tracks,
}
"""The same of runs with ``geometry = "ground"``, in place of the others of these names."""

SWEEP = "sweep"
"""Kind of the picture of a sweep."""


def figures(
    result: xr.Dataset, kinds: Sequence[str] = (), choice: Choice | None = None
) -> dict[str, FigureData]:
    """Return the figures of a run's or a sweep's result, by kind.

    Parameters
    ----------
    result
        A result of a run, or of a sweep.
    kinds
        Keys of `KINDS`, `OF_TRACKS` and `ON_GROUND`, or ``sweep``; by default all that the result
        has.
    choice
        Choice of schemes, trial, slots and quantity.

    Raises
    ------
    PlotError
        If a kind is unknown, or the result lacks what it needs.
    """
    chosen = Choice() if choice is None else choice
    of_sweep, of_run = "vary" in result.attrs, list(KINDS | OF_TRACKS | ON_GROUND)
    known = [SWEEP] if of_sweep else of_run
    unknown = [kind for kind in kinds if kind not in known]
    if unknown:
        what = "a sweep" if of_sweep else "a run"
        raise PlotError(
            f"no such picture of {what}: {', '.join(unknown)}; there are {', '.join(known)}"
        )
    if of_sweep:
        return {SWEEP: sweep(result, chosen)}
    source = Source(result, chosen)
    of_geometry = _of_geometry(source, kinds)
    asked = list(kinds) or [
        kind for kind in of_geometry if kind not in OF_TRACKS or source.unlabelled
    ]
    without = [kind for kind in asked if kind in OF_TRACKS and not source.unlabelled]
    if without:
        raise PlotError(
            f"no picture of {', '.join(without)}: the detections of this run are labelled, so it "
            'has no tracks of their own (radar.detections = "unlabelled")'
        )
    return {kind: of_geometry[kind](source) for kind in asked}


def _of_geometry(source: Source, kinds: Sequence[str]) -> dict[str, Callable[[Source], FigureData]]:
    """Return the kinds of pictures that a run of this geometry has.

    Raises
    ------
    PlotError
        If others were asked for.
    """
    there = KINDS | OF_TRACKS
    ground = source.scenario.geometry == "ground"
    if ground:
        there = there | ON_GROUND
    other = [kind for kind in kinds if kind not in there]
    if other:
        raise PlotError(
            f'no picture of {", ".join(other)} with geometry = "{source.scenario.geometry}"; there '
            f"are {', '.join(there)}"
        )
    return there
