"""The upper reference: the truth is known, and every slot is optimal for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from echobeam.beamforming.design import design_batch
from echobeam.beamforming.methods import DEFAULT, METHODS
from echobeam.physics import transmission
from echobeam.physics.coordinates import cover_shape
from echobeam.schemes.base import Decision, View, no_tracks
from echobeam.schemes.beamers import problems_at
from echobeam.values import Detections, Mode, Tracks


@dataclass(frozen=True, slots=True)
class TrueTracks:
    """The truth as a belief."""

    tracks: Tracks


@dataclass(frozen=True, slots=True)
class Genie:
    """Maximum sum rate at the true channel: no omnidirectional slot, no coverage.

    Attributes
    ----------
    floors
        Whether it meets the rate floors (38e), as a scheme has to that heeds them.
    """

    parameters: ClassVar[tuple[str, ...]] = ()

    name: str = "genie"
    floors: bool = False

    @property
    def omniscient(self) -> bool:
        """Always: that is its point."""
        return True

    def load(self) -> None:
        """Load or compile the solver, so that no decision waits for it."""
        METHODS[DEFAULT].solver()

    def start(self, view: View) -> TrueTracks:
        """Return no tracks; it needs no past."""
        return TrueTracks(no_tracks(view.roster, view.system.geometry.space.size))

    def predict(self, belief: TrueTracks, view: View) -> TrueTracks:
        """Return the truth, without uncertainty."""
        assert view.truth is not None
        return TrueTracks(view.truth)

    def transmit(self, prior: TrueTracks, view: View) -> Decision:
        """Return the beams of largest sum rate, Eq. (38a) under (38b) alone."""
        tracks, geometry = prior.tracks, view.system.geometry
        cover = (*tracks.known.shape, *cover_shape(geometry.axes))
        problems = problems_at(
            geometry.place(tracks.mean, view.uav),
            np.zeros(cover),
            tracks.known,
            view.system,
            min_rate=view.system.coverage.min_rate if self.floors else 0.0,
        )
        answer = design_batch(problems)
        return Decision(
            sent=transmission.directional(answer.beams),
            addressee=tracks.id,
            sensed=np.zeros_like(tracks.known),
            mode=np.full(view.n_trials, Mode.DIRECTIONAL, dtype=np.int8),
            covered=np.full(cover, np.nan),
            fallback=answer.fallback,
            messages=answer.messages,
        )

    def update(self, prior: TrueTracks, detections: Detections, view: View) -> TrueTracks:
        """Return the prior, which is the truth."""
        return prior
