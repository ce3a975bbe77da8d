"""Command `echobeam beam`."""

from __future__ import annotations

import json
import logging
import sys
from pathlib import Path

import click

from echobeam.beamforming.methods import DEFAULT, METHODS


@click.command("beam")
@click.argument("problem", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "--method",
    type=click.Choice(list(METHODS)),
    default=DEFAULT,
    show_default=True,
    help="Solution method.",
)
@click.option(
    "--certify",
    is_flag=True,
    help="Certify the beams to a relative gap of 1e-4, or find better ones.",
)
def command(problem: Path, method: str, certify: bool) -> None:
    r"""Design the beams of one slot from PROBLEM, a JSON file ('-' reads stdin).

    \b
    {"angles_deg": [75, 135], "distances": [103.5, 141.4],
     "coverage_halfwidths_deg": [3, 3], "ripple": 3, "min_rate": 4e-4,
     "power": 1, "noise": 1, "n_tx": 30}
    """
    from echobeam.beamforming.design import design_beams
    from echobeam.cli.problem_document import answer_document, read_problem
    from echobeam.store.writing import StoreError

    try:
        text = sys.stdin.read() if str(problem) == "-" else problem.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise StoreError(f"{problem}: cannot be read: {reason}") from None
    if method == "reference":  # it runs for minutes
        logging.basicConfig(stream=sys.stderr, format="%(message)s", level=logging.INFO)
    answer = design_beams(read_problem(text, str(problem)), method=method, certify=certify)
    click.echo(json.dumps(answer_document(answer), indent=1, allow_nan=False))
