"""Command `echobeam run`."""

from __future__ import annotations

import contextlib
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import click

from echobeam.cli import options

if TYPE_CHECKING:
    from echobeam.commands.run import RunDone


@click.command("run")
@click.argument("scenario", type=click.Path())
@options.scheme
@options.trials
@options.seed
@options.out("NAME.nc")
@options.overrides
@options.trace
@options.work
@options.as_json
@options.traceback
def command(
    scenario: str, out: Path | None, quiet: bool, as_json: bool, **wanted: Unpack[options.Wanted]
) -> None:
    r"""Run SCENARIO, a built-in name or a TOML file, and write a result.

    \b
    echobeam run paper-multi --trials 200 --jobs 2
    echobeam run mine.toml --scheme temporal --set uav.height="80 m"
    echobeam run traffic --trace my-fcd.xml.gz --out mine.nc
    """
    from echobeam.commands.progress import progress_bar
    from echobeam.commands.run import record_run

    with contextlib.redirect_stdout(
        sys.stderr
    ):  # a user's scheme may print; stdout is for the result
        asked = options.request(scenario, **wanted)
        finished = record_run(asked, out, partial(progress_bar, quiet=quiet))
    if not finished.done.anything and not quiet:
        click.echo(f"{finished.out}: already complete, nothing to do", err=True)
    if as_json or not quiet:
        click.echo(_report(finished, as_json=as_json, quiet=quiet))


def _report(finished: RunDone, *, as_json: bool, quiet: bool) -> str:
    from echobeam.cli.report import far_field_warning, json_report, text_report
    from echobeam.store.result import open_result

    report = json_report if as_json else text_report
    decisions = finished.done.decisions[0] if finished.done.decisions else None
    scenario = finished.asked.scenario
    with open_result(finished.out) as result:
        warning = far_field_warning(result, scenario)
        if warning is not None and not quiet:
            click.echo(warning, err=True)
        return report(result, scenario, finished.out, decisions)
