"""Tables of a scenario: typed, frozen, validated, with units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from echobeam.numerals import whole
from echobeam.scenario.quantities import (
    Angle,
    AnyAcceleration,
    Complex,
    Facing,
    Frequency,
    HeightStd,
    InSpace,
    Length,
    Number,
    OnPlane,
    Path,
    Place,
    Polarisations,
    PulseLength,
    Rate,
    Ripple,
    RoadAxis,
    Spacing,
    Speed,
    Time,
    Velocity,
    VelocityInSpace,
    Waypoints,
    Whole,
)
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Axis

Count = Annotated[Whole, Field(ge=1, le=1_000_000)]
Antennas = Annotated[Whole, Field(ge=1, le=4096)]

DEFAULT_SCHEMES = ("temporal", "pilot")
"""Schemes that a scenario runs if it names none."""

DIRECTIONAL = ("3gpp-vehicle", "3gpp-large-uav", "3gpp-agv")
"""Targets whose cross-section depends on the aspect, and so on a heading."""

PARAMETERS = "scheme_parameters"
"""Field of a scenario that a file has as ``[schemes.NAME]``."""


ANGLE, LENGTH, SPEED = ({"kind": kind} for kind in ("angle", "length", "speed"))
"""Kinds of the quantities in keys that may be left out."""

PLANAR_KEYS = (
    "rows",
    "columns",
    "receive_rows",
    "receive_columns",
    "facing",
    "polarisations",
    "element",
)
LINEAR_KEYS = ("n_rx", "axis")
"""Keys that only one kind of array has."""


def _refuse(name: str, table: BaseModel, keys: Sequence[str], where: str) -> None:
    """Refuse keys that have no meaning in a table, unless they have their default.

    Raises
    ------
    ValueError
        Names the first of them.
    """
    for key in keys:
        if getattr(table, key) != type(table).model_fields[key].default:
            raise ValueError(f"{name}.{key}: not a key with {where}; leave it out")


class Table(BaseModel):
    """Table of a scenario file: unknown keys are errors, nothing changes once it is read."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy; values that are replaced are validated, unlike pydantic's own.

        Raises
        ------
        pydantic.ValidationError
            If a value is not accepted.
        """
        if not update:
            return super().model_copy(deep=deep)
        return type(self).model_validate(self.model_dump(exclude_unset=True) | dict(update))


class ArrayTable(Table):
    """Transmit and receive arrays of the UAV: linear, Eq. (4), or planar."""

    kind: Literal["linear", "planar"] = "linear"
    """Elements on a line, or in rows and columns; planar arrays need ``geometry = "ground"``."""
    n_tx: Antennas = 30
    """Transmit antennas; of a planar array rows times columns."""
    n_rx: Antennas | None = None
    """As many as n_tx if left out."""
    rows: Antennas | None = None
    columns: Antennas | None = None
    """Elements of a planar array along its two axes."""
    receive_rows: Antennas | None = None
    receive_columns: Antennas | None = None
    """The same of the receive array; those of the transmit array if left out."""
    facing: Facing = "down"
    """Direction that a planar array faces: objects behind it are not seen."""
    polarisations: Polarisations = 1
    """2: every element of a planar array sends and receives in two orthogonal polarisations."""
    element: Literal["isotropic", "3gpp"] = "isotropic"
    """Pattern of the elements of a planar array in front of it: 1, or that of TR 38.901."""
    spacing: Annotated[Spacing, Field(gt=0)] = 0.5
    """Antenna spacing in wavelengths."""
    axis: Axis = "vertical"
    """Axis of a linear array."""

    @model_validator(mode="before")
    @classmethod
    def _count_elements(cls, document: Any) -> Any:
        """Give a planar array its number of antennas, or say that they do not fit."""
        if not isinstance(document, Mapping) or document.get("kind") != "planar":
            return document
        rows, columns = (whole(document.get(name)) for name in ("rows", "columns"))
        if rows is None or columns is None or rows < 1 or columns < 1:
            return document
        stated = document.get("n_tx")
        if stated is not None and whole(stated) != rows * columns:
            raise ValueError(
                f"array.n_tx: {stated!r} is not rows times columns, {rows} x {columns} = "
                f"{rows * columns}; leave it out"
            )
        return {**document, "n_tx": rows * columns}

    @model_validator(mode="after")
    def _check_kind(self) -> Self:
        """Refuse keys of the other kind of array, and a planar array without a size."""
        if self.kind == "linear":
            _refuse("array", self, PLANAR_KEYS, 'array.kind = "linear"')
            return self
        _refuse("array", self, LINEAR_KEYS, 'array.kind = "planar"')
        missing = [name for name in ("rows", "columns") if getattr(self, name) is None]
        if missing:
            raise ValueError(
                f"array.{missing[0]}: missing; a planar array has rows and columns, from 1"
            )
        return self

    @property
    def receivers(self) -> int:
        """N_r."""
        if self.kind == "planar":
            rows, columns = self.receive_shape
            return rows * columns
        return self.n_tx if self.n_rx is None else self.n_rx

    @property
    def receive_shape(self) -> tuple[int, int]:
        """Rows and columns of the receive array."""
        rows = self.rows if self.receive_rows is None else self.receive_rows
        columns = self.columns if self.receive_columns is None else self.receive_columns
        return rows or 1, columns or 1

    @property
    def weights(self) -> int:
        """Number of weights of a beam: antennas times polarisations."""
        return self.n_tx * self.polarisations


class RadioTable(Table):
    """Communication link, Eqs. (3)-(10)."""

    carrier: Annotated[Frequency, Field(gt=0)] = 30e9
    power: Annotated[Number, Field(gt=0)] = 1.0
    """P_T, linear."""
    noise: Annotated[Number, Field(gt=0)] = 1.0
    """sigma_C^2."""
    alpha0: Annotated[Number, Field(gt=0)] = 1.0
    """Channel amplitude at 1 m."""

    @property
    def wavelength(self) -> float:
        """Lambda = c / f_c, m."""
        return SPEED_OF_LIGHT / self.carrier


class RadarTable(Table):
    """Echo and the accuracy of its measurement, Eqs. (11)-(24)."""

    rcs: Complex = (120.0, 120.0)
    """Complex radar cross-section epsilon: real and imaginary part, Eq. (12)."""
    gain: Annotated[Number, Field(gt=0)] = 10.0
    """G_m of the matched filter, Eq. (13)."""
    bandwidth: Annotated[Frequency, Field(gt=0)] = 80e6
    """Kappa, Eq. (20)."""
    pulse_length: Annotated[PulseLength, Field(gt=0)] = 1e-5
    """Iota, Eq. (21)."""
    noise: Annotated[Number, Field(gt=0)] = 1.0
    """sigma^2."""
    crb: Literal["paper", "exact"] = "paper"
    """Measurement variances: Eqs. (20)-(23), or the Fisher information."""
    variance: Literal["predicted", "known"] = "predicted"
    """Variance that a scheme is given: the bound at its own prediction, or at an unlabelled
    detection; or that at the true state."""
    model: Literal["crb", "signal"] = "crb"
    """Measurements are Gaussian with the variance of the bound, Eq. (24), or those of the receiver
    that processes the echo signal of Eq. (11)."""
    target: Literal[
        "constant",
        "swerling1",
        "3gpp-vehicle",
        "3gpp-human",
        "3gpp-small-uav",
        "3gpp-large-uav",
        "3gpp-agv",
    ] = "constant"
    """Kind of the objects: constant cross-section, Swerling I, or a target of TR 38.901, of which
    |epsilon|^2 is the mean."""
    fluctuation: Literal["none", "swerling1"] = "none"
    """Amplitude of an echo: that of the target, or drawn anew in every slot (Swerling I)."""
    subcarriers: Annotated[Count, Field(ge=2, le=4096)] = 200
    """N, of the bandwidth."""
    symbols: Annotated[Count, Field(ge=2, le=4096)] = 4
    """M, OFDM symbols of the pulse length."""
    modulation: Literal["qpsk", "16qam", "gaussian"] = "qpsk"
    """Law of the data symbols; Gaussian ones are the paper's CSCG pulse."""
    integration: Literal["gain", "grid"] = "gain"
    """Gain of coherent integration: G_m, or the N M resource elements."""
    filter: Literal["matched", "reciprocal", "lmmse"] = "matched"
    """Weights of the resource elements in the map over delay and Doppler."""
    cfar: Literal["cell-averaging", "ordered-statistic"] = "cell-averaging"
    """Level of the noise around a cell of the map."""
    false_alarm: Annotated[Number, Field(gt=0, lt=0.1)] = 1e-6
    """Probability that a cell of noise passes for an echo."""
    detections: Literal["labelled", "unlabelled"] = "labelled"
    """Somebody says whose an echo is, as in the paper, or nobody does."""
    clutter: Annotated[Number, Field(ge=0, le=100)] = 0.0
    """Mean number of detections in a slot that are of no object, beyond those of the noise."""
    angle: Literal["glrt", "capon"] = "glrt"
    """Estimator of the angle: the likelihood, or Capon's spectrum of the receive array."""
    self_interference: Annotated[Number, Field(ge=0)] = 0.0
    """Residual of the UAV's own signal in one antenna, over the noise."""
    ground_clutter: Annotated[Number, Field(ge=0)] = 0.0
    """|epsilon|^2 of a metre of road, m^-1."""
    background: Literal["none", "umi-av", "uma-av", "rma-av"] = "none"
    """Background channel of TR 38.901 for a flying monostatic sensor."""

    @field_validator("fluctuation")
    @classmethod
    def _check_fluctuation(cls, fluctuation: str, info: ValidationInfo) -> str:
        target = info.data.get("target", "constant")
        if fluctuation != "none" and target.startswith("3gpp-"):
            raise ValueError(
                f"{fluctuation!r} contradicts radar.target = {target!r}, which fluctuates by a law "
                "of its own; expected 'none', or leave one of the two out"
            )
        return fluctuation

    @property
    def integrated(self) -> float:
        """Gain of coherent integration, as `integration` says."""
        elements = self.subcarriers * self.symbols
        return float(elements) if self.integration == "grid" else self.gain


