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
@click.option(
    "--kind",
    "kinds",
    multiple=True,
    type=click.Choice(["rate", "tracking", "patterns", "trajectories", "consistency", "forecast"]),
    help="Which picture; repeatable. Default: all.",
)
def command(result: Path, out: Path | None, kinds: tuple[str, ...]) -> None:
    r"""Draw RESULT: rate, tracking error against its bound, beam patterns, trajectories,
    consistency of the filter, and the errors of its forecasts.

    Pictures of the same name are replaced.

    \b
    echobeam plot paper-multi.nc
    echobeam plot paper-multi.nc --out figures/multi.pdf
    """
    import tomllib

    from echobeam.plots import draw_all, picture_paths
    from echobeam.scenario.checking import checked
    from echobeam.scenario.model import Scenario
    from echobeam.simulation.bound import with_bound
    from echobeam.store.result import open_result
    from echobeam.store.writing import check_writable

    with open_result(result) as dataset:
        scenario = checked(Scenario, tomllib.loads(dataset.attrs["scenario"]), str(result))
        bounded = with_bound(dataset, scenario)
        target = out or result.with_suffix(".png")
        stem, suffix = target.parent / target.stem, target.suffix or ".png"
        for path in picture_paths(stem, suffix, kinds or None).values():
            check_writable(path, force=True)
        for path in draw_all(bounded, stem, suffix, kinds or None):
            click.echo(path)
