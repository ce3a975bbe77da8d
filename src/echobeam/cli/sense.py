"""`echobeam sense`."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from echobeam.cli import options

if TYPE_CHECKING:
    from echobeam.simulation.sensing_check import SensingCheck


@click.command("sense")
@click.argument("scenario", type=click.Path())
@options.trials
@options.seed
@click.option(
    "--mode",
    type=click.Choice(["directional", "omni"]),
    default="directional",
    show_default=True,
    help="Transmission: a beam matched to the first object, or omnidirectional power.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Picture (.png, .pdf, .svg) or data (.csv, .json). Default: NAME-sense.png here.",
)
@options.overrides
@options.force
@options.quiet
@options.as_json
def command(
    scenario: str,
    trials: int | None,
    seed: int,
    mode: Literal["directional", "omni"],
    out: Path | None,
    overrides: tuple[str, ...],
    force: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    r"""Check the receiver of SCENARIO: RMSE of each estimator against the Cramer-Rao bounds.

    Above a road the direction is an angle, on the ground it is the two cosines u and v.

    \b
    echobeam sense paper-signal --trials 200
    echobeam sense paper-signal --mode omni --set radar.symbols=32 --out omni.pdf
    """
    from echobeam.commands.asking import target
    from echobeam.commands.progress import progress_bar
    from echobeam.commands.sense import record_check
    from echobeam.scenario.load import load_scenario

    place = out
    if place is None and not as_json:
        place = target(None, scenario, load_scenario(scenario), "-sense.png")
    bar = partial(progress_bar, quiet=quiet)
    done = record_check(scenario, trials, seed, mode, overrides, place, force, bar)
    if as_json:
        click.echo(json.dumps(document(done.check), indent=1, allow_nan=False))
    elif not quiet:
        click.echo("\n".join(table(done.check)))
        click.echo(f"picture: {place}")


def document(check: SensingCheck) -> dict[str, Any]:
    """Return a check as JSON knows it."""
    from echobeam.numerals import as_json

    found: dict[str, Any] = as_json(
        {
            "snr_db": 10.0 * _log10(check.snr),
            "snr_total_db": check.total,
            "trials": check.trials,
            "rmse": check.rmse,
            "bound": check.bound,
            "detected": check.detected,
            "resolution": {
                "separation": check.separation,
                "resolved": check.resolved,
            },
        }
    )
    return found


def _log10(values: Any) -> Any:
    import numpy as np

    return np.log10(values)


def table(check: SensingCheck) -> list[str]:
    """Return the table of errors over the exact bound, and of the resolution."""
    import numpy as np

    from echobeam.cli.columns import aligned

    ratios = {
        f"{quantity} {name.replace('_', ' ')}": rmse / check.bound["exact"][quantity]
        for quantity, estimators in check.rmse.items()
        for name, rmse in estimators.items()
    }
    rows = [["SNR dB", "total dB", "detected", *ratios]]
    rows += [
        [f"{10.0 * np.log10(check.snr[i]):.1f}", f"{check.total[i]:.0f}",
         f"{100.0 * check.detected[i]:.0f} %", *(_cell(one[i], ".3g") for one in ratios.values())]
        for i in range(check.total.size)
    ]  # fmt: skip
    on_road = check.directions == ("angle",)
    scale, digits = (180.0 / np.pi, 2) if on_road else (1.0, 3)
    apart = [["separation deg" if on_road else "apart (cosine)", *check.resolved]]
    apart += [
        [f"{scale * check.separation[i]:.{digits}f}",
         *(_cell(100.0 * one[i], ".0f", " %") for one in check.resolved.values())]
        for i in range(check.separation.size)
    ]  # fmt: skip
    return [
        f"RMSE over the exact bound, {check.trials} trials for each SNR (standard error "
        f"{100.0 / np.sqrt(2.0 * check.trials):.0f} %; the trials are the same for all)",
        "",
        *aligned(rows),
        "",
        "two objects of one delay and Doppler, share of trials in which both are found",
        "",
        *aligned(apart),
    ]


def _cell(value: float, form: str, unit: str = "") -> str:
    """Return a number of the table; a dash where nothing is measured."""
    return f"{value:{form}}{unit}" if math.isfinite(value) else "-"
