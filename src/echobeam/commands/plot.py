"""Pictures of results: the command `echobeam plot`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, SupportsIndex

from echobeam.commands.asking import scheme_names
from echobeam.commands.results import opened
from echobeam.faults import RunError
from echobeam.numerals import whole
from echobeam.plots import SWEEP, Choice, FigureData, PlotError, figures
from echobeam.plots.saving import file_format, write
from echobeam.plots.sweep import QUANTITY
from echobeam.simulation.quantities import errors_in, per_slot
from echobeam.store.result import VARY
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
    slots: SupportsIndex | Iterable[SupportsIndex] = (),
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
        ``"forecast"`` or ``"distribution"`` of a run, ``"tracks"`` or ``"gospa"`` of an unlabelled
        one, ``"map"`` of one on the ground, ``"sweep"`` of a sweep; by default the rate of a run
        and the only picture of a sweep.
    schemes, scheme
        Names of the schemes shown; all by default. Map, patterns, trajectories and tracks
        show the first.
    trial
        Trial of the patterns, trajectories and tracks, counted from 0 as in the file.
    slots
        Slots shown, counted from 1; trajectories, tracks and forecasts take the range from
        first to last.
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

    choice = Choice(
        scheme_names(schemes, scheme),
        _whole(trial, "trial"),
        _slots(slots),
        x,
        quantity,
        None if title is None else readable(str(title)),
    )
    if not isinstance(kind, str | None):
        raise PlotError(f"kind: {kind!r} is not accepted; expected a text, one picture at a time")
    with opened(result) as dataset:
        _check_choice(dataset, choice)
        name = kind or (SWEEP if VARY in dataset.attrs else "rate")
        data = figures(dataset, [name], choice)[name]
    if out is not None:
        _write(data, Path(out), captions=captions)
    return draw(data, captions=captions)


def record_pictures(
    result: Path, out: Path | None, kinds: Sequence[str], choice: Choice
) -> Iterator[Path]:
    """Write pictures of a result file beside it or ``out``, and yield their paths."""
    suffix = file_format((out.suffix if out else "") or ".png")
    with opened(result) as dataset:
        _check_choice(dataset, choice)
        target = out or result
        for kind, data in figures(dataset, kinds, choice).items():
            name = target.stem if kind == SWEEP else f"{target.stem}-{kind}"
            yield _write(data, target.parent / f"{name}.{suffix}", captions=True)


def readable(text: str) -> str:
    """Return a text of the command line as letters, also where the locale knows none of them."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def _write(data: FigureData, path: Path, *, captions: bool) -> Path:
    """Write a figure; a fault names the file."""
    file_format(path.suffix)
    check_writable(path, force=True)
    try:
        return write(data, path, captions=captions)
    except OSError as error:
        raise RunError(f"{path}: cannot be written: {error.strerror or error}") from None


def _check_choice(dataset: xr.Dataset, choice: Choice) -> None:
    """Refuse a choice that the picture of this result would pass over.

    Raises
    ------
    PlotError
        Names what was chosen and where it belongs.
    """
    twice = next((name for name in choice.schemes if choice.schemes.count(name) > 1), None)
    if twice is not None:
        raise PlotError(f"scheme {twice!r} is asked for twice; give each one once")
    if VARY not in dataset.attrs:
        for word, given in (("x", choice.x), ("quantity", choice.quantity)):
            if given is not None:
                raise PlotError(
                    f"--{word} {given}: belongs to the picture of a sweep, not of a run"
                )
        return
    if choice.trial:
        raise PlotError(f"--trial {choice.trial}: belongs to pictures of a run, not of a sweep")
    name = choice.quantity or QUANTITY
    if not choice.slots or name not in dataset:
        return
    if "slot" not in dataset[name].dims:
        of_slots = ", ".join(per_slot(unlabelled="gospa" in dataset, errors=errors_in(dataset)))
        raise PlotError(f"--slots: {name} is of the whole run; {of_slots} have slots")
    numbers = dataset["slot"].values.tolist()
    if len(choice.slots) > 1 or choice.slots[0] not in numbers:
        raise PlotError(
            f"--slots {', '.join(map(str, choice.slots))}: expected one slot of the sweep, "
            f"from {numbers[0]} to {numbers[-1]}"
        )


def _slots(slots: SupportsIndex | Iterable[SupportsIndex]) -> tuple[int, ...]:
    """Return the numbers of slots, of one or of several of any kind."""
    one = whole(slots)
    if one is not None:
        return (one,)
    if isinstance(slots, str) or not isinstance(slots, Iterable):
        raise PlotError(
            f"slots: {slots!r} is not accepted; expected whole numbers, such as [2, 4, 10]"
        )
    return tuple(dict.fromkeys(_whole(slot, "slots") for slot in slots))


def _whole(number: SupportsIndex, name: str) -> int:
    """Return a whole number as an int."""
    found = whole(number)
    if found is None:
        raise PlotError(f"{name}: {number!r} is not accepted; expected a whole number")
    return found