class UavTable(Table):
    """Flight of the UAV: constant velocity until it levels off at the floor."""

    height: Annotated[Length, Field(gt=0)] = 100.0
    speed: Annotated[Speed, Field(ge=0)] = 0.0
    heading: Annotated[Angle, Field(ge=-math.pi, le=math.pi)] = -math.pi / 2
    """Angle of the velocity above the horizontal; -90 degrees descends."""
    floor: Annotated[Length, Field(gt=0, validate_default=True)] = 1.0
    """Height at which a descending UAV levels off; at most the height that it starts at."""
    position: Annotated[InSpace | None, Field(json_schema_extra=LENGTH)] = None
    """Where it starts over the ground: x, y, z."""
    velocity: Annotated[VelocityInSpace | None, Field(json_schema_extra=SPEED)] = None
    """Constant velocity over the ground; it hovers if left out."""
    waypoints: Waypoints | None = None
    """Points t, x, y, z that it passes instead, straight from one to the next."""
    altimeter_std: Annotated[HeightStd, Field(ge=0)] = 0.5
    """Standard deviation of the UAV's own height, as its trackers take it."""
    terrain_std: Annotated[HeightStd, Field(ge=0)] = 0.5
    """That of the ground's height under an object, as trackers take it."""

    def start(self, geometry: str) -> tuple[float, float, float]:
        """Return where the UAV is at time 0, m."""
        if geometry == "road":
            return 0.0, 0.0, self.height
        if self.position is not None:
            return self.position
        assert self.waypoints is not None
        return self.waypoints[0][1:]

    def lowest(self, duration: float) -> float:
        """Return the least height over the ground in a run of some s, m."""
        if self.waypoints is not None:
            return min(point[3] for point in self.waypoints)
        assert self.position is not None
        climb = 0.0 if self.velocity is None else self.velocity[2]
        return self.position[2] + min(climb * duration, 0.0)

    @property
    def altitude_std(self) -> float:
        """Standard deviation of the height over an object's ground, m: both together."""
        return math.hypot(self.altimeter_std, self.terrain_std)

    @field_validator("floor")
    @classmethod
    def _check_floor(cls, floor: float, info: ValidationInfo) -> float:
        height = info.data.get("height", math.inf)
        if floor > height:
            raise ValueError(
                f"{floor:g} m is above uav.height, {height:g} m; expected at most the height"
            )
        return floor


