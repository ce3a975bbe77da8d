"""What a scheme is: what the UAV knows, and what it decides from it.

A scheme sees a `View`, which holds no truth. It answers, slot by slot, with a prior, beams and a
posterior; everything else belongs to nature, in the simulation room.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from echobeam.faults import InputError
from echobeam.scenario.model import ArrayTable, CoverageTable, FilterTable, RadioTable
from echobeam.values import (
    Array,
    BoolArray,
    ComplexArray,
    GaussianState,
    Measurement,
    Phase,
    UavMotion,
)


class SchemeError(InputError):
    """A scheme that cannot be found or does not keep the rules; the message says which."""


@dataclass(frozen=True, slots=True)
class System:
    """What the UAV knows of its own equipment, and what it is asked to achieve."""

    array: ArrayTable
    radio: RadioTable
    filter: FilterTable
    coverage: CoverageTable
    ripple: float
    slot_duration: float


@dataclass(frozen=True, slots=True)
class View:
    """What the UAV knows at the start of a slot.

    Attributes
    ----------
    slot, slot_in_frame
        Counted from 1.
    phase
        What the scheme's frame structure says of this slot.
    uav, uav_before
        The UAV's own motion in this slot and in the one before.
    posterior
        Belief after the last slot, ``(..., K)`` objects; all unknown before the first.
    measurement
        What the radar gave in the last slot; nothing before the first. As in the paper its
        variance Q_m is taken as known: it is the bound at the true state, and so tells more of
        the past than a real radar would.
    spread
        ``(..., K)`` rad: sigma_theta of the last slot in which the object was measured, the
        standard deviation that (38f) covers; NaN if never.
    memory
        What the scheme's last `Decision` asked to remember; None at first.
    system
        The UAV's equipment and task.
    truth, present
        States ``(..., K, S)`` and presence ``(..., K)``; None for every scheme that does not
        declare itself omniscient.
    """

    slot: int
    slot_in_frame: int
    phase: Phase
    uav: UavMotion
    uav_before: UavMotion
    posterior: GaussianState
    measurement: Measurement
    spread: Array
    memory: object
    system: System
    truth: Array | None = None
    present: BoolArray | None = None


@dataclass(frozen=True, slots=True)
class Decision:
    """What a scheme sends in a directional slot.

    Attributes
    ----------
    beams
        ``(..., K, N)`` complex, sqrt(power); zero for an object that is not served.
    fallback
        ``(...)`` bool: the design problem had no solution and these are the fallback's beams.
    memory
        Whatever the scheme wants to see again in the next slot's view.
    """

    beams: ComplexArray
    fallback: BoolArray
    memory: object = None


@runtime_checkable
class Scheme(Protocol):
    """A whole scheme. All calls are pure; arrays carry a leading axis of trials."""

    @property
    def name(self) -> str:
        """Name, as in results and on the command line."""

    @property
    def omniscient(self) -> bool:
        """Whether the view shows the truth (a reference, not a scheme that could be built)."""

    def phase(self, slot_in_frame: int) -> Phase:
        """Return what a slot of the frame is for; counted from 1."""

    def predict(self, view: View) -> GaussianState:
        """Return the prior of this slot given everything before it, Eqs. (44)-(46)."""

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return the beams of a directional slot, problem (38)."""

    def listens(self, view: View) -> BoolArray:
        """Return ``(..., K)``: the objects whose echoes are processed in this slot."""

    def update(self, prior: GaussianState, measurement: Measurement, view: View) -> GaussianState:
        """Return the posterior, Eqs. (47)-(49)."""
