"""Command `echobeam compile`."""

from __future__ import annotations

import click

from echobeam.cli import options


@click.command("compile")
@options.quiet
def command(quiet: bool) -> None:
    r"""Compile the beam solver now, and print where it is stored.

    Otherwise the first beam design compiles it, and takes half a minute longer.

    \b
    echobeam compile
    """
    from echobeam.beamforming.direct.trials import compile_solver
    from echobeam.commands.progress import progress_bar

    with progress_bar("beam solver", quiet=quiet) as progress:
        done = compile_solver(progress)
    if not quiet:
        what = f"compiled in {done.seconds:.0f} s" if done.fresh else "already compiled"
        where = "not stored" if done.folder is None else f"stored in {done.folder}"
        click.echo(f"beam solver: {what}; {where}")
