"""Quantities of a sweep over one of its keys, a line per scheme and value of the other keys."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from echobeam.plots.looks import MOST_LINES, Look, parameter_look, scheme_looks
from echobeam.plots.record import Axis, FigureData, Panel, Series, grid
from echobeam.plots.source import Choice, PlotError
from echobeam.simulation.quantities import interval_name

if TYPE_CHECKING:
    import xarray as xr

QUANTITY = "frame_rate_mean"
_LABELS = {
    "rate_mean": "Mean sum rate",
    "rate_q05": "5 % quantile of the sum rate",
    "rate_over_genie": "Sum rate / genie's",
    "angle_rmse": "Angle RMSE",
    "distance_rmse": "Distance RMSE",
    "position_rmse": "Position RMSE",
    "velocity_rmse": "Velocity RMSE",
    "angle_over_bound": "Angle RMSE / bound",
    "distance_over_bound": "Distance RMSE / bound",
    "position_over_bound": "Position RMSE / bound",
    "velocity_over_bound": "Velocity RMSE / bound",
    "nees": "NEES",
    "nis": "NIS per component",
    "coverage": "Share of angles inside the cover",
    "outage": "Share of objects below the floor",
    "lost": "Share of objects without a track",
    "fallbacks": "Trial-slots with fallback beams",
    "gospa": "GOSPA",
    "ospa": "OSPA",
    "gospa_localisation": "Localisation part of GOSPA²",
    "gospa_missed": "Missed part of GOSPA²",
    "gospa_false": "False part of GOSPA²",
    "detection_delay": "Slots until an object is tracked",
    "false_tracks": "False tracks per 100 slots",
    "identity_switches": "Identity switches per trial",
    "reacquisition": "Slots until a lost object is tracked again",
    "tracked": "Share of object-slots with a track",
    "shared": "Share of object-slots with a shared beam",
    "rate_lost_to_delay": "Rate lost to delay",
    "rate_lost_to_gaps": "Rate lost to gaps",
    "rate_lost_to_false": "Rate lost to beams for nobody",
}
_SHOWN_IN = {"rad": ("deg", 180.0 / np.pi), "m^2": ("m²", 1.0)}


def sweep(dataset: xr.Dataset, choice: Choice) -> FigureData:
    """Return a quantity over a swept key, with its 95 % interval if known.

    Raises
    ------
    PlotError
        If the sweep has no such key, quantity or scheme.
    """
    keys = list(json.loads(dataset.attrs["vary"]))
    key = choice.x or keys[0]
    if key not in keys:
        raise PlotError(f"the sweep does not vary {key!r}; it varies {', '.join(keys)}")
    name = choice.quantity or QUANTITY
    there = [str(one) for one, values in dataset.items() if "scheme" in values.dims]
    there = [one for one in there if not one.endswith("_interval")]
    if name not in there:
        raise PlotError(f"the sweep holds no quantity {name!r}; it holds {', '.join(there)}")
    held = [str(one) for one in dataset["scheme"].values]
    for scheme in choice.schemes:
        if scheme not in held:
            raise PlotError(f"the sweep holds no scheme {scheme!r}; it holds {', '.join(held)}")
    dimension = str(dataset[key].dims[0])
    part = _at_slot(dataset, name, choice)
    schemes = list(choice.schemes) or held
    unit, _ = _unit(str(dataset[name].attrs.get("units", "")))
    groups = _series(dataset, part, dimension, key, schemes)
    if all(one.empty for _, group in groups for one in group):
        need = "; it needs --scheme genie in the sweep" if "genie" in name else ""
        raise PlotError(f"the sweep holds no number of {name!r} for these schemes{need}")
    words = str(dataset[name].attrs.get("long_name", name))
    label = _LABELS.get(name.removeprefix("frame_"), words[:1].upper() + words[1:])
    if "slot" in dataset[name].dims:
        label += f", slot {choice.slots[0]}" if choice.slots else ", mean over slots"
    x = _key_axis(dataset, key)
    panels = tuple(
        Panel(x, _value_axis(label, unit, group), tuple(group), title) for title, group in groups
    )
    trials = np.unique(dataset.attrs.get("trials", 0))
    counts = " to ".join(str(one) for one in np.unique(trials[[0, -1]]))
    layout = grid(len(panels), min(len(panels), 3))
    size = (3.5, 2.75) if len(panels) == 1 else (7.16, 0.7 + 1.9 * len(layout))
    return FigureData(
        "sweep", choice.title or _scenario_name(dataset), panels, f"{counts} trials per point",
        layout=layout, size=size, share="x" if len(panels) > 1 else "", band="95 % interval",
    )  # fmt: skip


def _value_axis(label: str, unit: str, group: list[Series]) -> Axis:
    """Return the axis of a panel's values, from zero unless they span more than 30 to 1."""
    values = [one.y for one in group if not one.empty]
    low = min((float(np.nanmin(one)) for one in values), default=0.0)
    log = low > 0 and max(float(np.nanmax(one)) for one in values) > 30 * low
    ends = [one.y if one.band is None else np.append(one.y, one.band) for one in group]
    high = max((float(np.nanmax(one)) for one in ends if np.isfinite(one).any()), default=0.0)
    limits = (None, None) if log or low < 0 else (0.0, 1.06 * high or None)
    return Axis(label, unit, log=log, limits=limits)


