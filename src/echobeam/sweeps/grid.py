"""Grids of scenarios: which keys vary, over which values, and what came of it as one dataset."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echobeam.faults import InputError
from echobeam.scenario.load import Source, load_scenario
from echobeam.scenario.model import Scenario
from echobeam.simulation.dataset import attributes
from echobeam.simulation.summary import (
    PER_SLOT,
    SCALARS,
    SLOT_MEANS,
    SchemeSummary,
    summarise_statistics,
)
from echobeam.sweeps.coordinates import coordinate, first_repeated
from echobeam.sweeps.points import Point, Study

if TYPE_CHECKING:
    import xarray as xr


class SweepError(InputError):
    """A grid that makes no sense; the message says what is accepted."""


@dataclass(frozen=True, slots=True)
class Varied:
    """One axis of a grid: a scenario's dotted key and the texts of its values."""

    key: str
    values: tuple[str, ...]


_BETWEEN_VALUES = re.compile(r",(?![^\[]*\])")  # not inside [...], which is one value


def read_varied(text: str) -> Varied:
    """Read ``KEY=V1,V2,...``.

    Raises
    ------
    SweepError
        If it is not of that form.
    """
    key, equals, rest = text.partition("=")
    values = tuple(value.strip().strip("\"'") for value in _BETWEEN_VALUES.split(rest))
    if not equals or not key.strip() or not all(values):
        raise SweepError(f"--vary {text}: expected KEY=V1,V2,..., such as radio.power=0.1,1,10")
    return Varied(key.strip(), values)


@dataclass(frozen=True, slots=True)
class Grid:
    """The product of some axes over a scenario.

    Attributes
    ----------
    source, overrides
        As for `load_scenario`, at every point.
    axes
        What varies.
    trace
        A file that moves the objects at every point; none by default.
    """

    source: Source
    overrides: tuple[str, ...]
    axes: tuple[Varied, ...]
    trace: str | None = None

    @property
    def size(self) -> int:
        """Number of points."""
        return math.prod(len(axis.values) for axis in self.axes)

    def points(
        self, schemes: tuple[str, ...], trials: int | None, keep: tuple[str, ...]
    ) -> list[Point]:
        """Return the grid's points, the last axis fastest.

        Raises
        ------
        SweepError, ScenarioError
            If a key or a value stands twice, a trace would undo it, or a point is no scenario.
        """
        keys = [axis.key for axis in self.axes]
        if not keys:
            raise SweepError("nothing varies; give at least one --vary KEY=V1,V2,...")
        if len(set(keys)) < len(keys):
            raise SweepError("a key is varied twice; give each one once")
        moved = next((key for key in keys if key.split(".")[0] == "objects"), None)
        if self.trace is not None and moved is not None:
            raise SweepError(f"--vary {moved}: not together with --trace, which moves the objects")
        points = []
        for values in itertools.product(*(axis.values for axis in self.axes)):
            settings = [f"{key}={value}" for key, value in zip(keys, values, strict=True)]
            scenario = load_scenario(self.source, [*self.overrides, *settings])
            if self.trace is not None:
                scenario = scenario.with_trace(self.trace)
            points.append(
                Point(
                    name=", ".join(settings),
                    scenario=scenario,
                    schemes=schemes or scenario.schemes,
                    trials=scenario.trials if trials is None else trials,
                    keep=keep,
                )
            )
        self._check_values(points)
        return points

    def along(self, points: Sequence[Point], index: int) -> list[Scenario]:
        """Return a scenario for each value of an axis, the other axes at their first values."""
        stride = math.prod(len(axis.values) for axis in self.axes[index + 1 :])
        count = len(self.axes[index].values)
        return [points[i * stride].scenario for i in range(count)]

    def _check_values(self, points: Sequence[Point]) -> None:
        """Refuse two values that the scenario reads as the same, such as 80 m and 8000 cm."""
        for index, axis in enumerate(self.axes):
            repeated = first_repeated(self.along(points, index), axis.key)
            if repeated is not None:
                one, two = (axis.values[i] for i in repeated)
                raise SweepError(
                    f"--vary {axis.key}: a value stands twice, as {one} and as {two}; "
                    "give each one once"
                )


def grid_dataset(grid: Grid, study: Study) -> xr.Dataset:
    """Return a finished study's figures over the grid, one labelled dimension per varied key.

    A per-slot variable is NaN beyond the slots of a point that has fewer.
    """
    import xarray as xr

    names = scheme_names(study)
    figures = [
        summarise_statistics(study.statistics_of(index), names, point.scenario)
        for index, point in enumerate(study.points)
    ]
    shape = tuple(len(axis.values) for axis in grid.axes)
    dims = tuple(axis.key for axis in grid.axes)
    n_slots = max(point.scenario.n_slots for point in study.points)
    data: dict[
        str,
        tuple[tuple[str, ...], np.ndarray[tuple[int, ...], np.dtype[np.float64]], dict[str, str]],
    ] = {}
    for name, (units, words) in (SCALARS | PER_SLOT).items():
        per_slot = name in PER_SLOT
        values = np.array(
            [
                [_padded(point[scheme], name, n_slots if per_slot else 0) for scheme in names]
                for point in figures
            ]
        )
        data[name] = (
            (*dims, "scheme", *(("slot",) if per_slot else ())),
            values.reshape(*shape, *values.shape[1:]),
            {"units": units, "long_name": words},
        )
    intervals = np.array(
        [[point[scheme].frame_rate_interval for scheme in names] for point in figures]
    )
    data["frame_rate_interval"] = (
        (*dims, "scheme", "end"),
        intervals.reshape(*shape, len(names), 2),
        {"units": "bit/s/Hz", "long_name": "95 % interval of frame_rate_mean"},
    )
    coords: dict[str, object] = {
        axis.key: coordinate(grid.along(study.points, index), axis.key, axis.values)
        for index, axis in enumerate(grid.axes)
    }
    coords |= {"scheme": names, "slot": np.arange(1, n_slots + 1), "end": ["low", "high"]}
    trials = [point.trials for point in study.points]
    attrs: dict[str, object] = dict(attributes(study.points[0].scenario, study.seed, ()))
    attrs["trials"] = trials[0] if len(set(trials)) == 1 else trials  # they may vary, too
    return xr.Dataset(data, coords, attrs)


def tidy_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write one row per point and scheme; of some per-slot figures it has the mean."""
    rates = dataset["frame_rate_interval"]
    flat = dataset[list(SCALARS)].assign({name: dataset[name].mean("slot") for name in SLOT_MEANS})
    flat = flat.assign(
        frame_rate_low=rates.sel(end="low", drop=True),
        frame_rate_high=rates.sel(end="high", drop=True),
    )
    flat.to_dataframe().drop(columns=["slot", "end"], errors="ignore").to_csv(path)


def scheme_names(study: Study) -> list[str]:
    """Return the schemes' names, which every point of a grid shares."""
    from echobeam.schemes.configure import configure_all

    asked = {point.schemes for point in study.points}
    if len(asked) > 1:
        raise SweepError("the schemes vary over the grid; give them with --scheme")
    first = study.points[0]
    return [scheme.name for scheme in configure_all(first.scenario, first.schemes)]


def _padded(figure: SchemeSummary, name: str, n_slots: int) -> object:
    value = np.asarray(getattr(figure, name), dtype=float)
    if n_slots == 0:
        return value
    padded = np.full(n_slots, np.nan)
    padded[: value.size] = value
    return padded
