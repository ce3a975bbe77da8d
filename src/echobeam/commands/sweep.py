"""Grids of scenarios to one tidy result: the command `echobeam sweep`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
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
from echobeam.store.recording import Done
from echobeam.sweeps.grid import Grid, Varied, read_varied, together
from echobeam.sweeps.recording import Sweep, open_sweep, record_sweep
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
        make a product. A tuple of keys, or a text of some with commas, varies them together, each
        point a value for all or a tuple with one for each,
        ``{("array.n_tx", "array.n_rx"): [16, (32, 30)]}``. Or texts as on the command line,
        ``["array.n_tx=16,32"]``.
    csv
        Path of a CSV table of the quantities, if wanted.
    full
        Whether to store the full result of every point too, in a directory beside ``out``.
    schemes, scheme, trials, seed, set, trace, jobs, dask, resume, force, quiet
        As for `run`, at every point, with the same random numbers.
    out
        Result file; by default the name of the scenario or of its file with ``-sweep.nc``, in the
        current directory.

    Returns
    -------
    xarray.Dataset
        Every quantity of the summary, with a dimension for each varied key.

    Raises
    ------
    InputError
        If the input is wrong; all errors in one message.
    RunError
        If the sweep could not be finished; its finished blocks are stored for ``resume``.
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
    """Finished sweep: its grid, the scenario's name, the path of its result, and the work done."""

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
    """Run a request over a grid and write its files, for the command and `sweep` alike."""
    places = [partial(wanted.check_place, path) for path in (out, csv)]
    asked = wanted.read([*axes, *places])
    name = asked.scenario.name
    grid = Grid(wanted.source, wanted.overrides, tuple(axis() for axis in axes), wanted.trace)
    whole = Sweep(
        grid,
        wanted.schemes,
        None if wanted.trials is None else asked.trials,
        asked.seed,
        target(out, wanted.source, asked.scenario, "-sweep.nc"),
        csv,
        full,
        wanted.workers,
        wanted.resume,
        wanted.force,
    )
    with reading_shown(bar), bar(f"{name}: {grid.size} points") as progress:
        done = record_sweep(whole, progress)
    return SweepDone(grid, name, whole.out, done)


def axes_of(vary: Vary[Key]) -> list[Callable[[], Varied]]:
    """Return readers of a grid's axes, to be validated together with all other input.

    Raises
    ------
    InputError
        If a key has no list of values, or a scenario cannot hold a value.
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


def _axis(key: str | Sequence[str], values: object) -> Callable[[], Varied]:
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
    """Return the values of one point as strings, one for each key."""
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
            f"vary {name}: {value!r} is not accepted; expected a string, a number or a list"
        )
    return text
