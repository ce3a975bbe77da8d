"""`echobeam traffic`."""

from __future__ import annotations

import json
import shlex
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from echobeam.cli import options

if TYPE_CHECKING:
    from echobeam.commands.traffic import Traffic


@click.command("traffic")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    metavar="FILE",
    help="Trace to write, .xml or .xml.gz.",
)
@click.option(
    "--kind",
    type=click.Choice(["road", "intersection"]),
    default="road",
    show_default=True,
    help="A straight road, or two that cross at traffic lights.",
)
@click.option(
    "--vehicles",
    type=int,
    metavar="N",
    help="Vehicles in the trace. Default: 15 at once on each km of a lane.",
)
@click.option(
    "--length", default="1 km", show_default=True, metavar="LENGTH", help="Length of the road."
)
@click.option(
    "--speed", default="20 m/s", show_default=True, metavar="SPEED", help="Mean desired speed."
)
@click.option(
    "--lanes", type=int, default=2, show_default=True, metavar="N", help="Lanes in each direction."
)
@click.option(
    "--both-directions", is_flag=True, help="Let half of the vehicles drive the other way."
)
@click.option(
    "--duration", default="30 s", show_default=True, metavar="TIME", help="Time of the trace."
)
@click.option(
    "--step", default="0.1 s", show_default=True, metavar="TIME", help="Time between samples."
)
@options.seed
@options.force
@options.quiet
@options.as_json
def command(
    out: Path,
    kind: str,
    vehicles: int | None,
    length: str,
    speed: str,
    lanes: int,
    both_directions: bool,
    duration: str,
    step: str,
    seed: int,
    force: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    r"""Make roads and their vehicles with SUMO, and write a trace for `run --trace`.

    x = 0 is the middle of the road. Drivers have speeds of their own and overtake. At an
    intersection, in its middle, a quarter of them turns to either side.
    Needs SUMO: pip install "echobeam[sumo]".

    \b
    echobeam traffic --out trace.xml.gz
    echobeam traffic --vehicles 60 --length "2 km" --speed "90 km/h" --out trace.xml.gz
    echobeam traffic --kind intersection --length "300 m" --speed "50 km/h" --out trace.xml.gz
    """
    from echobeam.commands.progress import progress_bar
    from echobeam.commands.traffic import record_traffic
    from echobeam.commands.traffic_request import Wanted

    wanted = Wanted(
        out, vehicles, length, speed, lanes, both_directions, duration, step, seed, force, kind
    )
    made = record_traffic(wanted, partial(progress_bar, quiet=quiet))
    if as_json:
        click.echo(json.dumps(document(made), indent=1, allow_nan=False))
    elif not quiet:
        click.echo("\n".join(summary(made, kind)))


def document(made: Traffic) -> dict[str, Any]:
    """Return a trace's numbers as JSON knows them, SI units."""
    return {
        "trace": str(made.path),
        "vehicles": made.vehicles,
        "at_once": made.at_once,
        "most_at_once": made.most_at_once,
        "mean_speed": made.mean_speed,
        "slowest": made.slowest,
        "fastest": made.fastest,
        "duration": made.duration,
        "step": made.step,
        "stretch": list(made.stretch),
        "width": list(made.width),
    }


def summary(made: Traffic, kind: str) -> list[str]:
    """Return a trace's numbers in words, and how it is run."""
    low, high = made.stretch
    south, north = made.width
    road = kind == "road"
    across = "" if road else f", y from {south:.1f} to {north:.1f} m"
    scenario, origin = ("traffic", "0") if road else ("ground-traffic", "'[0, 0]'")
    start = "" if road else " --set trace.start='0 s'"
    name = shlex.quote(str(made.path))
    return [
        f"{made.vehicles} vehicle{'s' * (made.vehicles != 1)} in {made.duration:g} s, "
        f"{made.at_once:.1f} at once on average and {made.most_at_once} at most",
        f"speeds {made.slowest:.1f} to {made.fastest:.1f} m/s, mean {made.mean_speed:.1f} m/s; "
        f"x from {low:.1f} to {high:.1f} m{across}",
        f"trace: {made.path}",
        f"run it: echobeam run {scenario} --trace {name} --set trace.origin={origin}{start}",
    ]
