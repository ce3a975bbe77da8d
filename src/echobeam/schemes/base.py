"""The contract of a scheme: what it is shown, and what it answers.

A scheme sees a `View`, which holds no truth, and answers slot by slot with a prior, a `Decision`
and a posterior. The beliefs are of its own type; all that others ask of one is its `Tracks`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from echobeam.brief import Brief
from echobeam.faults import InputError, RunError
from echobeam.physics.coordinates import Geometry
from echobeam.physics.detection import DetectionLaw
from echobeam.physics.link import channel_loss
from echobeam.physics.planar import AntennaArray
from echobeam.physics.polar import POLAR
from echobeam.physics.road import ROAD_GEOMETRY
from echobeam.physics.variance_law import VarianceLaw
from echobeam.scenario.tables import (
    ArrayTable,
    CoverageTable,
    FilterTable,
    FrameTable,
    RadioTable,
    TracksTable,
)
from echobeam.values import (
    Array,
    BoolArray,
    Detections,
    IntArray,
    ModeArray,
    Tracks,
    Transmission,
    UavState,
)


class SchemeError(InputError):
    """Fault of a scheme that cannot be found or does not keep the rules; the message says which."""


class SchemeRunError(SchemeError, RunError):
    """Fault of a scheme during a run: its code raised, or its answer breaks the contract."""


@dataclass(frozen=True, slots=True, repr=False)
class System(Brief):
    """Equipment and task of the UAV, as one scheme is given them.

    Attributes
    ----------
    array, radio, frame
        The scenario's tables.
    filter, coverage
        The scenario's tables with the scheme's own parameters in place.
    law
        Variance of a measurement as a function of a state and of what was sent.
    ripple
        B of (38f) as a number.
    detection
        Law of detections and false ones.
    law_known
        Whether the variance of a detection is `law` at its place (``radar.variance =
        "predicted"``), which a prediction tells better than the detection; else detections state
        their own.
    tracks
        The table of association and life of tracks, for unlabelled detections, with the scheme's
        own parameters in place.
    altitude_std
        Standard deviation of the UAV's known height over the ground under an object, m: of
        altimeter and terrain together.
    labelled
        Whether somebody says whose a detection is, and who is there.
    geometry
        Coordinates of states and measurements.
    """

    array: ArrayTable
    radio: RadioTable
    frame: FrameTable
    filter: FilterTable
    coverage: CoverageTable
    law: VarianceLaw
    ripple: float
    detection: DetectionLaw
    law_known: bool
    tracks: TracksTable
    altitude_std: float
    labelled: bool = True
    geometry: Geometry = ROAD_GEOMETRY

    @property
    def transmitter(self) -> AntennaArray:
        """The transmit array."""
        return self.law.transmitter

    def loss(self, distance: Array, share: Array | None = None) -> Array:
        """Return the noise over path gain ``(T, C)`` that beams of the whole power are made for.

        It is `channel_loss`. With a share s of the power in all directions it is
        (loss + s P_T) / (1 - s): beams that are scaled by the root of 1 - s afterwards then have
        the SINR that they were made for, exactly.

        Parameters
        ----------
        distance
            ``(T, C)`` m: of each object.
        share
            ``(T,)``: s; None for none.
        """
        radio = self.radio
        loss = channel_loss(distance, radio.noise, radio.alpha0)
        if share is None or not share.any():
            return loss
        left = 1.0 - share[:, None]
        return np.asarray((loss + share[:, None] * radio.power) / left)

    @property
    def slot_duration(self) -> float:
        """DT, s."""
        return self.frame.slot


@dataclass(frozen=True, slots=True, repr=False)
class View(Brief):
    """Knowledge of the UAV at the start of a slot, besides the scheme's own belief.

    Attributes
    ----------
    slot
        Counted from 1.
    uav, uav_before
        The UAV's own position and velocity in this slot and in the one before.
    system
        The UAV's equipment and task.
    roster
        ``(T, K)``: identity of the object in each column, `NOBODY` where it is empty; the paper's
        "awareness of K objects" of labelled runs. It says who is in service, never where. Without
        labels there is none, K = 0.
    memory
        The memory of the scheme's last `Decision`; None at first.
    normals
        Standard normals for a scheme that draws: ``view.normals(shape)`` returns
        ``(T, *shape)``, the same in every run of the seed and for every split of the work. A
        second call repeats the first; the view of an update has draws of its own.
    sent
        The transmission of this slot, when the scheme is asked to update; None before it decided.
    truth
        True states as tracks; None for every scheme that does not declare itself omniscient.
    mode
        ``(T,)`` `Mode` of this slot, when the scheme is asked to update.
    last_look
        ``(T,)``: the last slot before this one in which power went in all directions; 0 if none.
    unanswered
        ``(T, K)``: such slots since the last echo of each object, or since it came on the roster;
        for the frame of a scheme of parts, else zero.
    """

    slot: int
    uav: UavState
    uav_before: UavState
    system: System
    roster: IntArray
    memory: Any
    normals: Callable[[tuple[int, ...]], Array]
    sent: Transmission | None = None
    truth: Tracks | None = None
    mode: ModeArray | None = None
    last_look: IntArray = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    unanswered: IntArray = field(default_factory=lambda: np.zeros((1, 1), dtype=np.int64))

    @property
    def n_trials(self) -> int:
        """T, the number of trials that run side by side."""
        return int(self.roster.shape[0])

    @property
    def n_objects(self) -> int:
        """K, the number of columns of the roster."""
        return int(self.roster.shape[1])

    @property
    def slot_in_frame(self) -> int:
        """Place of the slot in its frame, counted from 1."""
        return (self.slot - 1) % self.system.frame.slots_per_frame + 1


@runtime_checkable
class Belief(Protocol):
    """Belief of any type; the loop passes it on and asks it only for its tracks."""

    @property
    def tracks(self) -> Tracks:
        """Mean, covariance and status of every track, in the scenario's state."""


