"""Frames: when to look around, when to send beams, and whose echoes are processed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from echobeam.schemes.base import View
from echobeam.values import NOBODY, BoolArray, Mode, ModeArray, Tracks


def _everywhere(mode: Mode, view: View) -> ModeArray:
    return np.full(view.n_trials, mode, dtype=np.int8)


@dataclass(frozen=True, slots=True)
class ClockedFrame:
    """The paper's frame: its first slot is omnidirectional, the others are directional.

    Objects that are not known yet are detected in the omnidirectional slot; a known one is
    predicted across it (the two-step prediction) and tracked by its echo in directional slots.
    """

    def mode(self, tracks: Tracks, view: View) -> ModeArray:
        """Return the mode of each trial by the place of the slot in its frame."""
        return _everywhere(Mode.OMNI if view.slot_in_frame == 1 else Mode.DIRECTIONAL, view)

    def sensed(self, tracks: Tracks, mode: ModeArray, view: View) -> BoolArray:
        """Return the unknown objects of an omnidirectional slot, the known ones of the others."""
        looking = (mode == Mode.OMNI)[:, None]
        asked = np.where(looking, ~tracks.known, tracks.known)
        return np.asarray(asked & (tracks.id != NOBODY))


@dataclass(frozen=True, slots=True)
class PilotFrame:
    """A pilot slot without data, then directional slots without radar.

    Attributes
    ----------
    looks
        Mode of the slots in which no object is known yet.
    """

    looks: ClassVar[Mode] = Mode.PILOT

    def mode(self, tracks: Tracks, view: View) -> ModeArray:
        """Return the mode of each trial by the place of the slot in its frame."""
        return _everywhere(Mode.PILOT if view.slot_in_frame == 1 else Mode.DIRECTIONAL, view)

    def sensed(self, tracks: Tracks, mode: ModeArray, view: View) -> BoolArray:
        """Return all objects of the roster in a pilot slot, none in the others."""
        return np.asarray((mode == Mode.PILOT)[:, None] & (tracks.id != NOBODY))


@dataclass(frozen=True, slots=True)
class OmniFrame:
    """Omnidirectional slots only; every object's echo is processed in each of them."""

    directional: ClassVar[bool] = False

    def mode(self, tracks: Tracks, view: View) -> ModeArray:
        """Return "omni" always."""
        return _everywhere(Mode.OMNI, view)

    def sensed(self, tracks: Tracks, mode: ModeArray, view: View) -> BoolArray:
        """Return all objects of the roster."""
        return np.asarray(tracks.id != NOBODY)
