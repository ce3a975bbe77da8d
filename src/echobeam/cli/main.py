"""Command `echobeam`: its subcommands, exit statuses and error messages."""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
import warnings
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

import click

from echobeam.cli.options import TRACEBACK
from echobeam.faults import InputError, InputWarning, RunError
from echobeam.version import __version__

COMMANDS = {
    "scenarios": "List the built-in scenarios, or print one as a file to edit.",
    "describe": "Describe a scenario: link budget and assumptions.",
    "schemes": "List the schemes that can be run.",
    "run": "Run a scenario and write a result.",
    "plot": "Draw a result.",
    "sweep": "Run a grid of scenarios.",
    "beam": "Design the beams of one slot from a JSON problem.",
    "sense": "Check the receiver's estimators against the Cramer-Rao bounds.",
    "traffic": "Make a trace of vehicles on a road with the traffic simulator SUMO.",
    "bench": "Time the slot decision of every method on the same problems.",
    "reproduce": "Reproduce the paper's figures and judge its claims.",
    "compile": "Compile the beam solver now, and print where it is stored.",
}
"""Commands with their help texts; each is in the module of its name."""

WRONG_INPUT, FAILED = 2, 1


class LazyGroup(click.Group):
    """Group of commands that imports a command's module only when it is used."""

    def invoke(self, ctx: click.Context) -> object:
        """Run a command; print the traceback of an error in a user's code if requested."""
        try:
            return super().invoke(ctx)
        except InputError as error:
            if error.details and ctx.meta.get(TRACEBACK):
                click.echo(error.details, err=True, nl=False)
            raise

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order of `COMMANDS`."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"echobeam.cli.{cmd_name}").command
        # click's mark for preformatted lines, two characters in a raw docstring
        command.help = (command.help or "").replace("\\b\n", "\b\n")
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _print_version(context: click.Context, option: click.Parameter, asked: bool) -> None:
    """Print the version and the environment that the numbers of a run depend on."""
    if not asked or context.resilient_parsing:
        return
    from echobeam.simulation.environment import environment

    click.echo("\n".join([f"echobeam, version {__version__}", *environment().split("; ")]))
    context.exit()


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Print the version, and those of Python, the libraries and the processor.",
)
def cli() -> None:
    """Sensing-assisted predictive beamforming: echo, estimate, track, predict, optimise, rate."""
    warnings.showwarning = partial(_tell, warnings.showwarning)


def _tell(otherwise: Callable[..., None], message: Warning | str, *where: Any, **to: Any) -> None:
    """Print a warning about the input as a plain message, without its place in the source."""
    if isinstance(message, InputWarning):
        click.echo(f"echobeam: {message}", err=True)
    else:
        otherwise(message, *where, **to)


def main() -> None:
    """Run the command line; an error becomes one message and an exit status."""
    _prepare_process()
    try:
        cli.main(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(WRONG_INPUT)
    except click.Abort:
        _fail("interrupted", FAILED)
    except RunError as error:  # also where a scheme failed, which is both
        _fail(str(error), FAILED)
    except InputError as error:
        _fail(str(error), WRONG_INPUT)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(FAILED)
    except OSError as error:
        if os.environ.get("ECHOBEAM_DEBUG"):
            raise
        place = f"{error.filename}: " if error.filename else ""
        _fail(f"{place}{error.strerror or error}", FAILED)
    except Exception as error:
        if os.environ.get("ECHOBEAM_DEBUG"):
            raise
        _fail(
            f"internal error of echobeam: {type(error).__name__}: {error}\n"
            "Please report it; ECHOBEAM_DEBUG=1 prints the traceback.",
            FAILED,
        )


def _prepare_process() -> None:
    """Make the process independent of its environment: threads, display backend, encodings."""
    # one thread of linear algebra: the matrices are small, and results must not depend on it
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    os.environ["MPLBACKEND"] = "agg"  # a notebook's backend may not be installed
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # no messages of its font cache
    signal.signal(signal.SIGTERM, _interrupt)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # not every terminal encodes every character
            stream.reconfigure(errors="backslashreplace")


def _interrupt(*_: object) -> None:
    """End as Ctrl-C does: a batch system asks so, and what is finished is kept and said."""
    raise KeyboardInterrupt


def _fail(message: str, status: int) -> None:
    click.echo(f"echobeam: {message}", err=True)
    sys.exit(status)
