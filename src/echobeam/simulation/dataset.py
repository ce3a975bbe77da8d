"""The result as a labelled dataset: names, dimensions, units and meanings in one place."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from os import environ
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import geometry_of
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


STATES = "m, m, m/s, m/s"
"""Units of a state (x, y, v_x, v_y)."""

_ON_GROUND: dict[str, dict[str, Any]] = {
    "truth": {"units": STATES, "long_name": "true position and velocity on the ground"},
    "predicted": {"units": STATES},
    "predicted_cov": {"units": "products of m, m, m/s, m/s"},
    "estimated": {"units": STATES},
    "estimated_cov": {"units": "products of m, m, m/s, m/s"},
    "measured": {
        "units": "1, 1, s, Hz",
        "long_name": "measured direction cosines, delay and Doppler",
    },
    "measured_var": {"units": "1, 1, s^2, Hz^2"},
    "true_var": {"units": "1, 1, s^2, Hz^2"},
    "track_state": {"units": STATES},
}
COVER = Variable(
    (*_PER_OBJECT, "cosine", "cosine_b"),
    "1",
    "matrix C of the ellipse x^T C^-1 x <= 1 of direction cosines that the beam was designed to "
    "cover; NaN without a design",
)
"""Variable that takes the place of ``covered`` in the ground's geometry."""


def variables_of(names: Container[object]) -> dict[str, Variable]:
    """Return the variables of a result, or of a block, that has arrays of these names."""
    variables = VARIABLES | {key: one for key, one in TRACK_VARIABLES.items() if key in names}
    if "cover" not in names:
        return variables
    in_order = {("cover" if key == "covered" else key): one for key, one in variables.items()}
    changed = {
        key: replace(in_order[key], **_ON_GROUND[key]) for key in _ON_GROUND if key in in_order
    }
    return in_order | changed | {"cover": COVER}


def sizes_of(scenario: Scenario) -> dict[str, int]:
    """Return the sizes of the dimensions that a scenario determines."""
    geometry = geometry_of(scenario)
    size, measured = geometry.space.size, len(geometry.measurement)
    sizes = {"state": size, "state_b": size, "measurement": measured, "axis": 3, "part": 2}
    cosines = {"cosine": geometry.axes, "cosine_b": geometry.axes} if geometry.axes > 1 else {}
    return sizes | cosines


def coordinates(
    scenario: Scenario, names: Sequence[str], trials: int, phase: AnyArray
) -> dict[str, tuple[tuple[str, ...], AnyArray, dict[str, str]]]:
    """Return the coordinates of a result: name to dimensions, values and attributes."""
    slots, geometry = np.arange(scenario.n_slots), geometry_of(scenario)
    made = {
        "scheme": (("scheme",), np.array(names, dtype=str), {"units": "1", "long_name": "scheme"}),
        "trial": (
            ("trial",),
            np.arange(trials),
            {"units": "1", "long_name": "trial, counted from 0"},
        ),
        "slot": (("slot",), slots + 1, {"units": "1", "long_name": "slot, counted from 1"}),
        "time": (
            ("slot",),
            slots * scenario.frame.slot,
            {"units": "s", "long_name": "time at the slot's beginning"},
        ),
        "state": (
            ("state",),
            np.array(geometry.space.names),
            {"units": "1", "long_name": "component of the state"},
        ),
        "state_b": (
            ("state_b",),
            np.array(geometry.space.names),
            {"units": "1", "long_name": "component of the state"},
        ),
        "measurement": (
            ("measurement",),
            np.array(geometry.measurement),
            {"units": "1", "long_name": "component of the measurement"},
        ),
        "axis": (
            ("axis",),
            np.array(AXIS_NAMES),
            {"units": "1", "long_name": "x along the road, y across it, z up"},
        ),
        "part": (
            ("part",),
            np.array(PART_NAMES),
            {"units": "1", "long_name": "real or imaginary part"},
        ),
        "phase": (("scheme", "slot"), phase, {"units": "1", "long_name": "what the slot is for"}),
    }
    for name in ("cosine", "cosine_b") if geometry.axes > 1 else ():
        words = {"units": "1", "long_name": "direction cosine"}
        made[name] = ((name,), np.array(geometry.measurement[: geometry.axes]), words)
    return made


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
    trials = mode.shape[1]
    coords = {
        name: xr.Variable(*parts)
        for name, parts in coordinates(scene.scenario, names, trials, phase).items()
    }
    return xr.Dataset(data, coords, attributes(scene.scenario, seed, scene.mover.names))
