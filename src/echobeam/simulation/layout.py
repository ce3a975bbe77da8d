"""Layout of results that users have cut, joined or relabelled: what of it still has a meaning."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np

from echobeam.physics.coordinates import Geometry
from echobeam.physics.plane import GROUND_GEOMETRY
from echobeam.physics.road import ROAD_GEOMETRY
from echobeam.simulation.dataset import AXIS_NAMES, PART_NAMES

if TYPE_CHECKING:
    import xarray as xr


def labels_in(result: xr.Dataset) -> dict[str, tuple[str, ...]]:
    """Return the labels along the dimensions of a result whose components are read by place."""
    geometry: Geometry = GROUND_GEOMETRY if "cover" in result else ROAD_GEOMETRY
    labels = {
        "state": geometry.space.names,
        "state_b": geometry.space.names,
        "measurement": geometry.measurement,
        "axis": AXIS_NAMES,
        "part": PART_NAMES,
    }
    cosines = geometry.measurement[: geometry.axes]
    return labels | {"cosine": cosines, "cosine_b": cosines} if geometry.axes > 1 else labels


def sizes_in(result: xr.Dataset) -> dict[str, int]:
    """Return the sizes of these dimensions."""
    return {dim: len(labels) for dim, labels in labels_in(result).items()}


def disorder(result: xr.Dataset) -> str:
    """Return how a result's labels contradict what its numbers are read as; empty if in no way.

    Statistics and pictures read components by place, slots as successive and schemes by name. A
    dimension without labels is taken to be as it was.
    """
    for dim in ("scheme", "trial", "slot"):
        if result.sizes.get(dim) == 0:
            return f"nothing along the dimension {dim}"
    return (
        _disorder_of_schemes(result)
        or _disorder_of_trials(result)
        or _disorder_of_slots(result)
        or _disorder_of_parts(result)
        or _disorder_of_antennas(result)
    )


def from_the_beginning(result: xr.Dataset) -> bool:
    """Whether a result has the slots of a run from the first one on.

    Only then is the bound, which is made slot by slot, that of the run, and a place along the
    dimension a slot's number.
    """
    if "slot" not in result.coords:
        return True
    slots = np.asarray(result["slot"].values)
    return np.array_equal(slots, np.arange(1, slots.size + 1))


def _disorder_of_schemes(result: xr.Dataset) -> str:
    if "scheme" not in result.coords:
        return ""
    names = result["scheme"].values.ravel().tolist()
    other = next((name for name in names if not isinstance(name, str)), None)
    if other is not None:
        return f"a scheme is named {other!r}; expected texts"
    twice = next((name for name in names if names.count(name) > 1), None)
    return "" if twice is None else f"scheme {twice!r} is there twice"


def _disorder_of_trials(result: xr.Dataset) -> str:
    trials = np.asarray(result["trial"].values)
    if np.issubdtype(trials.dtype, np.integer):
        return ""
    return f"its trials are {', '.join(map(str, trials[:4].tolist()))}; expected whole numbers"


def _disorder_of_slots(result: xr.Dataset) -> str:
    if "slot" not in result.coords:
        return ""
    slots = np.asarray(result["slot"].values).ravel()
    if np.issubdtype(slots.dtype, np.number) and (np.diff(slots) == 1).all():
        return ""
    shown = ", ".join(map(str, slots[:4].tolist())) + ", ..." * (slots.size > 4)
    return f"its slots are {shown}; expected slots that follow each other"


def _disorder_of_parts(result: xr.Dataset) -> str:
    for dim, expected in labels_in(result).items():
        if dim not in result.dims or dim not in result.coords:
            continue
        found = [str(label) for label in result[dim].values]
        if found != list(expected):
            return f"{dim} is {', '.join(found)}; expected {', '.join(expected)}"
    return ""


def _disorder_of_antennas(result: xr.Dataset) -> str:
    """Say that the beams are not those of the scenario's array."""
    try:
        array = tomllib.loads(str(result.attrs.get("scenario")))["array"]
        if array.get("kind", "linear") == "planar":
            expected = array["rows"] * array["columns"] * array.get("polarisations", 1)
        else:
            expected = array["n_tx"]
    except (AttributeError, KeyError, TypeError, tomllib.TOMLDecodeError):
        return ""
    found = result.sizes.get("antenna", expected)
    return "" if found == expected else f"{found} along the dimension antenna; expected {expected}"
