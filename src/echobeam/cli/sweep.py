"""Command `echobeam sweep`."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import click

from echobeam.cli import options

if TYPE_CHECKING:
    import xarray as xr

    from echobeam.store.recording import Done
    from echobeam.sweeps.grid import Grid


@click.command("sweep")
@click.argument("scenario", type=click.Path())
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="KEY=V1,V2,...",
    help="Key and values; several make a product. KEY1,KEY2=V1,V2,... varies keys together.",
)
@options.scheme
@options.trials
@options.seed
@options.out("NAME-sweep.nc")
@click.option(
    "--csv",
    "csv_path",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Also write the quantities as a tidy CSV table.",
)
@click.option(
    "--full", is_flag=True, help="Also store the full result of every point, beside --out."
)
@options.overrides
@options.trace
@options.work
@options.as_json
@options.traceback
def command(
    scenario: str,
    varied: tuple[str, ...],
    out: Path | None,
    csv_path: Path | None,
    full: bool,
    quiet: bool,
    as_json: bool,
    **wanted: Unpack[options.Wanted],
) -> None:
    r"""Run SCENARIO over a grid of values, with the same random numbers at every point.

    \b
    echobeam sweep paper-single --vary radio.power=0.1,1,10 --vary array.n_tx=16,32,64
    echobeam sweep paper-single --vary array.n_tx,array.n_rx=16,32,64 --trials 50
    echobeam sweep paper-multi --vary coverage.ripple=1,3,5 --trials 50 --csv ripple.csv
    """
    from echobeam.commands.progress import progress_bar
    from echobeam.commands.sweep import record_grid
    from echobeam.sweeps.grid import read_varied
    from echobeam.sweeps.recording import open_sweep

    bar = partial(progress_bar, quiet=quiet)
    with contextlib.redirect_stdout(
        sys.stderr
    ):  # a user's scheme may print; stdout is for the result
        axes = [partial(read_varied, text) for text in varied]
        asked = options.request(scenario, **wanted)
        grid, name, target, done = record_grid(asked, axes, out, csv_path, full=full, bar=bar)
    if not done.anything and not quiet:
        click.echo(f"{target}: already complete, nothing to do", err=True)
    if quiet and not as_json:
        return
    with open_sweep(target) as dataset:
        if as_json:
            click.echo(_json(dataset, name, target, grid, done))
        else:
            click.echo(_table(dataset, target, grid, done))


def _table(dataset: xr.Dataset, path: Path, grid: Grid, done: Done) -> str:
    """Return mean sum rates and times over the grid, a row per point and a column per scheme.

    The values of the keys are printed as given, "60 deg" and not 1.047198.
    """
    import numpy as np

    from echobeam.cli.columns import aligned
    from echobeam.cli.report import DECISION_WORDS, measured, milliseconds

    schemes = [str(name) for name in dataset["scheme"].values]
    means = dataset["frame_rate_mean"].values.reshape(grid.size, -1)
    intervals = dataset["frame_rate_interval"].values.reshape(*means.shape, 2)
    places = list(np.ndindex(*(len(axis.values) for axis in grid.axes)))
    settings = [
        [value for axis, at in zip(grid.axes, place, strict=True) for _, value in axis.settings(at)]
        for place in places
    ]
    heads = [*grid.keys, *schemes]
    rates = [list(map(measured, *row)) for row in zip(means, intervals, strict=True)]
    interval = ", with 95 % interval" if np.isfinite(intervals).any() else ""
    lines = [f"mean sum rate, bit/s/Hz{interval}", ""]
    lines += aligned([heads, *(s + r for s, r in zip(settings, rates, strict=True))])
    taken = [milliseconds(decisions) for decisions in done.decisions]
    if any(taken):
        times = [[one.get(name, "") for name in schemes] for one in taken]
        lines += ["", DECISION_WORDS, ""]
        lines += aligned([heads, *(s + t for s, t in zip(settings, times, strict=True))])
    return "\n".join([*lines, "", f"result: {path}"])


def _json(dataset: xr.Dataset, name: str, path: Path, grid: Grid, done: Done) -> str:
    """Return all quantities of all points as strict JSON; NaN and infinity become null."""
    import numpy as np

    from echobeam.cli.report import seconds
    from echobeam.numerals import as_json

    points = [_point(at, path) for at in _along(dataset, grid)]
    taken = [seconds(one) for one in done.decisions] if done.decisions else [None] * len(points)
    document = {
        "scenario": name,
        "seed": int(dataset.attrs["seed"]),
        "trials": np.asarray(dataset.attrs["trials"]).tolist(),
        "result": str(path),
        "vary": {key: dataset[key].values for key in grid.keys},
        "points": [
            {**point, "decision_seconds": one} for point, one in zip(points, taken, strict=True)
        ],
    }
    return json.dumps(as_json(document), indent=1, allow_nan=False)


def _along(dataset: xr.Dataset, grid: Grid) -> Iterator[tuple[dict[str, object], xr.Dataset]]:
    """Yield every point of the grid: the values of its keys and its quantities."""
    import numpy as np

    dims = [axis.key for axis in grid.axes]
    for index in np.ndindex(*(dataset.sizes[dim] for dim in dims)):
        point = dataset.isel(dict(zip(dims, index, strict=True)))
        yield {key: point[key].item() for key in grid.keys}, point


def _point(at: tuple[dict[str, object], xr.Dataset], path: Path) -> dict[str, object]:
    settings, point = at
    whole = {"result": str(path.parent / point["result"].item())} if "result" in point else {}
    names = [name for name, values in point.items() if "scheme" in values.dims]
    schemes = {
        str(scheme): {str(name): point[name].sel(scheme=scheme).values for name in names}
        for scheme in point["scheme"].values
    }
    return {"settings": settings, **whole, "schemes": schemes}
