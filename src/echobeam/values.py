"""The values that flow through a slot: immutable, and batched over leading axes.

Every array has its own trailing axes and any leading axes ``...`` before them (a block of trials
has one, a single run has one of length one or none). ``K`` is the number of objects, ``C`` of
streams or tracks, ``D`` of detections, ``N`` of transmit antennas, ``S`` of state components and
``M`` of measurement components.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from echobeam.brief import Brief

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]
ModeArray = npt.NDArray[np.int8]
Axis = Literal["vertical", "horizontal"]

NOBODY = -1
"""Identity of an empty column, addressee of a stream for nobody, label of an unlabelled echo."""


class Mode(IntEnum):
    """Label of a slot for people and plots; physics looks at the `Transmission` alone."""

    OMNI = 0
    DIRECTIONAL = 1
    PILOT = 2
    MIXED = 3


def with_beams(mode: npt.NDArray[np.integer]) -> BoolArray:
    """Return whether beams are sent in slots of some modes ``(...)``, alone or among others."""
    beams: BoolArray = (mode != Mode.OMNI) & (mode != Mode.PILOT)
    return beams


def aligned(mask: BoolArray, values: npt.NDArray[Any]) -> BoolArray:
    """Return a mask ``(...)`` with axes of length one for the trailing axes of some values."""
    return mask.reshape(*mask.shape, *(1,) * (values.ndim - mask.ndim))


def freeze(*arrays: npt.NDArray[np.generic]) -> None:
    """Make arrays read-only: what is recorded stays as it was."""
    for array in arrays:
        array.flags.writeable = False


@dataclass(frozen=True, slots=True)
class StateSpace:
    """Components of a state; owned by the motion model.

    Attributes
    ----------
    names, units
        One for each component.
    angles
        Indices of the components that are angles, whose differences are wrapped.
    valid
        Maps states ``(..., S)`` to ``(...)``: whether an object can have them.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    angles: tuple[int, ...]
    valid: Callable[[Array], BoolArray | np.bool_]

    @property
    def size(self) -> int:
        """Number of components, S."""
        return len(self.names)


class Status(IntEnum):
    """Stage in the life of a track."""

    NONE = 0
    TENTATIVE = 1
    CONFIRMED = 2
    COASTING = 3


@dataclass(frozen=True, slots=True, repr=False)
class Tracks(Brief):
    """Report of a belief: one track for each column, whatever the belief is made of.

    Attributes
    ----------
    mean
        ``(..., C, S)`` in the scenario's state (angle, distance, velocity: rad, m, m/s); NaN where
        there is no track.
    cov
        ``(..., C, S, S)``; NaN where there is no track.
    status
        ``(..., C)`` `Status`; zero where there is no track.
    id
        ``(..., C)``: identity of the track; in labelled runs that of its object. `NOBODY` where
        the column is empty.
    """

    mean: Array
    cov: Array
    status: ModeArray
    id: IntArray

    @property
    def known(self) -> BoolArray:
        """``(..., C)``: whether there is a track."""
        known: BoolArray = self.status != Status.NONE
        return known


@dataclass(frozen=True, slots=True, repr=False)
class GaussianState(Brief):
    """A Gaussian belief about every object: prior or posterior by the variable's name.

    Attributes
    ----------
    mean
        ``(..., K, S)``: in the units of the motion model's `StateSpace`; NaN where not known.
    cov
        ``(..., K, S, S)``; NaN where the object is not known.
    known
        ``(..., K)``: whether there is a belief at all. Objects come and go, shapes stay.
    """

    mean: Array
    cov: Array
    known: BoolArray


@dataclass(frozen=True, slots=True, repr=False)
class Detections(Brief):
    """Output of the radar in one slot.

    Attributes
    ----------
    value
        ``(..., D, M)``: rad, s, Hz; NaN where a component was not measured.
    variance
        ``(..., D, M)``: rad^2, s^2, Hz^2, as the UAV can know it; infinite where a component was
        not measured.
    valid
        ``(..., D)``: whether there is a detection at all.
    label
        ``(..., D)``: identity of the object it belongs to (the paper's labelled measurements);
        `NOBODY` where nobody says.
    """

    value: Array
    variance: Array
    valid: BoolArray
    label: IntArray


@dataclass(frozen=True, slots=True, repr=False)
class Transmission(Brief):
    """One transmission in every mode: the covariances W_c = w_c w_c^H + diag(q_c) of its streams.

    An omnidirectional slot has ``beams = 0`` and uncorrelated antennas, a directional one has
    ``antenna_power = 0``; physics needs no case distinction, Eqs. (6), (10), (14), (16).

    Attributes
    ----------
    beams
        ``(..., C, N)`` complex, sqrt(power): w_c.
    antenna_power
        ``(..., C, N)``, power: q_c, what each antenna sends of stream c, uncorrelated.
    probing
        ``(..., N)``, power: what each antenna sends without data (K = 0: sensing only).
    """

    beams: ComplexArray
    antenna_power: Array
    probing: Array


@dataclass(frozen=True, slots=True, repr=False)
class UavState(Brief):
    """Position and velocity of the UAV in one slot, which it knows, or in each of some slots.

    Attributes
    ----------
    position
        ``(3,)`` or ``(..., 3)`` m at the beginning of the slot: x along the road, y across it, z
        above ground.
    velocity
        Of the same shape, m/s, until the beginning of the next slot.
    """

    position: Array
    velocity: Array

    @property
    def speed(self) -> float | Array:
        """v^u in the vertical plane of the road, m/s."""
        speed: Array = np.hypot(self.velocity[..., 0], self.velocity[..., 2])
        return speed if speed.ndim else float(speed)

    @property
    def heading(self) -> float | Array:
        """theta^u, angle of the velocity above the horizontal, rad (-pi/2 descends)."""
        heading: Array = np.arctan2(self.velocity[..., 2], self.velocity[..., 0])
        return heading if heading.ndim else float(heading)
