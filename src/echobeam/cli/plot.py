"""Command `echobeam plot`."""

from __future__ import annotations

import re
from pathlib import Path

import click

from echobeam.faults import InputError

KINDS = (
    "rate", "tracking", "patterns", "trajectories", "consistency", "forecast", "distribution",
    "map", "tracks", "gospa", "sweep",
)  # fmt: skip


@click.command("plot")
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Stem and suffix of the files: .png, .pdf or .svg for pictures, .csv or .json for their "
    "numbers. Default: the result's name, PNG.",
)
@click.option(
    "--kind",
    "kinds",
    multiple=True,
    type=click.Choice(KINDS),
    help="Kind of picture; repeatable. Default: all that the result has.",
)
@click.option(
    "--scheme",
    "schemes",
    multiple=True,
    metavar="NAME",
    help="Show this scheme; repeatable. Patterns, trajectories and tracks show the first. "
    "Default: all.",
)
@click.option(
    "--trial",
    type=int,
    default=0,
    show_default=True,
    metavar="N",
    help="Trial of the patterns, trajectories and tracks, counted from 0 as in the file.",
)
@click.option(
    "--slots",
    metavar="LIST",
    help="Slots shown, such as 2,4,10 or 1-50; trajectories, tracks and forecasts take the range.",
)
@click.option("--x", metavar="KEY", help="Of a sweep: the key along the axis. Default: the first.")
@click.option(
    "--quantity",
    metavar="NAME",
    help="Of a sweep: the quantity drawn. Default: frame_rate_mean.",
)
@click.option("--title", metavar="TEXT", help="Title instead of the scenario's name.")
def command(
    result: Path,
    out: Path | None,
    kinds: tuple[str, ...],
    schemes: tuple[str, ...],
    trial: int,
    slots: str | None,
    x: str | None,
    quantity: str | None,
    title: str | None,
) -> None:
    r"""Draw RESULT: of a run its rate, tracking error against its bound, beam patterns,
    trajectories, consistency of the filter, errors of its forecasts, and distributions; of a run
    without labels also its tracks and their GOSPA; of one on the ground a map; of a sweep any
    quantity over a varied key.

    Files of the same name are replaced.

    \b
    echobeam plot paper-multi.nc
    echobeam plot paper-multi.nc --kind patterns --scheme pilot --slots 2,10
    echobeam plot ripple.nc --x coverage.ripple --quantity outage --out outage.pdf
    """
    from echobeam.commands.plot import readable, record_pictures
    from echobeam.plots import Choice

    heading = None if title is None else readable(title)
    choice = Choice(schemes, trial, read_slots(slots), x, quantity, heading)
    for path in record_pictures(result, out, kinds, choice):
        click.echo(path)


def read_slots(text: str | None) -> tuple[int, ...]:
    """Return the slot numbers of a list such as ``2,4,10-12``.

    Raises
    ------
    InputError
        If the text is not such a list.
    """
    found: list[int] = []
    for part in (text or "").split(",") if text is not None else ():
        match = re.fullmatch(r"\s*(\d{1,7})(?:\s*-\s*(\d{1,7}))?\s*", part)
        if match is None or int(match[2] or match[1]) < int(match[1]):
            raise InputError(f"--slots {text}: expected slots such as 2,4,10 or 1-50")
        found += range(int(match[1]), int(match[2] or match[1]) + 1)
    return tuple(dict.fromkeys(found))
