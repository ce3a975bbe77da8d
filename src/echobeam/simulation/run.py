"""Runs in memory: many trials as one dataset, or one trial slot by slot."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, SupportsIndex

from echobeam.numerals import whole
from echobeam.scenario.checking import ScenarioError
from echobeam.scenario.load import Source, load_scenario
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import configure_all
from echobeam.simulation.blocks import cut, run_block
from echobeam.simulation.dataset import as_dataset
from echobeam.simulation.loop import SlotRecord, first_trial, run_slots
from echobeam.simulation.randomness import MAX_SEED
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin

if TYPE_CHECKING:
    import xarray as xr


MOST_TRIALS = 10_000_000


def simulate(
    scenario: Source,
    schemes: Sequence[str | object] | None = None,
    trials: SupportsIndex | None = None,
    seed: SupportsIndex = 0,
    *,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> xr.Dataset:
    """Run a scenario and return the result as a labelled dataset.

    Parameters
    ----------
    scenario
        A scenario, a built-in scenario's name, or the path of a scenario file.
    schemes
        Names, with parameters as in ``temporal:ripple=1``; ``path/to/file.py:name``; functions
        ``(prior, view) -> beams`` or whole schemes; those that the scenario names if left out.
    trials
        Number of trials; the scenario's if left out.
    seed
        Same scenario, seed and version give the same numbers, bit for bit.
    progress
        Called with the trial-slots done so far and in all.

    Returns
    -------
    xarray.Dataset
        Variables as in the result file, see the documentation's page on results.

    Raises
    ------
    ScenarioError, SchemeError, TraceError
        If the scenario, a scheme or a trace cannot be used.
    """
    scenario = as_scenario(scenario)
    chosen = configure_all(scenario, schemes)
    count, seed = check_count(scenario.trials if trials is None else trials, seed)
    scene = scene_of(scenario)
    done, total = 0, count * scenario.n_slots * len(chosen)

    def advance(slots: int) -> None:
        nonlocal done
        done += slots
        progress(done, total)

    blocks = [run_block(scene, chosen, seed, block, advance) for block in cut(scenario, count)]
    return as_dataset(scene, [scheme.name for scheme in chosen], seed, blocks)


def slots(
    scenario: Source,
    scheme: str | object = "temporal",
    seed: SupportsIndex = 0,
    trial: SupportsIndex = 0,
) -> Iterator[SlotRecord]:
    """Yield one trial's records slot by slot, as they happen.

    Parameters
    ----------
    scenario, scheme, seed
        As for `simulate`, with one scheme.
    trial
        Which of the seed's trials.
    """
    scenario = as_scenario(scenario)
    (chosen,) = configure_all(scenario, [scheme])
    number = whole(trial)
    if number is None or not 0 <= number < MOST_TRIALS:
        raise ScenarioError(
            f"trial: {trial!r} is not accepted; expected a whole number from 0 to {MOST_TRIALS - 1}"
        )
    _, seed = check_count(1, seed)
    world = begin(scene_of(scenario), seed, range(number, number + 1))
    for record in run_slots(world, chosen):
        yield first_trial(record)


def as_scenario(scenario: Source) -> Scenario:
    """Return a scenario, loading it if its name or file is given."""
    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario)


def check_count(trials: SupportsIndex, seed: SupportsIndex) -> tuple[int, int]:
    """Return the number of trials and the seed, whole numbers of any kind, as Python's.

    Raises
    ------
    ScenarioError
        If they make no sense.
    """
    count, number = whole(trials), whole(seed)
    if count is None or not 1 <= count <= MOST_TRIALS:
        raise ScenarioError(
            f"trials: {trials!r} is not accepted; expected a whole number from 1 to {MOST_TRIALS}"
        )
    if number is None or not 0 <= number <= MAX_SEED:
        raise ScenarioError(
            f"seed: {seed!r} is not accepted; expected a whole number from 0 to 2^63 - 1"
        )
    return count, number
