"""Results that users give: the path of a file, or a dataset that they may have cut."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike, fsdecode
from typing import TYPE_CHECKING

from echobeam.faults import InputError
from echobeam.simulation.layout import disorder
from echobeam.store.result import VARY, open_any

if TYPE_CHECKING:
    import xarray as xr


@contextmanager
def opened(result: xr.Dataset | str | PathLike[str]) -> Iterator[xr.Dataset]:
    """Give a result as it is, or opened from its file and closed afterwards.

    Raises
    ------
    InputError
        If it is no result of a run or of a sweep, or its labels contradict its numbers.
    """
    import xarray as xr

    if isinstance(result, str | PathLike):
        path = fsdecode(result)
        with open_any(path) as dataset:
            _check(dataset, path)
            yield dataset
    elif isinstance(result, xr.Dataset):
        _check(result, "the dataset")
        yield result
    else:
        raise InputError(
            f"{type(result).__name__} is no result; expected a dataset of echobeam or a file's path"
        )


def _check(dataset: xr.Dataset, label: str) -> None:
    fault = _disorder_of_sweep(dataset) if VARY in dataset.attrs else disorder(dataset)
    if fault:
        raise InputError(f"{label}: not a result of echobeam: {fault}")


def _disorder_of_sweep(sweep: xr.Dataset) -> str:
    """Return what a sweep lacks that all its readers need; empty if nothing."""
    try:
        keys = list(json.loads(sweep.attrs[VARY]))
    except (TypeError, ValueError):
        return f"its attribute {VARY} does not say what varies"
    for name in (*keys, "scheme"):
        if name not in sweep.coords:
            return f"no coordinate {name}"
        if sweep[name].ndim != 1:
            return f"no dimension {name} (a cut with a list, isel({{{name!r}: [0]}}), keeps it)"
        if not sweep[name].size:
            return f"nothing along the dimension {sweep[name].dims[0]}"
    return ""
