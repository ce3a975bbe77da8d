"""Summary of a result as a table of schemes and quantities."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from os import PathLike, fsdecode
from typing import TYPE_CHECKING

import numpy as np

from echobeam.commands.results import opened
from echobeam.scenario.checking import checked
from echobeam.scenario.model import Scenario
from echobeam.simulation.quantities import errors_in, errors_of, interval_name, per_slot, scalars
from echobeam.simulation.statistics import NEEDED, needed
from echobeam.simulation.summary import SchemeSummary, summarise
from echobeam.store.result import VARY
from echobeam.store.writing import StoreError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from echobeam.values import Array

Row = tuple[float, float, float]
"""Value and the ends of its 95 % interval; NaN without an interval."""

UNLABELLED_MARK = "frame_gospa"
"""Quantity that only sweeps with unlabelled runs have."""


def summary(result: xr.Dataset | str | PathLike[str]) -> pd.DataFrame:
    """Return the quantities of a result as a table.

    Parameters
    ----------
    result
        Dataset returned by `simulate`, `run` or `sweep`, or the path of a result file.

    Returns
    -------
    pandas.DataFrame
        A row for each scheme and quantity (and point of a sweep), with the columns ``value``,
        ``low`` and ``high`` (95 % interval; NaN without one) and ``unit``. A per-slot quantity,
        such as ``angle_rmse``, is averaged over the slots that have a value.

    Raises
    ------
    InputError
        If it is not a complete result.
    """
    label = fsdecode(result) if isinstance(result, str | PathLike) else "the dataset"
    with opened(result) as dataset:
        return _table(dataset, label)


def _table(dataset: xr.Dataset, label: str) -> pd.DataFrame:
    import pandas as pd

    if VARY in dataset.attrs:
        unlabelled, errors = UNLABELLED_MARK in dataset, errors_in(dataset)
        of_run = scalars(unlabelled=unlabelled, errors=errors)
        over_slots = _over_slots(unlabelled, errors)
        names = [*of_run, *map(interval_name, of_run), *over_slots]
        missing = [name for name in names if name not in dataset]
        if missing:
            raise StoreError(f"{label}: not a whole sweep: {', '.join(missing)} missing")
        dataset = dataset.compute()  # xarray cannot index a file in another order of dimensions
        keys = [str(key) for key in dataset["frame_rate_mean"].dims if key != "scheme"]
        rows = dict(_rows_of_sweep(dataset, keys, unlabelled, errors))
    else:
        keys = []
        scenario = _checked_scenario(dataset, label)
        unlabelled, errors = scenario.unlabelled, errors_of(scenario)
        figures = summarise(dataset, scenario)
        rows = {
            (scheme, name): row
            for scheme, figure in figures.items()
            for name, row in _rows_of_scheme(figure, unlabelled, errors)
        }
    known = scalars(unlabelled=True, errors=errors) | per_slot(unlabelled=True, errors=errors)
    units = {name: unit for name, (unit, _) in known.items()}
    index = pd.MultiIndex.from_tuples(list(rows), names=[*keys, "scheme", "quantity"])
    table = pd.DataFrame(list(rows.values()), index, ["value", "low", "high"], dtype=float)
    return table.assign(unit=[units[str(place[-1])] for place in rows])


def _over_slots(unlabelled: bool, errors: Sequence[str]) -> list[str]:
    """Return the per-slot quantities that the table shows as means over slots.

    The rates are left out: they are given for the whole run.
    """
    names = per_slot(unlabelled=unlabelled, errors=errors)
    return [name for name in names if name not in ("rate_mean", "rate_over_genie")]


def _rows_of_scheme(
    figure: SchemeSummary, unlabelled: bool, errors: Sequence[str]
) -> Iterator[tuple[str, Row]]:
    """Yield the quantities of one scheme of a run."""
    for name in scalars(unlabelled=unlabelled, errors=errors):
        yield name, _row(getattr(figure, name), figure.intervals[name])
    for name in _over_slots(unlabelled, errors):
        yield name, _row(_mean(getattr(figure, name)))


def _rows_of_sweep(
    dataset: xr.Dataset, keys: list[str], unlabelled: bool, errors: Sequence[str]
) -> Iterator[tuple[tuple[object, ...], Row]]:
    """Yield the quantities of every point and scheme of a sweep."""
    axes = [*keys, "scheme"]
    for place in np.ndindex(*(dataset.sizes[axis] for axis in axes)):
        point = dataset.isel(dict(zip(axes, place, strict=True)))
        at = tuple(point[axis].item() for axis in axes)
        for name in scalars(unlabelled=unlabelled, errors=errors):
            yield (*at, name), _row(point[name].item(), point[interval_name(name)].values)
        for name in _over_slots(unlabelled, errors):
            yield (*at, name), _row(_mean(point[name].values))


def _row(value: float, interval: tuple[float, float] | Array | None = None) -> Row:
    low, high = (np.nan, np.nan) if interval is None else interval
    return float(value), float(low), float(high)


def _mean(per_slot: Array) -> float:
    """Return the mean over the slots that have a value; NaN if none has."""
    known = per_slot[np.isfinite(per_slot)]
    return float(known.mean()) if known.size else np.nan


def _checked_scenario(result: xr.Dataset, label: str) -> Scenario:
    """Return the scenario of a complete result of a run.

    Raises
    ------
    InputError
        If the result is incomplete: statistics need every slot and object, and the scheme and
        trial axes.
    """
    text = result.attrs.get("scenario")
    missing = [name for name in NEEDED if name not in result and name != "covered"]
    if missing or text is None:
        lacks = ", ".join(missing) or "the attribute scenario"
        raise StoreError(f"{label}: not a result of echobeam: {lacks} missing")
    try:
        scenario = checked(Scenario, tomllib.loads(str(text)), label)
    except tomllib.TOMLDecodeError as error:
        raise StoreError(f"{label}: its attribute scenario is no TOML: {error}") from None
    missing = [name for name in needed(scenario) if name not in result]
    if missing:
        raise StoreError(f"{label}: not a result of echobeam: {', '.join(missing)} missing")
    axes = ["scheme", "trial", "slot", "object"]
    axes += ["track"] if scenario.unlabelled else []
    lost = [dim for dim in axes if dim not in result.dims]
    if lost:
        raise StoreError(
            f"{label}: has no axis {', '.join(lost)}; select with a list, as in "
            f'result.sel(scheme=["temporal"]) or result.isel(trial=[0])'
        )
    whole = {"slot": scenario.n_slots, "object": scenario.n_objects}
    for dim, count in whole.items():
        if result.sizes[dim] != count:
            raise StoreError(
                f"{label}: has {result.sizes[dim]} of {count} along {dim}; expected all slots and "
                "objects, of any schemes and trials"
            )
    least = scenario.tracks.capacity  # a scheme's own capacity may be larger
    if result.sizes.get("track", least) < least:
        raise StoreError(
            f"{label}: has {result.sizes['track']} columns along track; expected all, at least "
            f"tracks.capacity, {least}"
        )
    return scenario
