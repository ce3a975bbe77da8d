"""The result as a labelled dataset: names, dimensions, units and meanings in one place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from os import environ
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from echobeam.scenario.dump import dump_scenario
from echobeam.scenario.model import Scenario
from echobeam.simulation.blocks import SHARED, Block
from echobeam.values import MEASUREMENT, STATE
from echobeam.version import __version__

if TYPE_CHECKING:
    import xarray as xr

AnyArray = npt.NDArray[np.generic]

_PER_OBJECT = ("scheme", "trial", "slot", "object")


@dataclass(frozen=True, slots=True)
class Variable:
    """How one variable of a result is laid out and what it means."""

    dims: tuple[str, ...]
    units: str
    long_name: str


VARIABLES: dict[str, Variable] = {
    "truth": Variable(
        ("trial", "slot", "object", "state"), "rad, m, m/s", "true angle, distance and velocity"
    ),
    "present": Variable(("trial", "slot", "object"), "1", "whether the object is in the scene"),
    "predicted": Variable(
        (*_PER_OBJECT, "state"), "rad, m, m/s", "prior mean of the slot given the slot before"
    ),
    "predicted_cov": Variable(
        (*_PER_OBJECT, "state", "state_b"), "products of rad, m, m/s", "prior covariance"
    ),
    "estimated": Variable((*_PER_OBJECT, "state"), "rad, m, m/s", "posterior mean"),
    "estimated_cov": Variable(
        (*_PER_OBJECT, "state", "state_b"), "products of rad, m, m/s", "posterior covariance"
    ),
    "measured": Variable(
        (*_PER_OBJECT, "measurement"), "rad, s, Hz", "measured angle, delay and Doppler"
    ),
    "measured_var": Variable(
        (*_PER_OBJECT, "measurement"),
        "rad^2, s^2, Hz^2",
        "variance of the measurement; infinite where nothing was measured",
    ),
    "beam": Variable((*_PER_OBJECT, "antenna", "part"), "sqrt(power)", "beam sent for the object"),
    "sinr": Variable(_PER_OBJECT, "1", "SINR at the true channel"),
    "rate": Variable(_PER_OBJECT, "bit/s/Hz", "achievable rate at the true channel"),
    "radar_snr": Variable(_PER_OBJECT, "1", "SNR of the echo at the true state"),
    "fallback": Variable(
        ("scheme", "trial", "slot"), "1", "whether the beams are a fallback of the design"
    ),
}


def coordinates(
    scenario: Scenario, names: Sequence[str], phase: AnyArray
) -> dict[str, tuple[tuple[str, ...], AnyArray, dict[str, str]]]:
    """Return the coordinates of a result: name to dimensions, values and attributes."""
    slots = np.arange(scenario.n_slots)
    return {
        "scheme": (("scheme",), np.array(names, dtype=str), {"units": "1", "long_name": "scheme"}),
        "slot": (("slot",), slots + 1, {"units": "1", "long_name": "slot, counted from 1"}),
        "time": (
            ("slot",),
            slots * scenario.frame.slot,
            {"units": "s", "long_name": "time at the slot's beginning"},
        ),
        "state": (
            ("state",),
            np.array(STATE),
            {"units": "1", "long_name": "component of the state"},
        ),
        "state_b": (
            ("state_b",),
            np.array(STATE),
            {"units": "1", "long_name": "component of the state"},
        ),
        "measurement": (
            ("measurement",),
            np.array(MEASUREMENT),
            {"units": "1", "long_name": "component of the measurement"},
        ),
        "part": (
            ("part",),
            np.array(["re", "im"]),
            {"units": "1", "long_name": "real or imaginary part"},
        ),
        "phase": (("scheme", "slot"), phase, {"units": "1", "long_name": "what the slot is for"}),
    }


def attributes(scenario: Scenario, seed: int) -> dict[str, str | int]:
    """Return a result's attributes: all that is needed to make it again."""
    return {
        "scenario": dump_scenario(scenario),
        "seed": seed,
        "echobeam_version": __version__,
        "created": _now(),
    }


def _now() -> str:
    """Return the time in UTC; SOURCE_DATE_EPOCH stands in for it where bytes must not change."""
    epoch = environ.get("SOURCE_DATE_EPOCH", "")
    moment = datetime.fromtimestamp(int(epoch), UTC) if epoch.isdigit() else datetime.now(UTC)
    return moment.isoformat(timespec="seconds")


def as_dataset(
    scenario: Scenario, names: Sequence[str], seed: int, blocks: Sequence[Block]
) -> xr.Dataset:
    """Join blocks, in order, to one labelled dataset in memory."""
    import xarray as xr

    phase = blocks[0].arrays["phase"]
    data = {}
    for name, variable in VARIABLES.items():
        axis = 0 if name in SHARED else 1
        values = np.concatenate([block.arrays[name] for block in blocks], axis=axis)
        data[name] = xr.Variable(
            variable.dims, values, {"units": variable.units, "long_name": variable.long_name}
        )
    coords = {
        name: xr.Variable(*parts) for name, parts in coordinates(scenario, names, phase).items()
    }
    return xr.Dataset(data, coords, attributes(scenario, seed))
