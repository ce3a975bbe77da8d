"""Options that several commands share, and what is read from them with all faults at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any, TypeVar

import click

from echobeam.faults import InputError

if TYPE_CHECKING:
    from echobeam.scenario.model import Scenario

Function = TypeVar("Function", bound=Callable[..., Any])
Decorator = Callable[[Function], Function]
Found = TypeVar("Found")

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
resume = click.option("--resume", is_flag=True, help="Go on with what was interrupted.")
force = click.option("--force", is_flag=True, help="Replace what is there.")
quiet = click.option("--quiet", is_flag=True, help="Print no progress and no table.")
as_json = click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print the summary as JSON, and nothing else, on stdout.",
)


TRACEBACK = "echobeam.traceback"
"""Key of click's context under which `traceback` is noted."""

traceback = click.option(
    "--traceback",
    is_flag=True,
    expose_value=False,
    callback=lambda context, option, asked: context.meta.__setitem__(TRACEBACK, asked),
    help="Print the traceback of a user's scheme that fails.",
)


def out(default: str) -> Decorator[Any]:
    """Return the option of the result file; ``default`` says where it is without it."""
    return click.option(
        "--out",
        type=click.Path(path_type=Path),
        metavar="PATH",
        help=f"Result file. Default: {default} here.",
    )


def together(*options: Decorator[Any]) -> Decorator[Any]:
    """Return options as one decorator; help lists them in this order."""

    def decorate(function: Any) -> Any:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


work = together(jobs, dask, resume, force, quiet)
"""How the work is done, and how much is said of it."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What a scenario and the options given with it come to, all of it known to be usable."""

    scenario: Scenario
    schemes: tuple[str, ...]
    trials: int
    seed: int


class Faults:
    """Collects what is wrong, so that a user hears all of it at once."""

    def __init__(self) -> None:
        self.messages: list[str] = []
        self.details = ""

    def of(self, read: Callable[..., Found], *arguments: object) -> Found | None:
        """Return what a call gives, or keep its fault and return None."""
        try:
            return read(*arguments)
        except InputError as error:
            self.messages.append(str(error))
            self.details += error.details
            return None

    def check(self) -> None:
        """Raise the faults found, if any.

        Raises
        ------
        InputError
            The only one as it is, several as a list.
        """
        if len(self.messages) > 1:
            listed = "\n".join(indent(message, "  ") for message in self.messages)
            raise InputError(f"{len(self.messages)} things are wrong\n{listed}", self.details)
        if self.messages:
            raise InputError(self.messages[0], self.details)


def read(
    source: str,
    overrides: Sequence[str],
    trace: str | None,
    schemes: Sequence[str],
    trials: int | None,
    seed: int,
    also: Sequence[Callable[[], object]] = (),
) -> Asked:
    """Read a scenario with the schemes and numbers given for it.

    Parameters
    ----------
    also
        Whatever else is to be read; its faults are told with the others.

    Raises
    ------
    InputError
        Tells all that is wrong at once.
    """
    from echobeam.scenario.built_in import BUILT_IN
    from echobeam.scenario.load import load_scenario
    from echobeam.schemes.configure import configure_all
    from echobeam.simulation.run import check_count

    faults = Faults()
    for text in overrides:
        faults.of(_check_setting, text)
    scenario = faults.of(load_scenario, source, [text for text in overrides if "=" in text])
    if scenario is not None and trace is not None:
        scenario = faults.of(scenario.with_trace, trace)
    for name in schemes:
        faults.of(configure_all, scenario or load_scenario(BUILT_IN[0]), [name])
    if scenario is not None and not schemes:
        faults.of(_labelled, source, configure_all, scenario, None)
    faults.of(check_count, 1 if trials is None else trials, 0)
    faults.of(check_count, 1, seed)
    for further in also:
        faults.of(further)
    faults.check()
    assert scenario is not None
    count = scenario.trials if trials is None else trials
    return Asked(scenario, tuple(schemes) or scenario.schemes, count, seed)


def _labelled(label: str, read: Callable[..., Found], *arguments: object) -> Found:
    """Return what a call gives; its fault says where it stands."""
    try:
        return read(*arguments)
    except InputError as error:
        raise InputError(
            "\n".join(f"{label}: {line}" for line in str(error).splitlines()), error.details
        ) from None


def _check_setting(text: str) -> None:
    """Refuse an override that is none; the others are read with the scenario."""
    if "=" not in text:
        raise InputError(f"--set {text}: expected KEY=VALUE, such as uav.height='80 m'")
