"""Frames without a clock: each trial looks around when that pays, by what it believes.

A look is a slot with power in all directions. It pays for two reasons. Somebody is known to be
there and not where: an object of the roster without a track, a track that has no detection, or one
whose angle is known to several beam widths only, so that its own beam tells little. Or somebody
may have come whom nobody announces: objects arrive at a rate lambda, so a time T after the last
look lambda T of them are expected, each missing its share of the rate. With n objects served, a
look that costs the part c of a slot's rate, and looks every T, the loss per time is
c DT / T + lambda T / (2 n) of the rate, which is least for

    T = sqrt(2 n c DT / lambda).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.faults import InputError
from echobeam.physics.array import LinearArray
from echobeam.physics.coordinates import distance_of
from echobeam.schemes.base import View
from echobeam.values import NOBODY, Array, BoolArray, Mode, ModeArray, Tracks

ARRIVALS = 1.0
"""Objects that are expected to arrive, 1/s, where nobody announces them."""

LOST = 3.0
"""Standard deviations of the angle, in half-power widths of a beam, from which a track is lost."""

HALF_POWER = 0.886
"""Half-power width of a uniform array of unit length in wavelengths, in direction cosines."""

PATIENCE = 5
"""Slots between two looks for one that is lost: its own beam, made wide, is tried before. Looks
without an echo after which an object may be where it cannot be seen."""


@dataclass(frozen=True, slots=True)
class AdaptiveFrame:
    """Omnidirectional slots when they pay, beams in all others.

    In an omnidirectional slot all echoes are processed, in the others those of known objects.

    Attributes
    ----------
    arrival_rate
        lambda, 1/s: new objects that are expected; 0 for none. With labels the roster announces
        them.
    lost
        Standard deviation of an angle, in half-power widths, from which a track is lost.
    patience
        Slots between two looks for a lost track. After as many looks without an echo an object
        without a track is looked for once a frame only.
    """

    arrival_rate: float = ARRIVALS
    lost: float = LOST
    patience: int = PATIENCE

    def __post_init__(self) -> None:
        _check(self.arrival_rate, self.lost, self.patience)

    def mode(self, tracks: Tracks, view: View) -> ModeArray:
        """Return "omni" in the trials in which a look pays, else "directional"."""
        searched = _missing(tracks, view, self.lost, self.patience)
        due = searched | _scheduled(tracks, view, self.arrival_rate, 1.0)
        return np.where(due, Mode.OMNI, Mode.DIRECTIONAL).astype(np.int8)

    def sensed(self, tracks: Tracks, mode: ModeArray, view: View) -> BoolArray:
        """Return all objects in a look, the known ones in the other slots."""
        return _sensed(tracks, mode)


@dataclass(frozen=True, slots=True)
class ProbingFrame:
    """Beams always, and with them a share of the power in all directions when a look pays.

    Nothing but the share is lost, and the rate does not dip. For an object that is missing, and
    before anybody is known, the slot is omnidirectional: no power is too much then.

    Attributes
    ----------
    share
        Part of the power that goes in all directions in a look for new objects.
    arrival_rate, lost, patience
        As in `AdaptiveFrame`.
    """

    share: float = 0.2
    arrival_rate: float = ARRIVALS
    lost: float = LOST
    patience: int = PATIENCE

    def __post_init__(self) -> None:
        _check(self.arrival_rate, self.lost, self.patience)
        if not 0.0 < self.share < 1.0:
            raise InputError(
                f"share: {self.share!r} is not accepted; expected a number between 0 and 1"
            )

    def mode(self, tracks: Tracks, view: View) -> ModeArray:
        """Return "mixed" where a look for new objects pays, "omni" where one is missing."""
        searched = _missing(tracks, view, self.lost, self.patience)
        due = _scheduled(tracks, view, self.arrival_rate, self.share)
        mode = np.where(due, Mode.MIXED, Mode.DIRECTIONAL)
        return np.where(searched, Mode.OMNI, mode).astype(np.int8)

    def sensed(self, tracks: Tracks, mode: ModeArray, view: View) -> BoolArray:
        """Return all objects in a look, the known ones in the other slots."""
        return _sensed(tracks, mode)


def _check(arrival_rate: float, lost: float, patience: int) -> None:
    """Refuse what makes no frame."""
    if not 0.0 <= arrival_rate < np.inf:
        raise InputError(
            f"arrival_rate: {arrival_rate!r} is not accepted; expected a number >= 0, in 1/s"
        )
    if not lost > 0.0:
        raise InputError(f"lost: {lost!r} is not accepted; expected a number > 0")
    if patience < 1:
        raise InputError(f"patience: {patience} is not accepted; expected 1 or more")


def _missing(tracks: Tracks, view: View, lost: float, patience: int) -> BoolArray:
    """Return ``(T,)``: whether somebody is there, and not known where."""
    since = view.slot - view.last_look
    unknown = (tracks.id != NOBODY) & ~tracks.known
    unseen = unknown & (view.unanswered >= patience)
    # An object that was announced in the slot of the last look was not searched in it yet.
    never = view.last_look == 0
    # Where nobody is known, no beam has a use for the slot.
    sought = (unknown & ~unseen).any(axis=-1) | ~tracks.known.any(axis=-1)
    new: BoolArray = sought & (since > 1)
    again = unseen.any(axis=-1) & (since >= view.system.frame.slots_per_frame)
    wide = tracks.known & (_widths(tracks, view) > lost)
    old = wide.any(axis=-1) & (since >= patience)
    return np.asarray(never | new | again | old)


def _widths(tracks: Tracks, view: View) -> Array:
    """Return the standard deviation of each direction in half-power widths of a beam, ``(T, C)``.

    On the ground it is that of the position across the line of sight at most, and the width that
    of the array's shorter side, 0.886 / (n spacing) in direction cosines (Van Trees, *Optimum
    Array Processing*, 2002, section 2.4).
    """
    system, array = view.system, view.system.transmitter
    place = system.geometry.place(tracks.mean, view.uav)
    if isinstance(array, LinearArray) and system.geometry.axes == 1:
        angle = np.where(tracks.known, place[..., 0], 0.0)
        variance = np.where(tracks.known, tracks.cov[..., 0, 0], 0.0)
        width = array.half_power_width(angle)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)) / width)
    variance = np.where(tracks.known, np.maximum(tracks.cov[..., 0, 0], tracks.cov[..., 1, 1]), 0.0)
    distance = np.where(tracks.known, distance_of(place, array.axes), 1.0)
    side = min(n for n in array.shape if n > 1) if array.elements > 1 else 1
    return np.asarray(np.sqrt(variance) / distance * side * array.spacing / HALF_POWER)


def _scheduled(tracks: Tracks, view: View, rate: float, cost: float) -> BoolArray:
    """Return ``(T,)``: whether a look for objects that nobody announces is due."""
    since = view.slot - view.last_look
    if view.system.labelled or rate == 0.0:
        return np.zeros(since.shape, dtype=bool)
    served = np.maximum(tracks.known.sum(axis=-1), 1)
    period = np.sqrt(2.0 * served * cost / (rate * view.system.slot_duration))
    return np.asarray(since >= period)


def _sensed(tracks: Tracks, mode: ModeArray) -> BoolArray:
    looks = (mode != Mode.DIRECTIONAL)[:, None]
    return np.asarray((looks | tracks.known) & (tracks.id != NOBODY))
