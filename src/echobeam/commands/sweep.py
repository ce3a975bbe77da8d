"""Grids of scenarios to one tidy result: what `echobeam sweep` does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, SupportsIndex

import numpy as np

from echobeam.commands.asking import Request, Settings, request, target
from echobeam.commands.progress import Bar, interactive_bar
from echobeam.faults import InputError
from echobeam.numerals import plain
from echobeam.scenario.dump import value_text
from echobeam.scenario.load import Source
from echobeam.store.recorded import Done
from echobeam.sweeps.grid import Grid, Varied, read_varied, together
from echobeam.sweeps.recorded import Sweep, open_sweep, record_sweep
from echobeam.traces.progress import reading_shown

if TYPE_CHECKING:
    import xarray as xr

Vary = (
    Mapping[str, object]
    | Mapping[tuple[str, ...], object]
    | Mapping[str | tuple[str, ...], object]
    | Sequence[str]
)
"""Axes of a grid: ``{"array.n_tx": [16, 32]}``, or texts ``"array.n_tx=16,32"``."""


def sweep(
    scenario: Source,
    vary: Vary,
    *,
    schemes: str | Sequence[str] | None = None,
    trials: SupportsIndex | None = None,
    seed: SupportsIndex = 0,
    out: str | PathLike[str] | None = None,
    csv: str | PathLike[str] | None = None,
    full: bool = False,
    set: Settings | None = None,
    trace: str | PathLike[str] | None = None,
    jobs: SupportsIndex = 1,
    dask: str | None = None,
    resume: bool = False,
    force: bool = False,
    quiet: bool = False,
    scheme: str | Sequence[str] | None = None,
) -> xr.Dataset:
    """Run a grid of scenarios, write one tidy result and open it: `echobeam sweep`.

    Parameters
    ----------
    scenario
        A scenario, a built-in scenario's name, or the path of a scenario file.
    vary
        Dotted keys with their values, ``{"array.n_tx": [16, 32], "radio.power": [1, 10]}``; several
        make a product. A tuple of keys, or a text of some with commas, varies them together, each
        point a value for all or a tuple with one for each,
        ``{("array.n_tx", "array.n_rx"): [16, (32, 30)]}``. Or texts as on the command line,
        ``["array.n_tx=16,32"]``.
    csv
        A table of the figures too.
    full
        Keep every point's full result too, in a directory beside ``out``.
    schemes, scheme, trials, seed, set, trace, jobs, dask, resume, force, quiet
        As for `run`, at every point, on the same random numbers.
    out
        The result file; the scenario's name with ``-sweep.nc``, here, if left out.

    Returns
    -------
    xarray.Dataset
        Every quantity of the summary, with a dimension for each varied key.

    Raises
    ------
    InputError
        If what was given cannot be used; all faults in one message.
    RunError
        If the work could not be finished; what is done is kept for ``resume``.
    """
    asked = request(
        scenario,
        schemes=schemes,
        scheme=scheme,
        trials=trials,
        seed=seed,
        set=set,
        trace=trace,
        jobs=jobs,
        dask=dask,
        resume=resume,
        force=force,
    )
    places = (None if path is None else Path(path) for path in (out, csv))
    bar = partial(interactive_bar, quiet=quiet)
    return open_sweep(record_grid(asked, axes_of(vary), *places, full=full, bar=bar).out)


class SweepDone(NamedTuple):
    """A sweep that is done: the grid over which scenario, where it is, what there was to do."""

    grid: Grid
    name: str
    out: Path
    done: Done


def record_grid(
    wanted: Request,
    axes: Sequence[Callable[[], Varied]],
    out: Path | None,
    csv: Path | None,
    *,
    full: bool,
    bar: Bar,
) -> SweepDone:
    """Run what is requested over a grid to its files; for commands and `sweep` alike."""
    asked = wanted.read(axes)
    name = asked.scenario.name
    grid = Grid(wanted.source, wanted.overrides, tuple(axis() for axis in axes), wanted.trace)
    whole = Sweep(
        grid,
        wanted.schemes,
        None if wanted.trials is None else asked.trials,
        asked.seed,
        target(out, f"{name}-sweep.nc"),
        csv,
        full,
        wanted.workers,
        wanted.resume,
        wanted.force,
    )
    with reading_shown(bar), bar(f"{name}: {grid.size} points") as progress:
        done = record_sweep(whole, progress)
    return SweepDone(grid, name, whole.out, done)


def axes_of(vary: Vary) -> list[Callable[[], Varied]]:
    """Return the axes of a grid, each to be read with all other input.

    Raises
    ------
    InputError
        If a key has no list of values, or a value is none that a scenario could hold.
    """
    if isinstance(vary, str):
        return [partial(read_varied, vary)]
    if not isinstance(vary, Mapping | Iterable):
        raise InputError(
            f"vary: {vary!r} is not accepted; expected keys and their values, such as "
            '{"array.n_tx": [16, 32]}'
        )
    if not isinstance(vary, Mapping):
        return [partial(read_varied, str(text)) for text in vary]
    return [_axis(key, values) for key, values in vary.items()]


def _axis(key: str | tuple[str, ...], values: object) -> Callable[[], Varied]:
    keys = tuple(part.strip() for part in key.split(",")) if isinstance(key, str) else key
    if not isinstance(keys, tuple) or not all(isinstance(one, str) and one for one in keys):
        raise InputError(
            f"vary {key!r}: no key; expected a dotted text such as 'uav.height', or a tuple of some"
        )
    name = ",".join(keys)
    listed = values.tolist() if isinstance(values, np.ndarray) else values
    if isinstance(listed, str | Mapping) or not hasattr(listed, "__iter__"):
        raise InputError(f"vary {name}: {values!r} is not accepted; expected a list of values")
    return partial(together, keys, [_point(name, len(keys), value) for value in listed])


def _point(name: str, count: int, value: object) -> tuple[str, ...]:
    """Return the texts of one point's values, one for each key."""
    value = plain(value)
    if count > 1 and isinstance(value, list | tuple):
        return tuple(_text(name, one) for one in value)
    return (_text(name, value),) * count


def _text(name: str, value: object) -> str:
    try:
        text = value if isinstance(value, str) else value_text(value)
    except TypeError:
        text = ""
    if not text:
        raise InputError(
            f"vary {name}: {value!r} is not accepted; expected a text, a number or a list"
        )
    return text
