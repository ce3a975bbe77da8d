"""`echobeam sweep`."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from echobeam.cli import options

if TYPE_CHECKING:
    import xarray as xr

    from echobeam.store.recorded import Done


@click.command("sweep")
@click.argument("scenario")
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="KEY=V1,V2,...",
    help="Key and values; several make a product.",
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
    help="Write the figures as a tidy CSV too.",
)
@click.option("--full", is_flag=True, help="Keep every point's full result too, beside --out.")
@options.overrides
@options.trace
@options.work
@options.as_json
def command(
    scenario: str,
    varied: tuple[str, ...],
    schemes: tuple[str, ...],
    trials: int | None,
    seed: int,
    out: Path | None,
    csv_path: Path | None,
    full: bool,
    overrides: tuple[str, ...],
    trace: str | None,
    jobs: int,
    dask: str | None,
    resume: bool,
    force: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    r"""Run a grid of scenarios from SCENARIO, on the same random numbers at every point.

    \b
    echobeam sweep paper-single --vary radio.power=0.1,1,10 --vary array.n_tx=16,32,64
    echobeam sweep paper-multi --vary coverage.ripple=1,3,5 --trials 50 --csv ripple.csv
    """
    from echobeam.cli.progress import progress_bar
    from echobeam.store.workers import Workers
    from echobeam.sweeps.grid import Grid, read_varied
    from echobeam.sweeps.recorded import Sweep, open_sweep, record_sweep
    from echobeam.traces.progress import reading_shown

    with contextlib.redirect_stdout(sys.stderr):  # a user's scheme may print: not our output
        axes = [partial(read_varied, text) for text in varied]
        asked = options.read(scenario, overrides, trace, schemes, trials, seed, axes)
        grid = Grid(scenario, overrides, tuple(axis() for axis in axes), trace)
        name = asked.scenario.name
        target = out or Path(f"{name}-sweep.nc")
        sweep = Sweep(
            grid,
            schemes,
            trials,
            seed,
            target,
            csv_path,
            full,
            Workers(jobs, dask),
            resume,
            force,
        )
        bar = partial(progress_bar, quiet=quiet)
        with reading_shown(bar), bar(f"{name}: {grid.size} points") as progress:
            done = record_sweep(sweep, progress)
    if not done.anything and not quiet:
        click.echo(f"{target}: is complete, nothing was to be done", err=True)
    if quiet and not as_json:
        return
    with open_sweep(target) as dataset:
        keys = [axis.key for axis in grid.axes]
        if as_json:
            click.echo(_json(dataset, name, target, keys, done))
        else:  # a table is read: values as they were given, "60 deg" and not 1.047198
            given = {axis.key: list(axis.values) for axis in grid.axes}
            click.echo(_table(dataset.assign_coords(given), target, done))


def _table(dataset: xr.Dataset, path: Path, done: Done) -> str:
    """Return mean sum rates and times over the grid, a row per point and a column per scheme."""
    import numpy as np

    from echobeam.cli.report import DECISION_WORDS, milliseconds

    rates = dataset["frame_rate_mean"]
    lines = ["mean sum rate, bit/s/Hz", "", _unstacked(rates), ""]
    taken = [milliseconds(decisions) for decisions in done.decisions]
    if any(taken):
        cells = [one.get(str(name), "") for one in taken for name in rates["scheme"].values]
        times = rates.copy(data=np.array(cells, dtype=object).reshape(rates.shape))
        lines += [DECISION_WORDS, "", _unstacked(times), ""]
    return "\n".join([*lines, f"result: {path}"])


def _unstacked(values: xr.DataArray) -> str:
    """Return values as text, the schemes as columns."""
    frame = values.to_dataframe()[values.name].unstack("scheme")
    return str(frame[values["scheme"].values].to_string())


def _json(dataset: xr.Dataset, name: str, path: Path, keys: list[str], done: Done) -> str:
    """Return every figure of every point as strict JSON: what is not a number is null."""
    import numpy as np

    from echobeam.cli.report import plain, seconds

    points = [_point(at, path) for at in _along(dataset, keys)]
    taken = [seconds(one) for one in done.decisions] if done.decisions else [None] * len(points)
    document = {
        "scenario": name,
        "seed": int(dataset.attrs["seed"]),
        "trials": np.asarray(dataset.attrs["trials"]).tolist(),
        "result": str(path),
        "vary": {key: dataset[key].values for key in keys},
        "points": [
            {**point, "decision_seconds": one} for point, one in zip(points, taken, strict=True)
        ],
    }
    return json.dumps(plain(document), indent=1, allow_nan=False)


def _along(dataset: xr.Dataset, keys: list[str]) -> Iterator[tuple[dict[str, object], xr.Dataset]]:
    """Yield every point of the grid: the values of its keys and its figures."""
    import numpy as np

    for index in np.ndindex(*(dataset.sizes[key] for key in keys)):
        point = dataset.isel(dict(zip(keys, index, strict=True)))
        yield {key: point[key].item() for key in keys}, point


def _point(at: tuple[dict[str, object], xr.Dataset], path: Path) -> dict[str, object]:
    settings, point = at
    whole = {"result": str(path.parent / point["result"].item())} if "result" in point else {}
    names = [name for name, values in point.items() if "scheme" in values.dims]
    schemes = {
        str(scheme): {str(name): point[name].sel(scheme=scheme).values for name in names}
        for scheme in point["scheme"].values
    }
    return {"settings": settings, **whole, "schemes": schemes}
