"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar, Unpack

import click

if TYPE_CHECKING:
    from echobeam.commands.asking import Request

Function = TypeVar("Function", bound=Callable[..., Any])
Decorator = Callable[[Function], Function]

scheme = click.option(
    "--scheme",
    "schemes",
    multiple=True,
    metavar="NAME",
    help="Scheme by name or path/to/file.py:name, with parameters as in temporal:ripple=1; "
    "repeatable. Default: the scenario's.",
)
trials = click.option(
    "--trials", type=int, metavar="N", help="Number of trials. Default: the scenario's."
)
seed = click.option(
    "--seed", type=int, default=0, show_default=True, metavar="N", help="Seed of all randomness."
)
overrides = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help='Override a key of the scenario, such as uav.height="80 m"; repeatable.',
)
trace = click.option(
    "--trace",
    type=click.Path(),
    metavar="FILE",
    help="Move the objects by a SUMO FCD XML or a CSV trace; either may be .gz.",
)
jobs = click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    metavar="N",
    help="Processes on this machine.",
)
dask = click.option("--dask", metavar="ADDRESS", help="Run on an existing Dask scheduler.")
resume = click.option("--resume", is_flag=True, help="Continue an interrupted run.")
force = click.option("--force", is_flag=True, help="Replace existing results.")
quiet = click.option("--quiet", is_flag=True, help="Print no progress and no table.")
as_json = click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print the summary as JSON, and nothing else, on stdout.",
)


TRACEBACK = "echobeam.traceback"
"""Key of click's context that holds the option `traceback`."""

traceback = click.option(
    "--traceback",
    is_flag=True,
    expose_value=False,
    callback=lambda context, option, asked: context.meta.__setitem__(TRACEBACK, asked),
    help="Print the traceback of a user's scheme that fails.",
)


def out(default: str) -> Decorator[Any]:
    """Return the option of the result file, with its default path."""
    return click.option(
        "--out",
        type=click.Path(path_type=Path),
        metavar="PATH",
        help=f"Result file. Default: {default} here.",
    )


def together(*options: Decorator[Any]) -> Decorator[Any]:
    """Return several options as one decorator; help lists them in this order."""

    def decorate(function: Any) -> Any:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


class Wanted(TypedDict):
    """Options shared by `run` and `sweep`, as click gives them."""

    schemes: tuple[str, ...]
    trials: int | None
    seed: int
    overrides: tuple[str, ...]
    trace: str | None
    jobs: int
    dask: str | None
    resume: bool
    force: bool


def request(scenario: str, **wanted: Unpack[Wanted]) -> Request:
    """Return the request that the command line makes."""
    from echobeam.commands.asking import Request
    from echobeam.store.workers import Workers

    return Request(
        scenario,
        wanted["schemes"],
        wanted["trials"],
        wanted["seed"],
        wanted["overrides"],
        wanted["trace"],
        Workers(wanted["jobs"], wanted["dask"]),
        wanted["resume"],
        wanted["force"],
    )


work = together(jobs, dask, resume, force, quiet)
"""Options of the processes, of resuming and overwriting, and of the output."""
