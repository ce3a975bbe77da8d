"""Layout of results that users have cut, joined or relabelled: what of it still has a meaning."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np

from echobeam.physics.polar import POLAR, POLAR_MEASUREMENT
from echobeam.simulation.dataset import AXIS_NAMES, PART_NAMES

if TYPE_CHECKING:
    import xarray as xr

LABELS: dict[str, tuple[str, ...]] = {
    "state": POLAR.names,
    "state_b": POLAR.names,
    "measurement": POLAR_MEASUREMENT,
    "axis": AXIS_NAMES,
    "part": PART_NAMES,
}
"""Labels along the dimensions whose components are read by place."""


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


def _disorder_of_slots(result: xr.Dataset) -> str:
    if "slot" not in result.coords:
        return ""
    slots = np.asarray(result["slot"].values).ravel()
    if np.issubdtype(slots.dtype, np.number) and (np.diff(slots) == 1).all():
        return ""
    shown = ", ".join(map(str, slots[:4].tolist())) + ", ..." * (slots.size > 4)
    return f"its slots are {shown}; expected slots that follow each other"


def _disorder_of_parts(result: xr.Dataset) -> str:
    for dim, expected in LABELS.items():
        if dim not in result.dims or dim not in result.coords:
            continue
        found = [str(label) for label in result[dim].values]
        if found != list(expected):
            return f"{dim} is {', '.join(found)}; expected {', '.join(expected)}"
    return ""


def _disorder_of_antennas(result: xr.Dataset) -> str:
    """Say that the beams are not those of the scenario's array."""
    try:
        expected = tomllib.loads(str(result.attrs.get("scenario")))["array"]["n_tx"]
    except (KeyError, TypeError, tomllib.TOMLDecodeError):
        return ""
    found = result.sizes.get("antenna", expected)
    return "" if found == expected else f"{found} along the dimension antenna; expected {expected}"
