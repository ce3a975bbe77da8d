"""Command `echobeam schemes`."""

from __future__ import annotations

import textwrap

import click

WIDTH, INDENT = 78, 17


@click.command("schemes")
def command() -> None:
    r"""List the schemes that can be run, built in and plugged in, with their parameters.

    \b
    echobeam run paper-multi --scheme temporal:ripple=1 --scheme temporal:ripple=5
    """
    from echobeam.schemes.base import SchemeError
    from echobeam.schemes.configure import defaults
    from echobeam.schemes.parameters import PARTS
    from echobeam.schemes.registry import available, available_parts

    for name, words in available().items():
        click.echo(f"{name:16} {words}")
        try:
            parameters = [f"{key}={value}" for key, value in defaults(name).items()]
        except SchemeError as error:  # a plugin that fails to load
            parameters = [f"cannot be used: {error}"]
        if parameters:
            click.echo(_filled(parameters))
    click.echo(
        "\nParameters of [filter] and [coverage] default to the scenario's; shown are those\n"
        "of an empty scenario. On unlabelled detections a scheme of parts takes those of\n"
        "[filter] and [tracks], too: temporal:association=mht. Parts can be replaced by name or\n"
        "by path/to/file.py:name, as in temporal:tracker=dead-reckoning:"
    )
    for kind in PARTS:
        click.echo(f"\n{kind}")
        for name, words in available_parts(kind).items():
            click.echo(f"  {name:16} {words}")


def _filled(parameters: list[str]) -> str:
    """Return parameters as indented lines, broken only between parameters."""
    whole = ", ".join(text.replace(" ", "\0") for text in parameters)
    lines = textwrap.wrap(whole, WIDTH, break_on_hyphens=False, break_long_words=False)
    return "\n".join(" " * INDENT + line.replace("\0", " ") for line in lines)
