"""Command `echobeam scenarios`."""

from __future__ import annotations

import tomllib

import click


@click.command("scenarios")
@click.argument("name", required=False)
def command(name: str | None) -> None:
    r"""List the built-in scenarios, or print one as a TOML file to edit and run.

    \b
    echobeam scenarios
    echobeam scenarios paper-multi > mine.toml
    """
    from echobeam.scenario.built_in import BUILT_IN, preset_text

    if name is not None:
        click.echo(preset_text(name), nl=False)
        return
    for known in BUILT_IN:
        click.echo(f"{known:20} {tomllib.loads(preset_text(known))['description']}")
