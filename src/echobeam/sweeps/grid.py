"""Grids of scenarios: the varied keys, their values, and the results as one dataset."""

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
from echobeam.simulation.quantities import (
    errors_in,
    errors_of,
    interval_name,
    per_slot,
    scalars,
    slot_means,
)
from echobeam.simulation.summary import SchemeSummary, summarise_statistics
from echobeam.sweeps.coordinates import coordinate, first_repeated
from echobeam.sweeps.points import Point, Study

if TYPE_CHECKING:
    import xarray as xr


MOST_POINTS = 100_000
"""Points of a grid: each takes a tenth of a second at least, and a grid is in memory at once."""


class SweepError(InputError):
    """Error of a grid that is not accepted; the message says what is."""


@dataclass(frozen=True, slots=True)
class Varied:
    """Axis of a grid: a scenario's dotted key and its values as strings.

    Attributes
    ----------
    key
        Dotted key, and name of the dimension.
    values
        Values, one for each point of the axis.
    others
        Further keys that vary together with it, each with the same number of values.
    """

    key: str
    values: tuple[str, ...]
    others: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def __post_init__(self) -> None:
        for key, values in self.others:
            if len(values) != len(self.values):
                raise SweepError(
                    f"--vary {self.name}: {key} has {len(values)} values, {self.key} has "
                    f"{len(self.values)}; keys that vary together need equally many"
                )

    @property
    def columns(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Keys with their values."""
        return ((self.key, self.values), *self.others)

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the axis."""
        return tuple(key for key, _ in self.columns)

    @property
    def name(self) -> str:
        """Keys of the axis as given on the command line."""
        return ",".join(self.keys)

    def settings(self, index: int) -> list[tuple[str, str]]:
        """Return every key with its value at a point of the axis."""
        return [(key, values[index]) for key, values in self.columns]

    def text(self, index: int) -> str:
        """Return a point of the axis as text: a single value if all keys have the same."""
        texts = [values[index] for _, values in self.columns]
        return texts[0] if len(set(texts)) == 1 else f"({', '.join(texts)})"


def together(keys: Sequence[str], points: Sequence[Sequence[str]]) -> Varied:
    """Return an axis along which several keys vary together, each with its own values.

    Parameters
    ----------
    keys
        Dotted keys; the first one names the dimension.
    points
        For each point of the axis, one value as a string for each key.

    Raises
    ------
    SweepError
        If there is no key or no point, or a point has the wrong number of values.
    """
    name = ",".join(keys)
    if not keys or not points:
        raise SweepError(f"--vary {name}: no key or no value; expected keys and values")
    for point in points:
        if len(point) != len(keys):
            raise SweepError(
                f"--vary {name}: ({', '.join(point)}) is not accepted; expected {len(keys)} values"
            )
    first, *others = zip(keys, zip(*points, strict=True), strict=True)
    return Varied(*first, tuple(others))


_BETWEEN_VALUES = re.compile(r",(?![^\[]*\])")  # not inside [...], a list is one value


def read_varied(text: str) -> Varied:
    """Read ``KEY=V1,V2,...``, or ``KEY1,KEY2=V1,V2,...`` with the same values for all keys.

    Raises
    ------
    SweepError
        If the text has neither form.
    """
    names, equals, rest = text.partition("=")
    keys = [key.strip() for key in names.split(",")]
    values = tuple(value.strip().strip("\"'") for value in _BETWEEN_VALUES.split(rest))
    if not equals or not all(keys) or not all(values):
        raise SweepError(
            f"--vary {text}: expected KEY=V1,V2,..., such as radio.power=0.1,1,10, or "
            "KEY1,KEY2=V1,V2,... for keys that vary together"
        )
    return together(keys, [[value] * len(keys) for value in values])


@dataclass(frozen=True, slots=True)
class Grid:
    """Product of axes over a scenario.

    Attributes
    ----------
    source, overrides
        As for `load_scenario`, at every point.
    axes
        Axes of the grid.
    trace
        Path of a trace that gives the objects' motion at every point; none by default.
    """

    source: Source
    overrides: tuple[str, ...]
    axes: tuple[Varied, ...]
    trace: str | None = None

    @property
    def size(self) -> int:
        """Number of points."""
        return math.prod(len(axis.values) for axis in self.axes)

    @property
    def keys(self) -> list[str]:
        """Keys that vary."""
        return [key for axis in self.axes for key in axis.keys]

    def points(
        self, schemes: tuple[str, ...], trials: int | None, keep: tuple[str, ...]
    ) -> list[Point]:
        """Return the grid's points, the last axis fastest.

        Raises
        ------
        SweepError, ScenarioError
            If a key or a value is given twice, another option overrides it, there are too many
            points, or a point is not a valid scenario.
        """
        self._check_keys(schemes, trials)
        if self.size > MOST_POINTS:
            raise SweepError(f"{self.size} points are too many; accepted are {MOST_POINTS}")
        points = []
        for place in itertools.product(*(range(len(axis.values)) for axis in self.axes)):
            chosen = zip(self.axes, place, strict=True)
            settings = [f"{k}={v}" for axis, index in chosen for k, v in axis.settings(index)]
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

    def _check_keys(self, schemes: tuple[str, ...], trials: int | None) -> None:
        """Refuse keys that do not vary, or that another option sets at every point."""
        keys = self.keys
        if not keys:
            raise SweepError("no key varies; give at least one --vary KEY=V1,V2,...")
        if len(set(keys)) < len(keys):
            raise SweepError("a key is varied twice; give each key once")
        moved = next((key for key in keys if key.split(".")[0] == "objects"), None)
        if self.trace is not None and moved is not None:
            raise SweepError(
                f"--vary {moved}: not possible with --trace, which gives the objects' motion"
            )
        settings = [text.partition("=")[0].strip() for text in self.overrides]
        given = {
            "trials": ["--trials"] * (trials is not None),
            "schemes": ["--scheme"] * bool(schemes),
            "trace.file": ["--trace"] * (self.trace is not None),
        }
        for key in keys:
            for option in given.get(key, []) + [f"--set {key}"] * (key in settings):
                raise SweepError(f"--vary {key}: not together with {option}; give one of the two")

    def along(self, points: Sequence[Point], index: int) -> list[Scenario]:
        """Return a scenario for each value of an axis, the other axes at their first values."""
        stride = math.prod(len(axis.values) for axis in self.axes[index + 1 :])
        count = len(self.axes[index].values)
        return [points[i * stride].scenario for i in range(count)]

    def _check_values(self, points: Sequence[Point]) -> None:
        """Refuse two values that the scenario reads as the same, such as 80 m and 8000 cm."""
        for index, axis in enumerate(self.axes):
            repeated = first_repeated(self.along(points, index), axis.keys)
            if repeated is not None:
                one, two = map(axis.text, repeated)
                raise SweepError(
                    f"--vary {axis.name}: a value is given twice, as {one} and as {two}; "
                    "give each value once"
                )


def grid_dataset(grid: Grid, study: Study) -> xr.Dataset:
    """Return the quantities of a finished study over the grid, one labelled dimension per axis.

    A dimension has the name and the values of its axis's key; keys that vary with it are further
    coordinates on it.
    A per-slot variable is NaN beyond the last slot of a point.
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
    unlabelled = any(p.scenario.unlabelled for p in study.points)
    errors = errors_of(*(point.scenario for point in study.points))
    of_run = scalars(unlabelled=unlabelled, errors=errors)
    of_slots = per_slot(unlabelled=unlabelled, errors=errors)
    for name, (units, words) in (of_run | of_slots).items():
        has_slots = name in of_slots
        values = np.array(
            [
                [_padded(point[scheme], name, n_slots if has_slots else 0) for scheme in names]
                for point in figures
            ]
        )
        data[name] = (
            (*dims, "scheme", *(("slot",) if has_slots else ())),
            values.reshape(*shape, *values.shape[1:]),
            {"units": units, "long_name": words},
        )
    unknown = (np.nan, np.nan)
    for name, (units, _) in of_run.items():
        intervals = np.array(
            [[point[scheme].intervals.get(name, unknown) for scheme in names] for point in figures]
        )
        data[interval_name(name)] = (
            (*dims, "scheme", "end"),
            intervals.reshape(*shape, len(names), 2),
            {"units": units, "long_name": f"95 % interval of {name}"},
        )
    coords: dict[str, object] = {
        key: (axis.key, *coordinate(grid.along(study.points, index), key, values))
        for index, axis in enumerate(grid.axes)
        for key, values in axis.columns
    }
    coords |= {"scheme": names, "slot": np.arange(1, n_slots + 1), "end": ["low", "high"]}
    trials = [point.trials for point in study.points]
    attrs: dict[str, object] = dict(attributes(study.points[0].scenario, study.seed, ()))
    attrs["trials"] = (
        trials[0] if len(set(trials)) == 1 else trials
    )  # the number of trials may vary, too
    return xr.Dataset(data, coords, attrs)


def tidy_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write a table with a row per point and scheme; some per-slot quantities as means.

    The first columns are the varied keys and the scheme.
    """
    rates = dataset["frame_rate_interval"]
    errors = errors_in(dataset)
    of_run = [name for name in scalars(unlabelled=True, errors=errors) if name in dataset]
    means = slot_means(errors)
    flat = dataset[of_run].assign({name: dataset[name].mean("slot") for name in means})
    flat = flat.assign(
        frame_rate_low=rates.sel(end="low", drop=True),
        frame_rate_high=rates.sel(end="high", drop=True),
    )
    frame = flat.to_dataframe().reset_index().drop(columns=["slot", "end"], errors="ignore")
    first = [*(str(key) for key in flat.coords if key in frame and key != "scheme"), "scheme"]
    frame[first + [name for name in frame if name not in first]].to_csv(path, index=False)


def scheme_names(study: Study) -> list[str]:
    """Return the schemes' names, which are the same at every point of a grid."""
    from echobeam.schemes.configure import configure_all

    asked = {point.schemes for point in study.points}
    if len(asked) > 1:
        raise SweepError("the schemes vary over the grid; give them with --scheme")
    first = study.points[0]
    return [scheme.name for scheme in configure_all(first.scenario, first.schemes)]


def _padded(figure: SchemeSummary, name: str, n_slots: int) -> object:
    value = np.asarray(getattr(figure, name), dtype=float)  # None, of labelled runs, is NaN
    if n_slots == 0:
        return value
    padded = np.full(n_slots, np.nan)
    padded[: value.size] = value
    return padded
