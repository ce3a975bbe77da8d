"""Runs of a scenario to a result file: the command `echobeam run`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, SupportsIndex

from echobeam.commands.asking import Asked, Request, Settings, request, target
from echobeam.commands.progress import Bar, interactive_bar
from echobeam.scenario.load import Source
from echobeam.store.recording import Done, Recording, record
from echobeam.store.result import open_result
from echobeam.traces.progress import reading_shown

if TYPE_CHECKING:
    import xarray as xr


def run(
    scenario: Source,
    *,
    schemes: str | Sequence[str] | None = None,
    trials: SupportsIndex | None = None,
    seed: SupportsIndex = 0,
    out: str | PathLike[str] | None = None,
    set: Settings | None = None,
    trace: str | PathLike[str] | None = None,
    jobs: SupportsIndex = 1,
    dask: str | None = None,
    resume: bool = False,
    force: bool = False,
    quiet: bool = False,
    scheme: str | Sequence[str] | None = None,
) -> xr.Dataset:
    """Run a scenario, write a result file and open it: `echobeam run`.

    Parameters
    ----------
    scenario
        A scenario, a built-in scenario's name, or the path of a scenario file.
    schemes, scheme
        Names, with parameters as in ``temporal:ripple=1``, or ``path/to/file.py:name``; the
        scenario's by default.
    trials
        Number of trials; the scenario's by default.
    seed
        Same scenario, seed and version give the same numbers, bit for bit.
    out
        Result file; by default the name of the scenario or of its file with ``.nc``, in the current
        directory.
    set
        Overrides of the scenario: ``{"uav.height": "80 m"}``, or texts ``"uav.height=80 m"``.
    trace
        A SUMO FCD XML or a CSV file that moves the objects; either may be ``.gz``.
    jobs
        Processes on this machine.
    dask
        Address of a Dask scheduler to run on instead.
    resume
        Continue an interrupted run.
    force
        Replace an existing result.
    quiet
        Show no progress; otherwise terminals and notebooks show it.

    Returns
    -------
    xarray.Dataset
        Result, loaded lazily from its file; ``with eb.run(...) as result`` closes it.

    Raises
    ------
    InputError
        If the input is wrong; all errors in one message.
    RunError
        If the run could not be finished; its finished blocks are stored for ``resume``.
    """
    asked = request(
        scenario,
        schemes=schemes,
        scheme=scheme,
        trials=trials,
        seed=seed,
        set=set,
        trace=trace,
        jobs=jobs,
        dask=dask,
        resume=resume,
        force=force,
    )
    place = None if out is None else Path(out)
    return open_result(record_run(asked, place, partial(interactive_bar, quiet=quiet)).out)


class RunDone(NamedTuple):
    """Finished run: its request, the path of its result, and the work done."""

    asked: Asked
    out: Path
    done: Done


def record_run(wanted: Request, out: Path | None, bar: Bar) -> RunDone:
    """Run a request and write its result file, for the command and `run` alike."""
    asked = wanted.read([partial(wanted.check_place, out)])
    recording = Recording(
        asked.scenario,
        asked.schemes,
        asked.trials,
        asked.seed,
        out=target(out, wanted.source, asked.scenario, ".nc"),
        workers=wanted.workers,
        resume=wanted.resume,
        force=wanted.force,
    )
    with reading_shown(bar), bar(asked.scenario.name) as progress:
        done = record(recording, progress)
    return RunDone(asked, recording.out, done)
