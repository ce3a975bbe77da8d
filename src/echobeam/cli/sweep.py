"""`echobeam sweep`."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("sweep")
@click.argument("scenario")
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="KEY=V1,V2,...",
    help="Key and values; several make a product.",
)
@click.option(
    "--scheme",
    "schemes",
    multiple=True,
    metavar="NAME",
    help="Scheme to run; repeatable. Default: as in SCENARIO.",
)
@click.option("--trials", type=int, metavar="N", help="Trials per point. Default: the scenario's.")
@click.option(
    "--seed",
    type=int,
    default=0,
    show_default=True,
    metavar="N",
    help="Seed, common to all points.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Result. Default: NAME-sweep.nc here.",
)
@click.option(
    "--csv",
    "csv_path",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Write a tidy CSV too.",
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Override a key at every point; repeatable.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    metavar="N",
    help="Processes on this machine.",
)
@click.option("--dask", metavar="ADDRESS", help="Run on an existing Dask scheduler.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted sweep.")
@click.option("--force", is_flag=True, help="Replace an existing result.")
@click.option("--quiet", is_flag=True, help="Print no progress and no table.")
def command(
    scenario: str,
    varied: tuple[str, ...],
    schemes: tuple[str, ...],
    trials: int | None,
    seed: int,
    out: Path | None,
    csv_path: Path | None,
    overrides: tuple[str, ...],
    jobs: int,
    dask: str | None,
    resume: bool,
    force: bool,
    quiet: bool,
) -> None:
    r"""Run a grid of scenarios from SCENARIO, on the same random numbers at every point.

    \b
    echobeam sweep paper-single --vary radio.power=0.1,1,10 --vary array.n_tx=16,32,64
    echobeam sweep paper-multi --vary coverage.ripple=1,3,5 --trials 50 --csv ripple.csv
    """
    from echobeam.cli.progress import progress_bar
    from echobeam.scenario.load import load_scenario
    from echobeam.store.block_files import BlockFiles
    from echobeam.store.workers import Workers
    from echobeam.store.writing import check_writable, replacing
    from echobeam.sweeps.grid import Grid, grid_dataset, read_varied, tidy_csv
    from echobeam.sweeps.points import Study, run_study

    grid = Grid(scenario, overrides, tuple(read_varied(text) for text in varied))
    points = grid.points(schemes, trials, ())
    name = load_scenario(scenario, overrides).name
    target = out or Path(f"{name}-sweep.nc")
    for path in filter(None, (target, csv_path)):
        check_writable(path, force=force)
    study = Study(tuple(points), seed, BlockFiles.beside(target))
    with progress_bar(f"{name}: {len(points)} points", quiet=quiet) as progress:
        run_study(study, workers=Workers(jobs, dask), resume=resume, force=force, progress=progress)
    dataset = grid_dataset(grid, study)
    with replacing(target) as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")
    if csv_path is not None:
        with replacing(csv_path) as temporary:
            tidy_csv(dataset, temporary)
    study.files.remove()
    if not quiet:
        click.echo(_table(dataset, [axis.key for axis in grid.axes]))
        click.echo(f"result: {target}")


def _table(dataset: object, keys: list[str]) -> str:
    """Return mean sum rates over the grid, a row per point and a column per scheme."""
    import xarray as xr

    assert isinstance(dataset, xr.Dataset)
    frame = dataset["frame_rate_mean"].to_dataframe()["frame_rate_mean"].unstack("scheme")
    return f"mean sum rate, bit/s/Hz\n\n{frame[dataset['scheme'].values].to_string()}\n"
