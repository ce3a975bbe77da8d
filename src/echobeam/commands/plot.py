"""Pictures of results: the command `echobeam plot`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, SupportsIndex

from echobeam.commands.asking import scheme_names
from echobeam.numerals import whole
from echobeam.plots import SWEEP, Choice, PlotError, figures
from echobeam.plots.saving import file_format, write
from echobeam.store.result import VARY, open_any
from echobeam.store.writing import check_writable

if TYPE_CHECKING:
    import xarray as xr

    from echobeam.plots.drawing import Picture


def plot(
    result: xr.Dataset | str | PathLike[str],
    kind: str | None = None,
    *,
    schemes: str | Sequence[str] | None = None,
    trial: SupportsIndex = 0,
    slots: SupportsIndex | Sequence[SupportsIndex] = (),
    x: str | None = None,
    quantity: str | None = None,
    title: str | None = None,
    captions: bool = True,
    out: str | PathLike[str] | None = None,
    scheme: str | Sequence[str] | None = None,
) -> Picture:
    """Draw a result of a run or of a sweep: `echobeam plot`, one picture.

    Parameters
    ----------
    result
        A result, or the path of its file.
    kind
        ``"rate"``, ``"tracking"``, ``"patterns"``, ``"trajectories"``, ``"consistency"``,
        ``"forecast"`` or ``"distribution"`` of a run, ``"sweep"`` of a sweep; by default the rate
        of a run and the only picture of a sweep.
    schemes, scheme
        Names of the schemes shown; all by default. Patterns and trajectories show the first.
    trial
        Trial of the patterns and trajectories, counted from 0 as in the file.
    slots
        Slots of the patterns, and the range of the other pictures, counted from 1.
    x, quantity
        For a sweep: the key on the x axis and the quantity on the y axis, such as ``"outage"``.
    title
        Title instead of the scenario's name.
    captions
        Whether title and setting are written into the picture.
    out
        File to write: ``.png``, ``.pdf``, ``.svg``, or its numbers as ``.csv``, ``.json``.

    Returns
    -------
    matplotlib.figure.Figure
        Independent of pyplot: a notebook shows it, ``savefig`` writes it, no need to close it.

    Raises
    ------
    InputError
        If the result lacks the requested quantity.
    """
    from echobeam.plots.drawing import draw

    numbers = [slots] if isinstance(slots, SupportsIndex) else list(slots)
    choice = Choice(
        scheme_names(schemes, scheme),
        _whole(trial, "trial"),
        tuple(_whole(slot, "slots") for slot in numbers),
        x,
        quantity,
        title,
    )
    with _opened(result) as dataset:
        name = kind or (SWEEP if VARY in dataset.attrs else "rate")
        data = figures(dataset, [name], choice)[name]
    if out is not None:
        write(data, Path(out), captions=captions)
    return draw(data, captions=captions)


def _opened(
    result: xr.Dataset | str | PathLike[str],
) -> AbstractContextManager[xr.Dataset]:
    """Return an open result unchanged, or one opened from its file and closed afterwards."""
    if isinstance(result, str | PathLike):
        return closing(open_any(fspath(result)))
    return nullcontext(result)


def record_pictures(
    result: Path, out: Path | None, kinds: Sequence[str], choice: Choice
) -> Iterator[Path]:
    """Write pictures of a result file beside it or ``out``, and yield their paths."""
    suffix = file_format((out.suffix if out else "") or ".png")
    with open_any(result) as dataset:
        target = out or result
        for kind, data in figures(dataset, kinds, choice).items():
            name = target.stem if kind == SWEEP else f"{target.stem}-{kind}"
            path = target.parent / f"{name}.{suffix}"
            check_writable(path, force=True)
            yield write(data, path)


def _whole(number: SupportsIndex, name: str) -> int:
    """Return a whole number as an int."""
    found = whole(number)
    if found is None:
        raise PlotError(f"{name}: {number!r} is not accepted; expected a whole number")
    return found
