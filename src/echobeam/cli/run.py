"""`echobeam run`."""

from __future__ import annotations

import contextlib
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from echobeam.cli import options

if TYPE_CHECKING:
    from echobeam.store.recorded import Done


@click.command("run")
@click.argument("scenario")
@options.scheme
@options.trials
@options.seed
@options.out("NAME.nc")
@options.overrides
@options.trace
@options.work
@options.as_json
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
    from echobeam.store.recorded import Recording, record
    from echobeam.store.workers import Workers
    from echobeam.traces.progress import reading_shown

    with contextlib.redirect_stdout(sys.stderr):  # a user's scheme may print: not our output
        asked = options.read(scenario, overrides, trace, schemes, trials, seed)
        recording = Recording(
            asked.scenario,
            asked.schemes,
            asked.trials,
            asked.seed,
            out=out or Path(f"{asked.scenario.name}.nc"),
            workers=Workers(jobs, dask),
            resume=resume,
            force=force,
        )
        bar = partial(progress_bar, quiet=quiet)
        with reading_shown(bar), bar(asked.scenario.name) as progress:
            done = record(recording, progress)
    if not done.anything and not quiet:
        click.echo(f"{recording.out}: is complete, nothing was to be done", err=True)
    if as_json or not quiet:
        click.echo(_report(recording.out, asked, done, as_json=as_json))


def _report(path: Path, asked: options.Asked, done: Done, *, as_json: bool) -> str:
    from echobeam.cli.report import json_report, text_report
    from echobeam.store.result import open_result

    report = json_report if as_json else text_report
    decisions = done.decisions[0] if done.decisions else None
    with open_result(path) as result:
        return report(result, asked.scenario, path, decisions)
