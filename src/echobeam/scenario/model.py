"""Scenario: everything that is simulated, typed, frozen and validated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from echobeam.scenario.quantities import (
    Acceleration,
    Angle,
    Frequency,
    FrozenMapping,
    Length,
    Number,
    Rate,
    Ripple,
    SchemeParameters,
    Speed,
    Time,
    ripple_value,
)
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Axis

Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]
Antennas = Annotated[int, Field(strict=True, ge=1, le=4096)]

PARAMETERS = "scheme_parameters"
"""Field of a scenario that a file has as ``[schemes.NAME]``."""


class _Table(BaseModel):
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
        return type(self).model_validate(self.model_dump() | dict(update))


class ArrayTable(_Table):
    """Transmit and receive uniform linear arrays of the UAV, Eq. (4)."""

    n_tx: Antennas = 30
    n_rx: Antennas | None = None
    """As many as n_tx if left out."""
    spacing: Annotated[Number, Field(gt=0)] = 0.5
    """Antenna spacing in wavelengths."""
    axis: Axis = "vertical"

    @property
    def receivers(self) -> int:
        """N_r."""
        return self.n_tx if self.n_rx is None else self.n_rx


class RadioTable(_Table):
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


class RadarTable(_Table):
    """Echo and the accuracy of its measurement, Eqs. (11)-(24)."""

    rcs: tuple[Number, Number] = (120.0, 120.0)
    """Complex radar cross-section epsilon: real and imaginary part, Eq. (12)."""
    gain: Annotated[Number, Field(gt=0)] = 10.0
    """G_m of the matched filter, Eq. (13)."""
    bandwidth: Annotated[Frequency, Field(gt=0)] = 80e6
    """Kappa, Eq. (20)."""
    pulse_length: Annotated[Time, Field(gt=0)] = 1e-5
    """Iota, Eq. (21)."""
    noise: Annotated[Number, Field(gt=0)] = 1.0
    """sigma^2."""
    crb: Literal["paper", "exact"] = "paper"
    """Measurement variances: Eqs. (20)-(23), or the Fisher information."""
    variance: Literal["predicted", "known"] = "predicted"
    """Variance that a scheme is given: the bound at its own prediction, or at the true state."""
    model: Literal["crb"] = "crb"
    """Measurements are Gaussian with the variance of the bound, Eq. (24)."""


class UavTable(_Table):
    """Flight of the UAV: constant velocity until it levels off at the floor."""

    height: Annotated[Length, Field(gt=0)] = 100.0
    speed: Annotated[Speed, Field(ge=0)] = 0.0
    heading: Annotated[Angle, Field(ge=-math.pi, le=math.pi)] = -math.pi / 2
    """Angle of the velocity above the horizontal; -90 degrees descends."""
    floor: Annotated[Length, Field(gt=0, validate_default=True)] = 1.0
    """Height at which a descending UAV levels off; at most the height that it starts at."""

    @field_validator("floor")
    @classmethod
    def _check_floor(cls, floor: float, info: ValidationInfo) -> float:
        height = info.data.get("height", math.inf)
        if floor > height:
            raise ValueError(
                f"{floor:g} m is above uav.height, {height:g} m; expected at most the height"
            )
        return floor


class ObjectTable(_Table):
    """Start of one object, along the road."""

    angle: Annotated[Angle, Field(gt=0, lt=math.pi)]
    velocity: Speed = 0.0
    acceleration: Acceleration = 0.0


class FrameTable(_Table):
    """Frame structure: the first slot of every frame is omnidirectional (or the pilot)."""

    slot: Annotated[Time, Field(gt=0)] = 0.01
    slots_per_frame: Count = 10
    frames: Count = 1


class FilterTable(_Table):
    """Extended Kalman filter, Eqs. (35), (39)-(49)."""

    angle_std: Annotated[Angle, Field(ge=0)] = math.radians(0.02)
    distance_std: Annotated[Length, Field(ge=0)] = 0.2
    velocity_std: Annotated[Speed, Field(ge=0)] = 0.5
    """Process noise per slot, Eq. (40)."""
    evolution: Literal["paper", "exact"] = "paper"
    """First order as in the paper (corrected), or closed form."""
    velocity_prior: Annotated[Speed, Field(ge=0)] = 0.0
    """Standard deviation of a zero-mean prior on a new object's velocity; 0 means none."""


class CoverageTable(_Table):
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


class TruthTable(_Table):
    """Process noise of nature, on top of the kinematic motion."""

    process_noise: bool = False
    """Noise on each object's position along the road and on its velocity.

    Of the angle and distance noise the part along the road acts: the UAV's height does not wander.
    """
    angle_std: Annotated[Angle, Field(ge=0)] | None = None
    distance_std: Annotated[Length, Field(ge=0)] | None = None
    velocity_std: Annotated[Speed, Field(ge=0)] | None = None
    """Standard deviations for each slot; the filter's if left out."""


