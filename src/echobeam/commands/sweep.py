"""Grids of scenarios to one tidy result: what `echobeam sweep` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, SupportsIndex, TypeVar

import numpy as np

from echobeam.commands.asking import Request, Settings, request, target
from echobeam.commands.progress import Bar, interactive_bar
from echobeam.faults import InputError
from echobeam.numerals import plain
from echobeam.scenario.dump import value_text
from echobeam.scenario.load import Source
from echobeam.store.recorded import Done
from echobeam.sweeps.grid import Grid, read_varied
from echobeam.sweeps.recorded import Sweep, open_sweep, record_sweep
from echobeam.traces.progress import reading_shown

if TYPE_CHECKING:
    import xarray as xr

Key = TypeVar("Key", bound=Sequence[str])
"""Dotted key of a scenario, or a tuple of keys that vary together."""

Vary = Mapping[Key, object] | Sequence[str]
"""Axes of a grid: ``{"array.n_tx": [16, 32]}``, or texts ``"array.n_tx=16,32"``."""


def sweep(
    scenario: Source,
    vary: Vary[Key],
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
        make a product. A tuple of keys varies them together. Or texts as on the command line,
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
    return open_sweep(record_grid(asked, varied_texts(vary), *places, full=full, bar=bar).out)


class SweepDone(NamedTuple):
    """A sweep that is done: the grid over which scenario, where it is, what there was to do."""

    grid: Grid
    name: str
    out: Path
    done: Done


def record_grid(
    wanted: Request,
    varied: Sequence[str],
    out: Path | None,
    csv: Path | None,
    *,
    full: bool,
    bar: Bar,
) -> SweepDone:
    """Run what is requested over a grid to its files; for commands and `sweep` alike."""
    axes = [partial(read_varied, text) for text in varied]
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


def varied_texts(vary: Vary[Key]) -> tuple[str, ...]:
    """Return the axes of a grid as texts ``KEY=V1,V2,...``.

    Raises
    ------
    InputError
        If a key has no list of values, or a value is none that a text could say.
    """
    if isinstance(vary, str):
        return (vary,)
    if not isinstance(vary, Mapping):
        return tuple(map(str, vary))
    return tuple(_varied(key, values) for key, values in vary.items())


def _varied(key: Sequence[str], values: object) -> str:
    keys = (key,) if isinstance(key, str) else tuple(key)
    name = ",".join(keys)
    listed = values.tolist() if isinstance(values, np.ndarray) else values
    if isinstance(listed, str | Mapping) or not hasattr(listed, "__iter__"):
        raise InputError(f"vary {name}: {values!r} is not accepted; expected a list of values")
    return f"{name}={','.join(_value(name, len(keys), value) for value in listed)}"


def _value(name: str, count: int, value: object) -> str:
    """Return a value as a text; of keys varied together the one that all of them have."""
    value = plain(value)
    if count > 1 and isinstance(value, list | tuple):
        if len(value) != count or any(item != value[0] for item in value):
            raise InputError(
                f"vary {name}: {value!r} is not accepted; keys that vary together have one value"
            )
        value = value[0]
    try:
        text = value if isinstance(value, str) else value_text(value)
    except TypeError:
        text = ""
    if not text or (isinstance(value, str) and "," in value):
        raise InputError(
            f"vary {name}: {value!r} is not accepted; expected a text without commas or a number"
        )
    return text