class ObjectTable(Table):
    """Motion of one object, along the road or on the ground."""

    angle: Annotated[
        Annotated[Angle, Field(gt=0, lt=math.pi)] | None, Field(json_schema_extra=ANGLE)
    ] = None
    """Where it starts on the road, as seen from where the UAV starts."""
    position: Annotated[OnPlane | None, Field(json_schema_extra=LENGTH)] = None
    """Where it starts on the ground: x, y."""
    velocity: Velocity = 0.0
    """Along the road, or a pair along x and y."""
    acceleration: AnyAcceleration = 0.0
    path: Path | None = None
    """Points t, x, y that it passes on the ground, straight from one to the next; it waits at the
    first and stays at the last."""
    appears: Annotated[Time, Field(ge=0)] = 0.0
    """Time at which it is there, where it starts."""
    leaves: Annotated[Time, Field(gt=0)] | None = None
    """Time from which it is gone; never if left out."""

    @property
    def rests(self) -> bool:
        """Whether it does not move at its start, or never on its path."""
        if self.path is not None:
            return len({point[1:] for point in self.path}) == 1
        return self.velocity in (0.0, (0.0, 0.0))

    @property
    def along_road(self) -> tuple[float, float, float]:
        """Angle, velocity and acceleration at the start on a road: rad, m/s, m/s^2."""
        assert self.angle is not None
        assert not isinstance(self.velocity, tuple)
        assert not isinstance(self.acceleration, tuple)
        return self.angle, self.velocity, self.acceleration

    @field_validator("leaves")
    @classmethod
    def _check_leaves(cls, leaves: float | None, info: ValidationInfo) -> float | None:
        appears = info.data.get("appears", 0.0)
        if leaves is not None and leaves <= appears:
            raise ValueError(f"{leaves:g} s is not accepted; expected after appears, {appears:g} s")
        return leaves


