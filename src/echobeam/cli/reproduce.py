"""Command `echobeam reproduce`."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from echobeam.cli import options


@click.command("reproduce")
@click.argument("ids", nargs=-1, metavar="[ID]...")
@click.option("--list", "as_list", is_flag=True, help="List the figures' ids and do nothing.")
@click.option("--quick", is_flag=True, help="A quick look: 20 trials per point.")
@click.option(
    "--trials", type=click.IntRange(min=2), metavar="N", help="Trials per point. Default: 200."
)
@options.seed
@options.overrides
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("reproduction"),
    show_default=True,
    metavar="DIR",
    help="Directory of pictures, data and claims.",
)
@click.option(
    "--format",
    "formats",
    default="png",
    show_default=True,
    metavar="LIST",
    help="Pictures' formats, some of png,pdf,svg; PDF and SVG have no captions inside.",
)
@options.work
def command(
    ids: tuple[str, ...],
    as_list: bool,
    quick: bool,
    trials: int | None,
    seed: int,
    overrides: tuple[str, ...],
    out: Path,
    formats: str,
    jobs: int,
    dask: str | None,
    resume: bool,
    force: bool,
    quiet: bool,
) -> None:
    r"""Reproduce the paper's figures (all, or those with the IDs) and judge its claims.

    \b
    echobeam reproduce --list
    echobeam reproduce t1 t4 --quick
    echobeam reproduce --jobs 2 --out reproduction
    echobeam reproduce t7-1 --set radar.target=3gpp-vehicle --out car

    Writes ID.png, ID.csv and ID.json for every figure, claims.json and claims.md. Finished
    blocks of trials are stored in DIR/blocks, so that --resume continues an interrupted run.
    """
    from echobeam.commands.progress import progress_bar
    from echobeam.commands.reproduce import record_figures
    from echobeam.reproduction.catalogue import FIGURES
    from echobeam.reproduction.report import written
    from echobeam.store.workers import Workers

    if as_list:
        width = max(map(len, FIGURES))
        for figure in FIGURES.values():
            click.echo(f"{figure.id:<{width}}  {figure.caption}")
        return
    findings = record_figures(
        ids,
        out,
        trials=trials,
        quick=quick,
        seed=seed,
        settings=overrides,
        workers=Workers(jobs, dask),
        resume=resume,
        force=force,
        formats=formats.split(","),
        bar=partial(progress_bar, quiet=quiet),
    )
    if quiet:
        return
    for finding in findings:
        claim, measured = finding.claim, finding.measured
        ours = written(measured.headline, measured.unit)
        click.echo(f"{finding.verdict:<14}  {claim.id}: {ours}")
    click.echo(f"pictures, data and claims: {out}")
