"""`echobeam schemes`."""

from __future__ import annotations

import click


@click.command("schemes")
def command() -> None:
    """List the schemes that can be run, built in and plugged in."""
    from echobeam.schemes.registry import available

    for name, words in available().items():
        click.echo(f"{name:16} {words}")
