"""Pictures of a result: one file per picture, one style for all.

Each picture is a function from a result (the `xarray.Dataset` of a run) to a matplotlib
`Figure`; `save` writes it. Nothing here touches pyplot or its global state.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from echobeam.plots import consistency, forecast, patterns, rate, tracking, trajectories
from echobeam.plots.saving import picture_format, save
from echobeam.plots.setting import PlotError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "PlotError", "draw_all", "picture_paths", "save"]

KINDS: dict[str, Callable[[xr.Dataset], Figure]] = {
    "rate": rate.draw,
    "tracking": tracking.draw,
    "patterns": patterns.draw,
    "trajectories": trajectories.draw,
    "consistency": consistency.draw,
    "forecast": forecast.draw,
}
"""Every kind of picture and the function that draws it."""


def picture_paths(
    out_stem: str | os.PathLike[str], suffix: str = ".png", kinds: Iterable[str] | None = None
) -> dict[str, Path]:
    """Return where `draw_all` writes each kind of picture: ``<stem>-<kind>.<suffix>``.

    Raises
    ------
    PlotError
        If a kind or the suffix is not known.
    """
    chosen = list(KINDS if kinds is None else kinds)
    unknown = [kind for kind in chosen if kind not in KINDS]
    if unknown:
        raise PlotError(f"no such picture: {', '.join(unknown)}; there are {', '.join(KINDS)}")
    stem, ending = Path(out_stem), picture_format(suffix)
    return {kind: stem.with_name(f"{stem.name}-{kind}.{ending}") for kind in chosen}


def draw_all(
    result: xr.Dataset,
    out_stem: str | os.PathLike[str],
    suffix: str = ".png",
    kinds: Iterable[str] | None = None,
) -> list[Path]:
    """Draw a result in every way and return the pictures' paths.

    Parameters
    ----------
    result
        A result of a run.
    out_stem
        Path whose name the pictures' names begin with: ``out/run`` gives ``out/run-rate.png``, ...
    suffix
        ``.png``, ``.pdf`` or ``.svg``.
    kinds
        Keys of `KINDS`; all of them by default.

    Raises
    ------
    PlotError
        If the result lacks what a picture needs, or a kind or the suffix is not known.
    OSError
        If a picture cannot be written.
    """
    paths = picture_paths(out_stem, suffix, kinds)
    return [save(KINDS[kind](result), path) for kind, path in paths.items()]
