"""The scenario: what is simulated, typed, frozen and validated."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from echobeam.scenario.quantities import (
    Acceleration,
    Angle,
    Frequency,
    Length,
    Number,
    Rate,
    Ripple,
    Speed,
    Time,
    ripple_value,
)
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Axis

Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]
Antennas = Annotated[int, Field(strict=True, ge=1, le=4096)]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ArrayTable(_Table):
    """The UAV's transmit and receive uniform linear arrays, Eq. (4)."""

    n_tx: Antennas = 30
    n_rx: Antennas = 30
    spacing: Annotated[Number, Field(gt=0)] = 0.5
    """Antenna spacing in wavelengths."""
    axis: Axis = "vertical"


class RadioTable(_Table):
    """The communication link, Eqs. (3)-(10)."""

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
    """The echo and how well it can be measured, Eqs. (11)-(24)."""

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
    model: Literal["crb"] = "crb"
    """Measurements are Gaussian with the variance of the bound, Eq. (24)."""


class UavTable(_Table):
    """The UAV's flight: constant velocity until it levels off at the floor."""

    height: Annotated[Length, Field(gt=0)] = 100.0
    speed: Annotated[Speed, Field(ge=0)] = 0.0
    heading: Annotated[Angle, Field(ge=-math.pi, le=math.pi)] = -math.pi / 2
    """Angle of the velocity above the horizontal; -90 degrees descends."""
    floor: Annotated[Length, Field(gt=0)] = 1.0
    """Height at which a descending UAV levels off."""


class ObjectTable(_Table):
    """One object's start, along the road."""

    angle: Annotated[Angle, Field(gt=0, lt=math.pi)]
    velocity: Speed = 0.0
    acceleration: Acceleration = 0.0


class FrameTable(_Table):
    """The frame structure: the first slot of every frame is omnidirectional (or the pilot)."""

    slot: Annotated[Time, Field(gt=0)] = 0.01
    slots_per_frame: Count = 10
    frames: Count = 1


class FilterTable(_Table):
    """The extended Kalman filter, Eqs. (35), (39)-(49)."""

    angle_std: Annotated[Angle, Field(ge=0)] = math.radians(0.02)
    distance_std: Annotated[Length, Field(ge=0)] = 0.2
    velocity_std: Annotated[Speed, Field(ge=0)] = 0.5
    """Process noise per slot, Eq. (40)."""
    evolution: Literal["paper", "exact"] = "paper"
    """First order as in the paper (corrected), or closed form."""
    velocity_prior: Annotated[Speed, Field(ge=0)] = 0.0
    """Standard deviation of a zero-mean prior on a new object's velocity; 0 means none."""


class CoverageTable(_Table):
    """What the beam designs ask for, Eqs. (38e), (38f)."""

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
    max_halfwidth: Annotated[Angle, Field(gt=0, le=math.pi / 2)] = math.pi / 4
    """Widest coverage that is asked for when the angle is hardly known."""


class TruthTable(_Table):
    """What nature adds to the kinematic motion."""

    process_noise: bool = False
    """Whether the truth moves with the filter's process noise (a matched model)."""


class TraceTable(_Table):
    """Objects that move as a recorded trace says, instead of ``[[objects]]``."""

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
    """A complete, validated scenario; see the scenario file's reference in the documentation."""

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

    @property
    def n_slots(self) -> int:
        """Slots of a run, over all frames."""
        return self.frame.slots_per_frame * self.frame.frames

    @property
    def n_objects(self) -> int:
        """K: the most objects that are in the scene at once."""
        return self.trace.max_objects if self.trace is not None else len(self.objects)

    @property
    def ripple(self) -> float:
        """B of (38f) as a number."""
        return ripple_value(self.coverage.ripple, self.array.n_tx)
