"""Checks of the receiver: what `echobeam sense` does."""

from __future__ import annotations

from functools import partial
from os import PathLike
from pathlib import Path
from typing import Literal, NamedTuple, SupportsIndex

from echobeam.commands.asking import Settings, setting_texts
from echobeam.commands.progress import Bar, interactive_bar
from echobeam.plots.record import FigureData
from echobeam.plots.saving import write
from echobeam.plots.sensing import sensing
from echobeam.scenario.load import Source, load_scenario
from echobeam.scenario.model import Scenario
from echobeam.simulation.run import check_count
from echobeam.simulation.sensing_check import SensingCheck, check_sensing
from echobeam.store.writing import check_writable

Mode = Literal["directional", "omni"]


def sense(
    scenario: Source,
    *,
    trials: SupportsIndex | None = None,
    seed: SupportsIndex = 0,
    mode: Mode = "directional",
    set: Settings | None = None,
    out: str | PathLike[str] | None = None,
    force: bool = False,
    quiet: bool = False,
) -> SensingCheck:
    """Check the receiver's estimators against the bounds: `echobeam sense`.

    Parameters
    ----------
    scenario
        A scenario, a built-in scenario's name, or the path of a scenario file.
    trials
        Trials for each SNR; the scenario's if left out.
    seed
        Seed of all randomness.
    mode
        Transmission: ``"directional"``, a beam matched to the first object, or ``"omni"``.
    set
        Overrides of the scenario, as for `run`.
    out
        Pictures (``.png``, ``.pdf``, ``.svg``) or data (``.csv``, ``.json``); none if left out.
    force
        Replace an existing file.
    quiet
        Show no progress.

    Raises
    ------
    InputError
        If what was given cannot be used, or the first object is beyond the waveform's unambiguous
        delay or Doppler.
    """
    bar = partial(interactive_bar, quiet=quiet)
    place = None if out is None else Path(out)
    return record_check(scenario, trials, seed, mode, setting_texts(set), place, force, bar).check


class SensingDone(NamedTuple):
    """A check that is done, of which scenario."""

    scenario: Scenario
    check: SensingCheck


def record_check(
    source: Source,
    trials: SupportsIndex | None,
    seed: SupportsIndex,
    mode: Mode,
    overrides: tuple[str, ...],
    out: Path | None,
    force: bool,
    bar: Bar,
) -> SensingDone:
    """Check a receiver and write the picture; for the command and `sense` alike."""
    scenario = load_scenario(source, list(overrides))
    count, seed = check_count(scenario.trials if trials is None else trials, seed)
    if out is not None:
        check_writable(out, force=force)
    with bar(f"{scenario.name}: sensing") as progress:
        check = check_sensing(scenario, count, seed, mode, progress)
    if out is not None:
        write(figure_of(scenario, check, mode), out)
    return SensingDone(scenario, check)


def figure_of(scenario: Scenario, check: SensingCheck, mode: Mode) -> FigureData:
    """Return the figure of a check."""
    radar, array = scenario.radar, scenario.array
    setting = (
        f"$N_t$ = {array.n_tx}, $N_r$ = {array.receivers}, {mode}; {radar.bandwidth / 1e6:g} MHz, "
        f"{radar.subcarriers} subcarriers, {radar.symbols} symbols, {radar.modulation}"
    )
    return sensing(check, f"{scenario.name}: estimators against their bounds", setting)
