"""`echobeam plot`."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("plot")
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Stem and suffix of the pictures: .png, .pdf or .svg. Default: the result's name, PNG.",
)
def command(result: Path, out: Path | None) -> None:
    r"""Draw RESULT: rate, tracking error against its bound, beam patterns, trajectories.

    \b
    echobeam plot paper-multi.nc
    echobeam plot paper-multi.nc --out figures/multi.pdf
    """
    from echobeam.plots import draw_all
    from echobeam.store.result import open_result

    target = out or result.with_suffix(".png")
    with open_result(result) as dataset:
        for path in draw_all(dataset, target.with_suffix(""), target.suffix or ".png"):
            click.echo(path)
