"""Sweeps to files: one tidy result, and optionally each point's full result beside it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echobeam.simulation.dataset import TRACK_VARIABLES, VARIABLES
from echobeam.store.block_files import BlockFiles
from echobeam.store.recording import Done
from echobeam.store.result import VARY, WHOLE_RESULT, write_dataset, write_result
from echobeam.store.work import Progress
from echobeam.store.workers import HERE, Workers, do_all
from echobeam.store.writing import StoreError, check_writable, clear_leftovers, replacing
from echobeam.sweeps.grid import Grid, grid_dataset, scheme_names, tidy_csv
from echobeam.sweeps.points import Study, holding

if TYPE_CHECKING:
    import xarray as xr

WHOLE = (*VARIABLES, *TRACK_VARIABLES)
"""Variables stored for every point if full results are requested."""

JOB = "job"
"""Attribute of a sweep's result with the SHA-256 of its job."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """Sweep over a grid, and its files.

    Attributes
    ----------
    grid
        Grid of scenarios.
    schemes, trials, seed
        As for `simulate`, at every point; None for the scenario's number of trials.
    out
        Path of the tidy result; full results are in a directory beside it.
    csv
        Path of a CSV table of the quantities, if wanted.
    full
        Whether to write every point's full result too.
    workers, resume, force
        As for a `Recording`.
    """

    grid: Grid
    schemes: tuple[str, ...]
    trials: int | None
    seed: int
    out: Path
    csv: Path | None = None
    full: bool = False
    workers: Workers = HERE
    resume: bool = False
    force: bool = False

    def study(self) -> Study:
        """Return the study of all points."""
        points = self.grid.points(self.schemes, self.trials, WHOLE if self.full else ())
        return Study(tuple(points), self.seed, BlockFiles.beside(self.out))

    def vary(self) -> str:
        """Return the varied keys, as stored in the result."""
        return json.dumps({key: values for axis in self.grid.axes for key, values in axis.columns})


def point_path(out: Path, index: int) -> Path:
    """Return the file of one point's full result, counted from 0 in the grid's order."""
    return out.parent / f"{out.stem}-points" / f"{index + 1:04d}.nc"


def record_sweep(sweep: Sweep, progress: Progress = lambda done, total: None) -> Done:
    """Run a grid of scenarios to its files.

    Returns
    -------
    Done
        Work done, with the decision times of every point in the grid's order.

    Raises
    ------
    StoreError, ScenarioError, SchemeError, SweepError
        If the input is wrong; then nothing was run.
    RunError
        If the work could not be finished; its finished blocks stay on disk.
    """
    study = sweep.study()
    names = scheme_names(study)
    if sweep.resume and not sweep.force and _finished(sweep, study):
        study.files.remove()
        return Done(_write_csv(sweep))
    _check_places(sweep, study)
    with holding(study, resume=sweep.resume, force=sweep.force):
        clear_leftovers(sweep.out)
        do_all(study, sweep.workers, progress)
        if sweep.full:
            _write_points(sweep, study, names)
        dataset = grid_dataset(sweep.grid, study)
        dataset.attrs |= {JOB: study.job().digest(), VARY: sweep.vary()}
        if sweep.full:
            dataset[WHOLE_RESULT] = _point_names(sweep, study)
        write_dataset(sweep.out, dataset)
        _write_csv(sweep)
        decisions = tuple(study.decisions(index, names) for index in range(len(study.points)))
        study.files.remove()
    return Done(anything=True, decisions=decisions)


def open_sweep(path: Path) -> xr.Dataset:
    """Open a sweep's result.

    Raises
    ------
    StoreError
        If the file is not the result of a sweep.
    """
    import xarray as xr

    try:
        dataset = xr.open_dataset(path, engine="h5netcdf")
    except (OSError, ValueError, KeyError) as error:
        raise StoreError(f"{path}: not a NetCDF-4 file: {error}") from None
    if JOB not in dataset.attrs:
        dataset.close()
        raise StoreError(f"{path}: not the result of a sweep")
    return dataset


def _finished(sweep: Sweep, study: Study) -> bool:
    """Return whether all results exist: a sweep may be killed after it wrote its last file."""
    if not sweep.out.is_file():
        return False
    try:
        with open_sweep(sweep.out) as found:
            same = (found.attrs[JOB], found.attrs[VARY]) == (study.job().digest(), sweep.vary())
            dims = found["frame_rate_mean"].dims[:-1]
    except StoreError:
        return False
    along = tuple(axis.key for axis in sweep.grid.axes)
    return same and dims == along and all(path.is_file() for path in _point_paths(sweep, study))


def _check_places(sweep: Sweep, study: Study) -> None:
    """Refuse existing files, except those of the interrupted sweep itself."""
    if sweep.csv is not None and sweep.csv.resolve() == sweep.out.resolve():
        raise StoreError(f"{sweep.csv}: is the result file; give another --csv")
    ours = sweep.resume and study.files.matches(study.job())
    for path in filter(None, (sweep.out, sweep.csv)):
        check_writable(path, force=sweep.force)
    folder = point_path(sweep.out, 0).parent
    if sweep.full and folder.exists() and not folder.is_dir():
        raise StoreError(
            f"{folder}: exists and is not a directory of points' results; give another --out"
        )
    for path in _point_paths(sweep, study):
        if path.exists() and not (ours or sweep.force):
            raise StoreError(
                f"{path}: exists already; give another --out, or --force to replace it"
            )


def _point_paths(sweep: Sweep, study: Study) -> list[Path]:
    count = len(study.points) if sweep.full else 0
    return [point_path(sweep.out, index) for index in range(count)]


def _write_points(sweep: Sweep, study: Study, names: Sequence[str]) -> None:
    """Write every point's full result, one block in memory at a time."""
    if sweep.force:
        for stale in point_path(sweep.out, 0).parent.glob("[0-9][0-9][0-9][0-9].nc"):
            stale.unlink()  # from a grid with more points
    for index, path in enumerate(_point_paths(sweep, study)):
        path.parent.mkdir(exist_ok=True)
        clear_leftovers(path)
        point = study.points[index]
        blocks = study.kept_blocks(index)
        write_result(path, study.scenes[index], names, study.seed, point.trials, blocks)


def _point_names(sweep: Sweep, study: Study) -> xr.Variable:
    """Return the file names of the points' full results over the grid."""
    import xarray as xr

    paths = [str(path.relative_to(sweep.out.parent)) for path in _point_paths(sweep, study)]
    shape = [len(axis.values) for axis in sweep.grid.axes]
    dims = [axis.key for axis in sweep.grid.axes]
    words = {"long_name": "file of the point's full result, beside this one"}
    return xr.Variable(dims, np.array(paths).reshape(shape), words)


def _write_csv(sweep: Sweep) -> bool:
    """Write the table if it is requested and missing; return whether it was written."""
    if sweep.csv is None or (sweep.csv.exists() and not sweep.force):
        return False
    with open_sweep(sweep.out) as dataset, replacing(sweep.csv) as temporary:
        tidy_csv(dataset, temporary)
    return True