class FrameTable(Table):
    """Frame structure: the first slot of every frame is omnidirectional (or the pilot)."""

    slot: Annotated[Time, Field(gt=0)] = 0.01
    slots_per_frame: Count = 10
    frames: Count = 1


NEW_VELOCITY_STD = 30.0
"""Standard deviation of a new object's velocity, m/s, where a tracker needs one and
``filter.velocity_prior`` is 0: of road users."""


class FilterTable(Table):
    """Extended Kalman filter, Eqs. (35), (39)-(49)."""

    angle_std: Annotated[Angle, Field(ge=0)] = math.radians(0.02)
    distance_std: Annotated[Length, Field(ge=0)] = 0.2
    velocity_std: Annotated[Speed, Field(ge=0)] = 0.5
    """Process noise per slot, Eq. (40); on the ground the velocity's along each axis, alone."""
    evolution: Literal["paper", "exact"] = "paper"
    """First order as in the paper (corrected), or closed form."""
    velocity_prior: Annotated[Speed, Field(ge=0)] = 0.0
    """Standard deviation of a zero-mean prior on a new object's velocity; 0 means none."""

    @property
    def new_velocity_std(self) -> float:
        """Standard deviation of a new object's velocity, m/s, of trackers that cannot do without.

        On a plane one Doppler does not tell two velocities.
        """
        return self.velocity_prior or NEW_VELOCITY_STD


