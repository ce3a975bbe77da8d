"""The values that flow through a slot: immutable, and batched over leading axes.

Every array has its own trailing axes and any leading axes ``...`` before them (a block of trials
has one, a single run has one of length one or none). ``K`` is the number of objects, ``N`` of
transmit antennas, ``S`` of state components (angle, distance, velocity), ``M`` of measurement
components (angle, delay, Doppler).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]
Axis = Literal["vertical", "horizontal"]
Phase = Literal["omni", "directional", "pilot"]

PHASES: tuple[Phase, ...] = ("omni", "directional", "pilot")
STATE = ("angle", "distance", "velocity")
MEASUREMENT = ("angle", "delay", "doppler")


def freeze(*arrays: npt.NDArray[np.generic]) -> None:
    """Make arrays read-only: what is recorded stays as it was."""
    for array in arrays:
        array.flags.writeable = False


@dataclass(frozen=True, slots=True)
class GaussianState:
    """A Gaussian belief about every object: prior or posterior by the variable's name.

    Attributes
    ----------
    mean
        ``(..., K, S)``: rad, m, m/s; NaN where the object is not known.
    cov
        ``(..., K, S, S)``; NaN where the object is not known.
    known
        ``(..., K)``: whether there is a belief at all. Objects come and go, shapes stay.
    """

    mean: Array
    cov: Array
    known: BoolArray


@dataclass(frozen=True, slots=True)
class Measurement:
    """What the radar gave about every object.

    Attributes
    ----------
    value
        ``(..., K, M)``: rad, s, Hz; NaN where a component was not measured.
    variance
        ``(..., K, M)``: rad^2, s^2, Hz^2; infinite where a component was not measured.
    """

    value: Array
    variance: Array


@dataclass(frozen=True, slots=True)
class Transmission:
    """One transmission in every phase: the covariances W_k = w_k w_k^H + diag(q_k).

    An omnidirectional slot has ``beams = 0`` and uncorrelated antennas, a directional one has
    ``antenna_power = 0``; physics needs no case distinction, Eqs. (6), (10), (14), (16).

    Attributes
    ----------
    beams
        ``(..., K, N)`` complex, sqrt(power): w_k.
    antenna_power
        ``(..., K, N)``, power: q_k, what each antenna sends of stream k, uncorrelated.
    probing
        ``(..., N)``, power: what each antenna sends without data (K = 0: sensing only).
    """

    beams: ComplexArray
    antenna_power: Array
    probing: Array


@dataclass(frozen=True, slots=True)
class UavMotion:
    """The UAV's own velocity during one slot, which it knows.

    Attributes
    ----------
    speed
        v^u >= 0, m/s.
    heading
        theta^u, angle of the velocity above the horizontal, rad (-pi/2 descends).
    """

    speed: float
    heading: float
