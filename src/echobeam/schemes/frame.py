"""The paper's frame and filter, which most schemes share.

The first slot of every frame is omnidirectional. Objects that are not known yet are detected in
it; a known one is predicted across it (the two-step prediction) and tracked by its echo in every
directional slot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.schemes.base import View
from echobeam.tracking import filter as ekf
from echobeam.tracking.initial import initial_state
from echobeam.values import Array, BoolArray, GaussianState, Measurement, Phase


@dataclass(frozen=True, slots=True)
class TrackingFrame:
    """Frame, listening, prediction and update of a scheme that tracks by echoes."""

    @property
    def omniscient(self) -> bool:
        """Never: it sees what its radar gives."""
        return False

    def phase(self, slot_in_frame: int) -> Phase:
        """Return "omni" for a frame's first slot, "directional" for the others."""
        return "omni" if slot_in_frame == 1 else "directional"

    def predict(self, view: View) -> GaussianState:
        """Return the extended Kalman filter's prediction, Eqs. (44)-(46)."""
        return predict(view)

    def forecast(self, view: View, horizon: int) -> list[GaussianState]:
        """Return the priors of this slot and the next, ``horizon`` in all, without measurements.

        The UAV is taken to fly on as it does in this slot.
        """
        settings = view.system.filter
        return ekf.predict_steps(
            view.posterior,
            [view.uav_before, *[view.uav] * (horizon - 1)],
            view.system.slot_duration,
            _process_std(view),
            settings.evolution,
        )

    def listens(self, view: View) -> BoolArray:
        """Return the unknown objects in an omnidirectional slot, the known ones in the others."""
        known = view.posterior.known
        return ~known if view.phase == "omni" else known

    def update(self, prior: GaussianState, measurement: Measurement, view: View) -> GaussianState:
        """Return the filtered state of known objects and the first state of new ones."""
        tracked = ekf.update(prior, measurement, view.uav, view.system.radio.carrier)
        return start_unknown(tracked, measurement, view) if view.phase == "omni" else tracked


def predict(view: View) -> GaussianState:
    """Return the prediction of this slot's states from the last posterior, Eqs. (44)-(46)."""
    settings = view.system.filter
    return ekf.predict(
        view.posterior,
        view.uav_before,
        view.system.slot_duration,
        _process_std(view),
        settings.evolution,
    )


def _process_std(view: View) -> Array:
    settings = view.system.filter
    return np.array([settings.angle_std, settings.distance_std, settings.velocity_std])


def first_state(measurement: Measurement, view: View) -> GaussianState:
    """Return the state that a first measurement alone gives (the paper's Note 2)."""
    prior = view.system.filter.velocity_prior
    return initial_state(measurement, view.uav, view.system.radio.carrier, prior or None)


def start_unknown(state: GaussianState, measurement: Measurement, view: View) -> GaussianState:
    """Start a track for every unknown object that was measured."""
    return choose(state.known, state, first_state(measurement, view))


def choose(mask: BoolArray, one: GaussianState, other: GaussianState) -> GaussianState:
    """Return ``one`` where the mask ``(..., K)`` holds and ``other`` elsewhere."""
    return GaussianState(
        mean=np.where(mask[..., None], one.mean, other.mean),
        cov=np.where(mask[..., None, None], one.cov, other.cov),
        known=np.where(mask, one.known, other.known),
    )