class CoverageTable(Table):
    """Requirements of the beam designs, Eqs. (38e), (38f)."""

    width: Annotated[Number, Field(ge=0)] = 3.0
    """Half-width l of the covered interval in standard deviations."""
    ripple: Ripple = "0.1 N_t"
    """B_k: a number, or a multiple of the array's size such as "0.1 N_t"."""
    resolution: Annotated[Angle, Field(gt=0)] = math.radians(0.1)
    """Step of the covered grid of angles."""
    min_rate: Annotated[Rate, Field(ge=0)] = 0.0
    """Gamma_k, bit/s/Hz."""
    spread: Literal["measurement", "posterior"] = "measurement"
    """sigma_theta of (38f): bound of the last directional measurement, or the prior's own."""
    centre: Literal["predicted", "previous"] = "predicted"
    """Angle of (38f): the prediction, or the estimate of the slot before, as printed."""
    max_halfwidth: Annotated[Angle, Field(gt=0, le=math.pi / 2)] = math.pi / 4
    """Widest coverage that is asked for when the angle is hardly known."""


class TracksTable(Table):
    """Association of unlabelled detections, and the life of a track."""

    association: Literal["nearest", "jpda", "mht"] = "jpda"
    """Global nearest neighbour, joint probabilistic data association, or multiple hypotheses."""
    gate: Annotated[Number, Field(gt=0, lt=1)] = 0.9999
    """Probability with which a track's own detection is inside its gate."""
    confirm: Annotated[Count, Field(le=100)] = 2
    """Detections that confirm a track, of the last `window` slots in which it was lit."""
    window: Annotated[Count, Field(le=100, validate_default=True)] = 3
    """Slots of that window."""
    coast: Annotated[Count, Field(le=1000)] = 5
    """Slots in a row without a detection, though lit, after which a track is deleted."""
    capacity: Annotated[Count, Field(le=200)] = 16
    """Tracks that are held at most."""
    hypotheses: Annotated[Count, Field(le=100)] = 8
    """Hypotheses that are held at most ("mht")."""
    scans: Annotated[Count, Field(le=20)] = 3
    """Slots after which hypotheses are decided ("mht")."""

    @field_validator("window")
    @classmethod
    def _check_window(cls, window: int, info: ValidationInfo) -> int:
        confirm = info.data.get("confirm", 1)
        if window < confirm:
            raise ValueError(f"{window} is not accepted; expected at least confirm, {confirm}")
        return window


class TruthTable(Table):
    """Process noise of nature, on top of the kinematic motion, and the height of its ground."""

    process_noise: bool = False
    """Noise on each object's position along the road and on its velocity.

    Of the angle and distance noise the part along the road acts: the UAV's height does not wander.
    """
    angle_std: Annotated[Angle, Field(ge=0)] | None = None
    distance_std: Annotated[Length, Field(ge=0)] | None = None
    velocity_std: Annotated[Speed, Field(ge=0)] | None = None
    """Standard deviations for each slot; the filter's if left out."""
    altitude_errors: bool = False
    """Errors of the altimeter and of the terrain under each object, drawn for every trial from
    ``uav.altimeter_std`` and ``uav.terrain_std``."""
    terrain: Length = 0.0
    """Height of the ground under all objects over the one that the UAV knows."""


class TraceTable(Table):
    """Trace that moves the objects, instead of ``[[objects]]``."""

    file: str
    """SUMO FCD XML or CSV, plain or .gz; relative to the scenario file."""
    max_objects: Annotated[Whole, Field(ge=1, le=1000)] = 3
    range: Annotated[Length, Field(gt=0)] = 200.0
    """Served are the nearest vehicles within this distance on the ground."""
    start: Time | None = None
    """Time in the trace at slot 1; the trace's beginning if left out."""
    road: RoadAxis | None = None
    """Two points x1, y1, x2, y2 on the road's axis; fitted to all positions if left out."""
    origin: Annotated[Place | None, Field(json_schema_extra=LENGTH)] = None
    """Position along the road, or point of the plane, of x = 0; the middle if left out."""
