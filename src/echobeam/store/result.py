"""Result files: NetCDF-4, written block by block, readable by any NetCDF library."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from echobeam.simulation.blocks import Block, trial_axis
from echobeam.simulation.dataset import (
    TRACK_VARIABLES,
    attributes,
    coordinates,
    phases,
    sizes_of,
    variables_of,
)
from echobeam.simulation.layout import disorder, sizes_in
from echobeam.simulation.scene import Scene
from echobeam.store.sink import netcdf_file
from echobeam.store.writing import StoreError

if TYPE_CHECKING:
    import xarray as xr

VARY, WHOLE_RESULT = "vary", "result"
"""Attribute with the varied keys of a sweep's result, and variable with the file of every point's
full result, if stored."""


COORDINATES = ("scheme", "slot", "time", "phase", "state", "measurement")
"""Coordinates of a result that plots and summaries need."""


def write_result(
    path: Path,
    scene: Scene,
    names: Sequence[str],
    seed: int,
    trials: int,
    blocks: Iterable[Block],
) -> None:
    """Write a result file from its blocks, one in memory at a time.

    Raises
    ------
    OSError
        If the disk is full or the path cannot be written; then no file remains.
    """
    scenario = scene.scenario
    with netcdf_file(path) as (file, check):
        file.dimensions = {
            "scheme": len(names),
            "trial": trials,
            "slot": scenario.n_slots,
            "object": scenario.n_objects,
            "antenna": scenario.array.weights,
            **sizes_of(scenario),
        }
        for name, value in attributes(scenario, seed, scene.mover.names).items():
            file.attrs[name] = _storable(value)
        extremes: list[tuple[npt.NDArray[np.generic], npt.NDArray[np.generic]]] = []
        for index, block in enumerate(blocks):
            if index == 0:
                _create_variables(file, block)
            _write_block(file, block)
            mode = block.arrays["mode"]
            extremes.append((mode.min(axis=1), mode.max(axis=1)))
            check()
        lowest, highest = (np.stack(each) for each in zip(*extremes, strict=True))
        phase = phases(lowest.min(axis=0), highest.max(axis=0))
        for name, (dims, values, attrs) in coordinates(scenario, names, trials, phase).items():
            _write_variable(file, name, dims, values, attrs)


def _write_variable(
    file: Any,
    name: str,
    dims: Sequence[Hashable],
    values: npt.NDArray[np.generic],
    attrs: Mapping[Any, object],
) -> None:
    """Write a complete variable of numbers or strings."""
    import h5py

    text = values.dtype.kind in "UO"
    dtype = h5py.string_dtype() if text else values.dtype
    variable = file.create_variable(name, dims, dtype)
    variable[...] = _texts(values) if text else values
    for key, value in attrs.items():
        variable.attrs[key] = value


def _storable(value: object) -> object:
    """Return strings that UTF-8 can encode: file names may contain other bytes."""
    if isinstance(value, list):
        return [_storable(item) for item in value]
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode("utf-8")
    return value


def _texts(values: npt.NDArray[np.generic]) -> npt.NDArray[np.object_]:
    texts = [_storable(str(value)) for value in values.ravel()]
    return np.array(texts, dtype=object).reshape(values.shape)


def _create_variables(file: Any, block: Block) -> None:
    if "track_id" in block.arrays:  # an unlabelled run
        file.dimensions["track"] = block.arrays["track_id"].shape[-1]
    for name, variable in variables_of(block.arrays).items():
        dtype = block.arrays[name].dtype
        created = file.create_variable(
            name, variable.dims, np.dtype("i1") if dtype.kind == "b" else dtype
        )
        for key, value in variable.attributes.items():
            created.attrs[key] = value
        with_phase = {"scheme", "slot"} <= set(variable.dims)
        created.attrs["coordinates"] = "time phase" if with_phase else "time"
        if dtype.kind == "b":
            created.attrs["dtype"] = "bool"


def _write_block(file: Any, block: Block) -> None:
    for name in variables_of(block.arrays):
        values, axis = block.arrays[name], trial_axis(name)
        if not values.size:
            continue
        place: tuple[slice, ...] = (slice(None),)
        if axis is not None:
            rows = slice(block.first, block.first + values.shape[axis])
            place = (slice(None),) * axis + (rows,)
        file.variables[name][place] = values.astype("i1") if values.dtype.kind == "b" else values


def write_dataset(path: Path, dataset: xr.Dataset) -> None:
    """Write a small dataset of numbers and strings.

    Raises
    ------
    OSError
        If the disk is full or the path cannot be written; then no file remains.
    """
    with netcdf_file(path) as (file, _):
        file.dimensions = dict(dataset.sizes)
        beside = [str(name) for name in dataset.coords if name not in dataset.dims]
        words = (
            {"coordinates": " ".join(beside)} if beside else {}
        )  # the CF attribute that lists coordinates
        for key, value in (dataset.attrs | words).items():
            file.attrs[key] = _storable(value)
        for name, variable in dataset.variables.items():
            _write_variable(file, str(name), variable.dims, variable.values, variable.attrs)


def open_result(path: str | Path) -> xr.Dataset:
    """Open the result file of a run lazily.

    Raises
    ------
    StoreError
        If there is no such file, or it is not the result of a run.
    """
    result = open_any(path)
    if VARY in result.attrs:
        instead = _instead_of_sweep(result, Path(path))
        result.close()
        raise StoreError(f"{path}: the result of a sweep, not of one run; {instead}")
    return result


def open_any(path: str | Path) -> xr.Dataset:
    """Open the result file of a run or of a sweep lazily.

    Raises
    ------
    StoreError
        If there is no such file, or it is not a result.
    """
    import xarray as xr

    path = Path(path)
    if not path.is_file():
        raise StoreError(f"{path}: no such result file; make one with `echobeam run`")
    try:
        result = xr.open_dataset(path, engine="h5netcdf")
    except (OSError, ValueError, KeyError) as error:
        raise StoreError(
            f"{path}: not a NetCDF-4 file, or a damaged one ({type(error).__name__})"
        ) from None
    if isinstance(result.attrs.get("names"), str):  # HDF5 returns a list of one as a text
        result.attrs["names"] = [result.attrs["names"]]
    if VARY in result.attrs:
        return result
    misfit = _misfit(result)
    if misfit:
        result.close()
        raise StoreError(f"{path}: not a result of echobeam: {misfit}")
    return result


def _misfit(result: xr.Dataset) -> str:
    """Return the reason why a dataset is not a result: users save selections of results."""
    variables = variables_of(result.variables)
    missing = [name for name in (*variables, *COORDINATES) if name not in result.variables] + [
        name for name in ("scenario", "seed") if name not in result.attrs
    ]
    if missing:
        return f"{', '.join(missing)} missing"
    wanted = dict.fromkeys(
        dim
        for name, variable in variables.items()
        if name not in TRACK_VARIABLES
        for dim in variable.dims
    )
    for dim in wanted:
        if dim not in result.dims:
            return f"no dimension {dim} (select with a list, such as isel({dim}=[0]), to keep it)"
    for name, variable in variables.items():
        if result[name].dims != variable.dims:
            dims, expected = ", ".join(map(str, result[name].dims)), ", ".join(variable.dims)
            joined = set(variable.dims) < set(result[name].dims) <= set(wanted)
            hint = " (xarray.concat with data_vars='minimal' keeps them)" if joined else ""
            return f"{name} has the dimensions {dims}; expected {expected}{hint}"
    for dim, size in sizes_in(result).items():
        if result.sizes[dim] != size:
            return f"{result.sizes[dim]} along the dimension {dim}; expected {size}"
    return disorder(result)


def _instead_of_sweep(sweep: xr.Dataset, path: Path) -> str:
    """Return as text which results of runs belong to a sweep, or how to obtain them."""
    if WHOLE_RESULT not in sweep:
        return "`echobeam sweep --full` also stores every point's full result, which can be plotted"
    first = path.parent / str(sweep[WHOLE_RESULT].values.flat[0])
    return f"use that of a point, such as {first}"