class TraceTable(_Table):
    """Trace that moves the objects, instead of ``[[objects]]``."""

    file: str
    """SUMO FCD XML or CSV, plain or .gz; relative to the scenario file."""
    max_objects: Annotated[int, Field(strict=True, ge=1, le=1000)] = 3
    range: Annotated[Length, Field(gt=0)] = 200.0
    """Served are the nearest vehicles within this distance on the ground."""
    start: Time | None = None
    """Time in the trace at slot 1; the trace's beginning if left out."""
    road: tuple[Length, Length, Length, Length] | None = None
    """Two points x1, y1, x2, y2 on the road's axis; fitted to all positions if left out."""
    origin: Length | None = None
    """Position along the road below which the UAV starts; the middle if left out."""


class Scenario(_Table):
    """Complete, validated scenario; see the scenario file's reference in the documentation."""

    name: Annotated[str, Field(min_length=1)]
    description: str = ""
    schemes: tuple[Annotated[str, Field(min_length=1)], ...] = ("temporal", "pilot")
    trials: Count = 200
    """Trials that a run makes unless told otherwise."""
    array: ArrayTable = ArrayTable()
    radio: RadioTable = RadioTable()
    radar: RadarTable = RadarTable()
    uav: UavTable = UavTable()
    objects: tuple[ObjectTable, ...] = ()
    frame: FrameTable = FrameTable()
    filter: FilterTable = FilterTable()
    coverage: CoverageTable = CoverageTable()
    truth: TruthTable = TruthTable()
    trace: TraceTable | None = None
    scheme_parameters: SchemeParameters = FrozenMapping({})
    """Parameters of schemes, by name; in a file ``[schemes.NAME]`` in place of ``schemes``."""

    @model_validator(mode="before")
    @classmethod
    def _split_schemes(cls, document: Any) -> Any:
        """Read ``schemes`` as a list of names, or as tables of parameters in the order run."""
        if not isinstance(document, Mapping) or not isinstance(document.get("schemes"), Mapping):
            return document
        tables = document["schemes"]
        return {**document, "schemes": tuple(tables), PARAMETERS: tables}

    @model_validator(mode="after")
    def _check_parameters(self) -> Scenario:
        """Refuse parameters of schemes that do not run: no file can say so."""
        if self.scheme_parameters and tuple(self.scheme_parameters) != self.schemes:
            raise ValueError(
                f"{PARAMETERS}: for {', '.join(self.scheme_parameters)}; expected all schemes in "
                f"their order, {', '.join(self.schemes)}"
            )
        return self

    @field_validator("name")
    @classmethod
    def _check_name(cls, name: str) -> str:
        """Refuse a name that would be a path: results are named after it."""
        if any(mark in name for mark in "/\\\0") or name in (".", ".."):
            raise ValueError(f"{name!r} is not accepted; expected a name without a slash")
        return name

    def replace(self, overrides: Mapping[str, object]) -> Scenario:
        """Return the scenario with some keys replaced, validated like a file.

        Parameters
        ----------
        overrides
            Dotted keys and their values, units allowed: ``{"uav.height": "80 m"}``.

        Raises
        ------
        ScenarioError
            Names every key that is at fault, its value and what is accepted.
        """
        from echobeam.scenario.load import replaced

        return replaced(self, overrides)

    def to_toml(self) -> str:
        """Return the complete TOML text; loading it gives an equal scenario, bit for bit."""
        from echobeam.scenario.dump import dump_scenario

        return dump_scenario(self)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy, see the tables; other schemes do not keep the parameters of the old."""
        if update and "schemes" in update:
            update = {PARAMETERS: {}, **update}
        return super().model_copy(update=update, deep=deep)

    def __repr__(self) -> str:
        """Return a line: name, objects, antennas, slots and schemes."""
        moved = "a trace" if self.trace is not None else f"{len(self.objects)} object(s)"
        return (
            f"<Scenario {self.name}: {moved}, {self.array.n_tx} antennas, {self.n_slots} slots, "
            f"schemes {', '.join(self.schemes)}>"
        )

    def __str__(self) -> str:
        """Return the same line."""
        return repr(self)

    @property
    def n_slots(self) -> int:
        """Slots of a run, over all frames."""
        return self.frame.slots_per_frame * self.frame.frames

    @property
    def n_objects(self) -> int:
        """K: the most objects that are in the scene at once."""
        return self.trace.max_objects if self.trace is not None else len(self.objects)

    @property
    def truth_stds(self) -> tuple[float, float, float]:
        """Standard deviations of nature's process noise for each slot, rad, m, m/s."""
        own, believed = self.truth, self.filter
        return (
            believed.angle_std if own.angle_std is None else own.angle_std,
            believed.distance_std if own.distance_std is None else own.distance_std,
            believed.velocity_std if own.velocity_std is None else own.velocity_std,
        )

    @property
    def ripple(self) -> float:
        """B of (38f) as a number."""
        return ripple_value(self.coverage.ripple, self.array.n_tx)
