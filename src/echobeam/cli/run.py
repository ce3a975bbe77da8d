"""`echobeam run`."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

import click


@click.command("run")
@click.argument("scenario")
@click.option(
    "--scheme",
    "schemes",
    multiple=True,
    metavar="NAME",
    help="Scheme by name, or path/to/file.py:name; repeatable. Default: the scenario's.",
)
@click.option("--trials", type=int, metavar="N", help="Number of trials. Default: the scenario's.")
@click.option(
    "--seed", type=int, default=0, show_default=True, metavar="N", help="Seed of all randomness."
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Result file. Default: NAME.nc here.",
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help='Override a key of the scenario, such as uav.height="80 m"; repeatable.',
)
@click.option(
    "--trace",
    metavar="FILE",
    help="Move the objects by a SUMO FCD XML or a CSV trace; either may be .gz.",
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
@click.option("--resume", is_flag=True, help="Go on with an interrupted run.")
@click.option("--force", is_flag=True, help="Replace an existing result.")
@click.option("--quiet", is_flag=True, help="Print no progress and no table.")
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print the summary as JSON, and nothing else, on stdout.",
)
def command(
    scenario: str,
    schemes: tuple[str, ...],
    trials: int | None,
    seed: int,
    out: Path | None,
    overrides: tuple[str, ...],
    trace: str | None,
    jobs: int,
    dask: str | None,
    resume: bool,
    force: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    r"""Run SCENARIO, a built-in name or a TOML file, and write a result.

    \b
    echobeam run paper-multi --trials 200 --jobs 2
    echobeam run mine.toml --scheme temporal --set uav.height="80 m"
    echobeam run traffic --trace my-fcd.xml.gz --out mine.nc
    """
    from echobeam.cli.progress import progress_bar
    from echobeam.cli.report import json_report, text_report
    from echobeam.scenario.load import load_scenario, with_trace
    from echobeam.store.recorded import Recording, record
    from echobeam.store.result import open_result
    from echobeam.store.workers import Workers

    loaded = load_scenario(scenario, overrides)
    if trace is not None:
        loaded = with_trace(loaded, trace)
    recording = Recording(
        scenario=loaded,
        schemes=schemes or loaded.schemes,
        trials=loaded.trials if trials is None else trials,
        seed=seed,
        out=out or Path(f"{loaded.name}.nc"),
        workers=Workers(jobs, dask),
        resume=resume,
        force=force,
    )
    with (
        contextlib.redirect_stdout(sys.stderr),  # what a user's scheme prints is not our output
        progress_bar(loaded.name, quiet=quiet) as progress,
    ):
        record(recording, progress)
    with open_result(recording.out) as result:
        if as_json:
            click.echo(json_report(result, loaded, recording.out))
        elif not quiet:
            click.echo(text_report(result, loaded, recording.out))
