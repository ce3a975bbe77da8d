"""Runs in memory, on one or several processes of this machine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, SupportsIndex

from echobeam.commands.asking import job_count
from echobeam.commands.progress import interactive_bar
from echobeam.scenario.load import Source
from echobeam.schemes.base import SchemeError
from echobeam.schemes.configure import configure_all
from echobeam.simulation.blocks import cut
from echobeam.simulation.dataset import as_dataset
from echobeam.simulation.run import as_scenario, check_count
from echobeam.simulation.run import simulate as simulate_here
from echobeam.simulation.scene import scene_of
from echobeam.store.block_files import BlockFiles
from echobeam.store.inputs import CodeFiles
from echobeam.store.recording import BlockWork
from echobeam.store.workers import Workers, do_all

if TYPE_CHECKING:
    import xarray as xr

    from echobeam.scenario.model import Scenario
    from echobeam.store.work import Progress


def simulate(
    scenario: Source,
    schemes: str | Sequence[str | object] | None = None,
    trials: SupportsIndex | None = None,
    seed: SupportsIndex = 0,
    *,
    jobs: SupportsIndex = 1,
    progress: bool | Callable[[int, int], None] = True,
) -> xr.Dataset:
    """Run a scenario in memory and return the result as a labelled dataset.

    Parameters
    ----------
    scenario
        A scenario, a built-in scenario's name, or the path of a scenario file.
    schemes
        Names, with parameters as in ``temporal:ripple=1``; ``path/to/file.py:name``; functions
        ``(prior, view) -> beams`` or whole schemes; the scenario's by default.
    trials
        Number of trials; the scenario's by default.
    seed
        Same scenario, seed and version give the same numbers, bit for bit.
    jobs
        Number of processes on this machine; results do not depend on it. With more than one, a
        function or object given as a scheme must come from an importable module.
    progress
        Whether long runs show progress in a terminal or notebook; or a function that is called
        with the trial-slots done and the total.

    Returns
    -------
    xarray.Dataset
        Variables of the result file, see the documentation's page on results.

    Raises
    ------
    ScenarioError, SchemeError, TraceError
        If the scenario, a scheme or a trace cannot be used.
    RunError
        If worker processes die repeatedly.
    """
    processes = job_count(jobs)
    scenario = as_scenario(scenario)
    asked = _listed(scenario.schemes if schemes is None else schemes)
    with _shown(progress, scenario.name) as show:
        if processes == 1:
            return simulate_here(scenario, asked, trials, seed, progress=show)
        return _spread(scenario, asked, trials, seed, processes, show)


def _listed(schemes: object) -> tuple[str | object, ...]:
    """Return schemes as a tuple; a single scheme needs no list."""
    if isinstance(schemes, str) or not isinstance(schemes, Iterable):
        return (schemes,)
    return tuple(schemes)


def _spread(
    scenario: Scenario,
    schemes: tuple[str | object, ...],
    trials: SupportsIndex | None,
    seed: SupportsIndex,
    jobs: int,
    show: Progress,
) -> xr.Dataset:
    """Run blocks in several processes, which write them to a temporary directory."""
    names = [scheme.name for scheme in configure_all(scenario, schemes)]
    count, seed = check_count(scenario.trials if trials is None else trials, seed)
    for scheme, name in zip(schemes, names, strict=True):
        _check_portable(scheme, name, jobs)
    scene, blocks = scene_of(scenario), tuple(cut(scenario, count))
    with TemporaryDirectory(prefix="echobeam-", ignore_cleanup_errors=True) as folder:
        files = BlockFiles(Path(folder))
        code = CodeFiles.of(scenario, [one for one in schemes if isinstance(one, str)])
        do_all(BlockWork(scene, schemes, seed, blocks, files, code), Workers(jobs), show)
        return as_dataset(scene, names, seed, [files.read(index) for index in range(len(blocks))])


def _shown(progress: bool | Progress, label: str) -> AbstractContextManager[Progress]:
    if callable(progress):
        return nullcontext(progress)
    return interactive_bar(label, quiet=not progress)


def _check_portable(scheme: str | object, name: str, jobs: int) -> None:
    """Refuse a scheme that cannot be sent to another process.

    Raises
    ------
    SchemeError
        With the alternatives in the message.
    """
    if isinstance(scheme, str):
        return
    reason = ""
    try:
        sent = bytes(ForkingPickler.dumps(scheme))
    except Exception as error:  # pickling a user's object may raise any exception
        reason = f"{type(error).__name__}: {error}"
    else:
        if b"__main__" in sent:
            reason = "it is defined in the script or notebook itself"
    if reason:
        raise SchemeError(
            f"scheme {name!r} cannot be sent to other processes ({reason}); define it in a file of "
            f"its own and import it or give path/to/file.py:name, or run it with jobs=1, not {jobs}"
        )
