"""Pictures of a result: each kind is a function from a result to a record of all numbers shown.

Read `record` first: a `FigureData` holds panels of labelled series. `drawing` makes a picture of
it, `saving` a file. A new kind is a function in a new file and a line in `KINDS`. The package does
not use pyplot or its global state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from echobeam.plots.consistency import consistency
from echobeam.plots.distribution import distribution
from echobeam.plots.forecast import forecast
from echobeam.plots.patterns import patterns
from echobeam.plots.rate import rate
from echobeam.plots.record import FigureData
from echobeam.plots.source import Choice, PlotError, Source
from echobeam.plots.sweep import sweep
from echobeam.plots.tracking import tracking
from echobeam.plots.trajectories import trajectories

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["KINDS", "SWEEP", "Choice", "FigureData", "PlotError", "Source", "figures"]

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
        Keys of `KINDS`, or ``sweep``; all by default.
    choice
        Choice of schemes, trial, slots and quantity.

    Raises
    ------
    PlotError
        If a kind is unknown, or the result lacks what it needs.
    """
    chosen = Choice() if choice is None else choice
    of_sweep = "vary" in result.attrs
    known = [SWEEP] if of_sweep else list(KINDS)
    unknown = [kind for kind in kinds if kind not in known]
    if unknown:
        what = "a sweep" if of_sweep else "a run"
        raise PlotError(
            f"no such picture of {what}: {', '.join(unknown)}; there are {', '.join(known)}"
        )
    if of_sweep:
        return {SWEEP: sweep(result, chosen)}
    source = Source(result, chosen)
    return {kind: KINDS[kind](source) for kind in kinds or known}