def _key_axis(dataset: xr.Dataset, key: str) -> Axis:
    """Return the axis of a key, with a tick at each of its values."""
    values = np.asarray(dataset[key].values)
    numeric = bool(np.issubdtype(values.dtype, np.number))
    unit, _ = _unit(str(dataset[key].attrs.get("units", "")))
    wide = numeric and values.min() > 0 and values.max() > 8 * values.min()
    names = () if numeric else tuple(str(one) for one in values)
    places = tuple(float(one) for one in _places(dataset, key))
    return Axis(key, unit, log=bool(wide), ticks=places, names=names)


def _at_slot(dataset: xr.Dataset, name: str, choice: Choice) -> xr.DataArray:
    """Return the quantity at the chosen slot, by default its mean over the slots."""
    values = dataset[name]
    if "slot" not in values.dims:
        return values
    return values.sel(slot=choice.slots[0]) if choice.slots else values.mean("slot")


def _series(
    dataset: xr.Dataset, part: xr.DataArray, dimension: str, key: str, schemes: list[str]
) -> list[tuple[str, list[Series]]]:
    """Return the panels' titles and lines.

    With several schemes, each combination of the other keys' values has a panel with a line per
    scheme; with one scheme, all are lines of one panel.
    """
    others = [str(one) for one in part.dims if one not in (dimension, "scheme")]
    _, factor = _unit(str(dataset[part.name].attrs.get("units", "")))
    interval, places = dataset.get(interval_name(str(part.name))), _places(dataset, key)
    looks = scheme_looks(schemes)

    numeric = np.issubdtype(dataset[key].dtype, np.number)
    kind: Literal["curve", "points"] = "curve" if numeric else "points"

    def line(scheme: str, where: dict[str, int], name: str, look: Look) -> Series:
        values = factor * part.sel(scheme=scheme).isel(where).values
        shown = look if numeric else replace(look, line="")
        if interval is None:
            return Series(name, places, values, look=shown, kind=kind)
        ends = interval.sel(scheme=scheme).isel(where).transpose(dimension, "end").values
        return Series(name, places, values, factor * ends, shown, kind)

    combinations = [
        dict(zip(others, indices, strict=True))
        for indices in itertools.product(*(range(part.sizes[one]) for one in others))
    ]
    said = [
        ", ".join(f"{one} = {_value(dataset[one], i)}" for one, i in where.items())
        for where in combinations
    ]
    if len(schemes) == 1 and others:
        if len(said) > MOST_LINES:
            raise PlotError(
                f"{len(said)} lines, of which {MOST_LINES} could be told apart; take the key with "
                f"the most values for x, or fewer values: sweep.isel({{{others[0]!r}: [0, 1]}})"
            )
        lines = [
            line(schemes[0], where, words, parameter_look(number))
            for number, (where, words) in enumerate(zip(combinations, said, strict=True))
        ]
        return [(schemes[0], lines)]
    return [
        (words, [line(scheme, where, scheme, looks[scheme]) for scheme in schemes])
        for where, words in zip(combinations, said, strict=True)
    ]


def _places(dataset: xr.Dataset, key: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return the positions of the key's values on the axis: strings are numbered."""
    values = np.asarray(dataset[key].values)
    if not np.issubdtype(values.dtype, np.number):
        return np.arange(values.size, dtype=float)
    _, factor = _unit(str(dataset[key].attrs.get("units", "")))
    return factor * values.astype(float)


def _unit(units: str) -> tuple[str, float]:
    """Return the unit for display, and the factor to it."""
    return _SHOWN_IN.get(units, ("" if units == "1" else units, 1.0))


def _value(values: xr.DataArray, index: int) -> str:
    """Return one of a key's values with its unit."""
    value, (unit, factor) = values.values[index], _unit(str(values.attrs.get("units", "")))
    if not isinstance(value, float | np.floating):
        return str(value)
    return f"{factor * value:g} {unit}".rstrip()


def _scenario_name(dataset: xr.Dataset) -> str:
    import tomllib

    try:
        return str(tomllib.loads(str(dataset.attrs["scenario"])).get("name", ""))
    except (KeyError, tomllib.TOMLDecodeError):
        return ""