@dataclass(frozen=True, slots=True, repr=False)
class Decision(Brief):
    """Decision of a scheme in one slot, for each trial: what is sent, for whom, what is covered.

    Attributes
    ----------
    sent
        The transmission, C streams.
    addressee
        ``(T, C)``: identity of the track that each stream is for (in labelled runs that of the
        object, from the roster); `NOBODY` for none. No track has two streams.
    sensed
        ``(T, C)``: whether the echo of the addressee is processed. Without labels those of all or
        of nobody are: all where any is asked for.
    mode
        ``(T,)`` `Mode`: a label for people and plots.
    covered
        ``(T, C)`` rad: half-width that the beam was designed to cover; NaN without a design. On
        the ground ``(T, C, 2, 2)``: the matrices of the ellipses, in direction cosines.
    fallback
        ``(T,)``: whether the beams are a fallback of the design.
    messages
        Reasons of fallbacks, by trial.
    memory
        Anything that the scheme wants to see again in the next slot's view.
    carrier
        ``(T, C)``: column of the stream that carries the data of each addressee; its own if None.
        Addressees of one stream take turns, each with an equal share of its rate.
    """

    sent: Transmission
    addressee: IntArray
    sensed: BoolArray
    mode: ModeArray
    covered: Array
    fallback: BoolArray
    messages: dict[int, str] | None = None
    memory: Any = None
    carrier: IntArray | None = None


@runtime_checkable
class Scheme(Protocol):
    """Scheme as a whole. All calls are pure; arrays carry a leading axis of trials."""

    @property
    def name(self) -> str:
        """Name, as in results and on the command line."""

    @property
    def omniscient(self) -> bool:
        """Whether the view shows the truth (a reference, not a scheme that could be built)."""

    def start(self, view: View) -> Any:
        """Return the belief before the first slot."""

    def predict(self, belief: Any, view: View) -> Any:
        """Return the prior of this slot given everything before it, Eqs. (44)-(46)."""

    def transmit(self, prior: Any, view: View) -> Decision:
        """Return what is sent in this slot, problem (38)."""

    def update(self, prior: Any, detections: Detections, view: View) -> Any:
        """Return the posterior, Eqs. (47)-(49)."""


def no_tracks(roster: IntArray, size: int = POLAR.size) -> Tracks:
    """Return tracks of which nothing is known, one for each column of a roster ``(T, K)``."""
    return Tracks(
        mean=np.full((*roster.shape, size), np.nan),
        cov=np.full((*roster.shape, size, size), np.nan),
        status=np.zeros(roster.shape, dtype=np.int8),
        id=roster,
    )


def reported(belief: Any, whose: str, call: str) -> Tracks:
    """Return the tracks of a belief.

    Parameters
    ----------
    belief
        As a scheme or a tracker returned it.
    whose, call
        Scheme or tracker, and the call, for the message.

    Raises
    ------
    SchemeError
        If it reports none.
    """
    there = hasattr(type(belief), "tracks") or "tracks" in getattr(belief, "__dict__", {})
    tracks = belief.tracks if there else None
    if not isinstance(tracks, Tracks):
        raise SchemeError(
            f"{whose} returned a belief of type {type(belief).__name__} from {call} "
            "that reports no tracks; expected an attribute `tracks` of type echobeam.Tracks"
        )
    return tracks
