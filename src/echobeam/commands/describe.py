"""Description of a scenario: what `echobeam describe` does."""

from __future__ import annotations

from os import PathLike, fspath

from echobeam.commands.asking import Settings, setting_texts
from echobeam.scenario.load import Source, load_scenario
from echobeam.simulation.description import Description
from echobeam.simulation.description import describe as describe_scenario


def describe(
    scenario: Source,
    *,
    set: Settings | None = None,
    trace: str | PathLike[str] | None = None,
) -> Description:
    """Describe a scenario without running it: link budget, powers in watts, assumptions.

    Parameters
    ----------
    scenario
        A scenario, a built-in scenario's name, or the path of a scenario file.
    set, trace
        As for `run`: overrides, and a file that moves the objects.

    Raises
    ------
    InputError
        If the scenario, one of its schemes or its trace cannot be used.
    """
    loaded = load_scenario(scenario, setting_texts(set))
    return describe_scenario(loaded if trace is None else loaded.with_trace(fspath(trace)))
