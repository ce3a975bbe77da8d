"""Command `echobeam bench`."""

from __future__ import annotations

import json

import click


@click.command("bench")
@click.option(
    "--case",
    "cases",
    multiple=True,
    metavar="NAME",
    help="Case by name, such as n30-k2-s1 or paper-multi-later; repeatable. "
    "Default: a quick selection.",
)
@click.option("--all", "everything", is_flag=True, help="Run every case.")
@click.option(
    "--method",
    "methods",
    multiple=True,
    metavar="NAME",
    help="Method by name, such as fast or sdp; repeatable. Default: all, and CVXPY for the single "
    "problem test-point.",
)
@click.option(
    "--reference",
    is_flag=True,
    help="Run CVXPY on every case of a fitting size; it takes minutes.",
)
@click.option(
    "--repeat",
    type=click.IntRange(min=1),
    default=3,
    show_default=True,
    metavar="N",
    help="Timed calls per problem.",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print the records as JSON, and nothing else, on stdout.",
)
@click.option("--quiet", is_flag=True, help="Print no progress.")
def command(
    cases: tuple[str, ...],
    everything: bool,
    methods: tuple[str, ...],
    reference: bool,
    repeat: int,
    as_json: bool,
    quiet: bool,
) -> None:
    r"""Time the slot decision of every method on the same problems.

    \b
    echobeam bench
    echobeam bench --case n30-k2-s1 --reference
    echobeam bench --all --json --quiet
    """
    from echobeam.benchmarking.cases import CASES, QUICK, find_cases
    from echobeam.benchmarking.measure import run_cases
    from echobeam.benchmarking.methods import find_methods
    from echobeam.benchmarking.report import documents, header, table
    from echobeam.commands.progress import progress_bar

    chosen = find_cases(tuple(CASES) if everything else cases or QUICK)
    with progress_bar("bench", quiet=quiet) as progress:
        results = run_cases(chosen, find_methods(methods, reference), repeat, methods, progress)
    if as_json:
        for result in results:
            for name, why in result.skipped.items():
                click.echo(f"{result.case.name}: {name} left out: {why}", err=True)
        click.echo(json.dumps(documents(results), indent=1, allow_nan=False))
    else:
        click.echo(f"{header(repeat)}\n\n{table(results)}")
