"""The result as a labelled dataset: names, dimensions, units and meanings in one place."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from os import environ
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from echobeam.physics.polar import POLAR, POLAR_MEASUREMENT
from echobeam.scenario.model import Scenario
from echobeam.simulation.blocks import Block, trial_axis
from echobeam.simulation.environment import environment
from echobeam.simulation.scene import Scene
from echobeam.values import Mode, Status
from echobeam.version import __version__

if TYPE_CHECKING:
    import xarray as xr

AnyArray = npt.NDArray[np.generic]

AXIS_NAMES = ("x", "y", "z")
PART_NAMES = ("re", "im")

_PER_OBJECT = ("scheme", "trial", "slot", "object")


@dataclass(frozen=True, slots=True)
class Variable:
    """Layout and meaning of one variable of a result."""

    dims: tuple[str, ...]
    units: str
    long_name: str
    flags: Mapping[str, object] = field(default_factory=dict)

    @property
    def attributes(self) -> dict[str, object]:
        """Attributes of the variable in the file."""
        return {"units": self.units, "long_name": self.long_name, **self.flags}


VARIABLES: dict[str, Variable] = {
    "truth": Variable(
        ("trial", "slot", "object", "state"), "rad, m, m/s", "true angle, distance and velocity"
    ),
    "present": Variable(("trial", "slot", "object"), "1", "whether the object is in the scene"),
    "identity": Variable(
        ("trial", "slot", "object"),
        "1",
        "who is in the column: index into the attribute names; -1 nobody",
    ),
    "position": Variable(
        ("trial", "slot", "object", "axis"), "m", "true position in ground coordinates"
    ),
    "uav_position": Variable(("slot", "axis"), "m", "position of the UAV in ground coordinates"),
    "uav_velocity": Variable(("slot", "axis"), "m/s", "velocity of the UAV"),
    "mode": Variable(
        ("scheme", "trial", "slot"),
        "1",
        "mode of the transmission",
        {
            "flag_values": np.array(list(Mode), dtype=np.int8),
            "flag_meanings": " ".join(mode.name.lower() for mode in Mode),
        },
    ),
    "covered": Variable(
        _PER_OBJECT, "rad", "half-width that the beam was designed to cover; NaN without a design"
    ),
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
        "variance that the scheme was given; infinite where nothing was measured",
    ),
    "true_var": Variable(
        (*_PER_OBJECT, "measurement"),
        "rad^2, s^2, Hz^2",
        "variance with which nature drew the measurement; infinite where nothing was measured",
    ),
    "beam": Variable((*_PER_OBJECT, "antenna", "part"), "sqrt(power)", "beam sent for the object"),
    "sinr": Variable(_PER_OBJECT, "1", "SINR at the true channel"),
    "rate": Variable(_PER_OBJECT, "bit/s/Hz", "achievable rate at the true channel"),
    "radar_snr": Variable(_PER_OBJECT, "1", "SNR of the echo at the true state"),
    "fallback": Variable(
        ("scheme", "trial", "slot"), "1", "whether the beams are a fallback of the design"
    ),
}

_PER_TRACK = ("scheme", "trial", "slot", "track")

TRACK_VARIABLES: dict[str, Variable] = {
    "shared": Variable(_PER_OBJECT, "1", "whether one beam serves the object and others in turns"),
    "track_id": Variable(_PER_TRACK, "1", "identity of the track in the column; -1 none"),
    "track_status": Variable(
        _PER_TRACK,
        "1",
        "stage in the life of the track",
        {
            "flag_values": np.array(list(Status), dtype=np.int8),
            "flag_meanings": " ".join(status.name.lower() for status in Status),
        },
    ),
    "track_object": Variable(
        _PER_TRACK,
        "1",
        "object that the track was scored against: index into the attribute names; -1 none",
    ),
    "track_state": Variable(
        (*_PER_TRACK, "state"), "rad, m, m/s", "posterior mean of the track; NaN without one"
    ),
}
"""Variables that only the results of unlabelled runs have."""


def variables_of(names: Container[object]) -> dict[str, Variable]:
    """Return the variables of a result, or of a block, that has arrays of these names."""
    return VARIABLES | {key: one for key, one in TRACK_VARIABLES.items() if key in names}


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
            np.array(POLAR.names),
            {"units": "1", "long_name": "component of the state"},
        ),
        "state_b": (
            ("state_b",),
            np.array(POLAR.names),
            {"units": "1", "long_name": "component of the state"},
        ),
        "measurement": (
            ("measurement",),
            np.array(POLAR_MEASUREMENT),
            {"units": "1", "long_name": "component of the measurement"},
        ),
        "axis": (
            ("axis",),
            np.array(AXIS_NAMES),
            {"units": "1", "long_name": "along the road, across it, up"},
        ),
        "part": (
            ("part",),
            np.array(PART_NAMES),
            {"units": "1", "long_name": "real or imaginary part"},
        ),
        "phase": (("scheme", "slot"), phase, {"units": "1", "long_name": "what the slot is for"}),
    }


def phases(lowest: AnyArray, highest: AnyArray) -> AnyArray:
    """Return the coordinate phase ``(scheme, slot)`` from the modes' extremes over the trials."""
    names = np.array([mode.name.lower() for mode in Mode])
    return np.asarray(np.where(lowest == highest, names[lowest], names[Mode.MIXED]))


def attributes(
    scenario: Scenario, seed: int, names: Sequence[str]
) -> dict[str, str | int | list[str]]:
    """Return a result's attributes: all that is needed to make it again.

    Parameters
    ----------
    scenario, seed
        What was run.
    names
        Names of the objects, by identity.
    """
    return {
        "scenario": scenario.to_toml(),
        "seed": seed,
        "names": list(names),
        "echobeam_version": __version__,
        "environment": environment(),
        "created": _now(),
    }


def _now() -> str:
    """Return the time in UTC; SOURCE_DATE_EPOCH stands in for it where bytes must not change."""
    epoch = environ.get("SOURCE_DATE_EPOCH", "")
    moment = datetime.fromtimestamp(int(epoch), UTC) if epoch.isdigit() else datetime.now(UTC)
    return moment.isoformat(timespec="seconds")


def as_dataset(
    scene: Scene, names: Sequence[str], seed: int, blocks: Sequence[Block]
) -> xr.Dataset:
    """Join blocks, in order, to one labelled dataset in memory."""
    import xarray as xr

    data = {}
    for name, variable in variables_of(blocks[0].arrays).items():
        axis = trial_axis(name)
        parts = [block.arrays[name] for block in blocks]
        values = parts[0] if axis is None else np.concatenate(parts, axis=axis)
        data[name] = xr.Variable(variable.dims, values, variable.attributes)
    mode = data["mode"].values
    phase = phases(mode.min(axis=1), mode.max(axis=1))
    coords = {
        name: xr.Variable(*parts)
        for name, parts in coordinates(scene.scenario, names, phase).items()
    }
    return xr.Dataset(data, coords, attributes(scene.scenario, seed, scene.mover.names))
