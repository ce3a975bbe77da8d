"""`echobeam compile`."""

from __future__ import annotations

import click

from echobeam.cli import options


@click.command("compile")
@options.quiet
def command(quiet: bool) -> None:
    r"""Compile the beam solver now, and say where it is kept.

    Otherwise the first design of beams does, which then takes half a minute longer.

    \b
    echobeam compile
    """
    from echobeam.beamforming.direct.trials import compile_solver
    from echobeam.commands.progress import progress_bar

    with progress_bar("beam solver", quiet=quiet) as progress:
        done = compile_solver(progress)
    if not quiet:
        what = f"compiled in {done.seconds:.0f} s" if done.fresh else "is compiled already"
        where = "not kept" if done.folder is None else f"kept in {done.folder}"
        click.echo(f"beam solver: {what}; {where}")
