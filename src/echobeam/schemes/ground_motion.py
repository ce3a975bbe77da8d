"""Motion of the tracker `ground`: one model, or several that interact.

Beliefs of several models are columns side by side, ``(T, M K, S)``: all objects under the first
model, then all under the second. So grids and updates do not depend on how many there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np
import numpy.typing as npt

from echobeam.tracking import filter, interacting
from echobeam.tracking.ground import ROAD, GroundMotion
from echobeam.tracking.ground_acceleration import (
    ROAD_ACCELERATION,
    AcceleratedMotion,
    UnacceleratedMotion,
)
from echobeam.tracking.models import MotionModel
from echobeam.values import Array, BoolArray, GaussianState, StateSpace, UavState

Entry = TypeVar("Entry", bound=np.generic)

Motion = Literal["cv", "ca", "imm"]
"""Constant velocity, constant acceleration, or an interacting mix of both."""

ACCELERATION = 4.0
"""Standard deviation of the acceleration of an object that has one, m/s^2: half a full braking."""

JERK = 0.5
"""Standard deviation of its change in a slot, m/s^2."""

STAY = 0.98
"""Probability that an object keeps its model in a slot: half a second at 10 ms."""


@dataclass(frozen=True, slots=True)
class Motions:
    """Models of the motion, with what is known of components that one of them does not have.

    Attributes
    ----------
    models
        M motion models of one state space.
    entries
        M covariances ``(S, S)``: added to the belief of an object that comes under the model, from
        a first measurement or from another model.
    """

    models: tuple[MotionModel, ...]
    entries: tuple[Array, ...]

    @property
    def space(self) -> StateSpace:
        """The state space of all models."""
        return self.models[0].space

    @property
    def extra(self) -> int:
        """Components of the space besides position, velocity and altitude error."""
        return self.space.size - ROAD.size

    def columns(self, values: npt.NDArray[Entry]) -> npt.NDArray[Entry]:
        """Return an array of objects ``(T, K, ...)`` for every model, ``(T, M K, ...)``."""
        return values if len(self.models) == 1 else np.concatenate([values] * len(self.models), 1)

    def by_model(self, values: npt.NDArray[Entry]) -> npt.NDArray[Entry]:
        """Return an array of columns as ``(T, K, M, ...)``."""
        count = len(self.models)
        apart = values.reshape(values.shape[0], count, values.shape[1] // count, *values.shape[2:])
        return np.moveaxis(apart, 1, 2)

    def likelier(self, values: Array, probability: Array) -> Array:
        """Return an array of columns for the likelier model of every object, ``(T, K, ...)``."""
        apart = self.by_model(values)
        place = np.argmax(probability, axis=-1)
        place = place.reshape(*place.shape, *(1,) * (apart.ndim - 2))
        return np.take_along_axis(apart, place, axis=2)[:, :, 0]

    def at_first(self, shape: tuple[int, ...]) -> Array:
        """Return the probabilities of the models of new objects ``(T, K)``, ``(T, K, M)``."""
        return np.full((*shape, len(self.models)), 1.0 / len(self.models))

    def entered(self, mean: Array, cov: Array) -> tuple[Array, Array]:
        """Return first states ``(T, K, S)`` as columns."""
        return self.columns(mean), np.concatenate([cov + entry for entry in self.entries], axis=1)

    def predicted(
        self, state: GaussianState, probability: Array, uav: UavState
    ) -> tuple[GaussianState, Array]:
        """Return the columns of the next slot, and the probabilities of the models.

        Parameters
        ----------
        state
            Posteriors ``(T, M K)``.
        probability
            ``(T, K, M)``.
        uav
            The UAV in this slot.
        """
        count = len(self.models)
        if count == 1:
            return filter.predict(state, self.models[0], uav), probability
        transition = np.full((count, count), (1.0 - STAY) / (count - 1))
        np.fill_diagonal(transition, STAY)
        predicted, origin = interacting.mixing(probability, transition)
        mean, cov = interacting.interacted(
            origin, self.by_model(state.mean), self.by_model(state.cov), self.entries
        )
        known = np.asarray(self.by_model(state.known).all(axis=-1))
        made = [
            filter.predict(GaussianState(mean[:, :, j], cov[:, :, j], known), model, uav)
            for j, model in enumerate(self.models)
        ]
        parts = [
            np.concatenate([getattr(one, name) for one in made], axis=1) for name in ("mean", "cov")
        ]
        return GaussianState(parts[0], parts[1], self.columns(known)), predicted

    def reweighted(self, probability: Array, log_likelihood: Array, tracked: BoolArray) -> Array:
        """Return the probabilities after a slot; as before where nothing was measured.

        Parameters
        ----------
        probability
            ``(T, K, M)``: predicted.
        log_likelihood
            ``(T, M K)``.
        tracked
            ``(T, K)``: known objects of which something was measured.
        """
        if len(self.models) == 1:
            return probability
        after = interacting.reweighted(probability, self.by_model(log_likelihood))
        return np.where(tracked[..., None], after, probability)

    def mixture(self, state: GaussianState, probability: Array) -> GaussianState:
        """Return the belief about every object, ``(T, K)``."""
        if len(self.models) == 1:
            return state
        mean, cov = interacting.combined(
            probability, self.by_model(state.mean), self.by_model(state.cov)
        )
        return GaussianState(mean, cov, np.asarray(self.by_model(state.known).all(axis=-1)))


def motions_of(name: Motion, slot_duration: float, velocity_std: float) -> Motions:
    """Return the models of a name.

    Parameters
    ----------
    name
        ``"cv"``, ``"ca"`` or ``"imm"``.
    slot_duration, velocity_std
        DT, s, and the process noise of constant velocity in a slot, m/s.
    """
    steady = GroundMotion(slot_duration, velocity_std)
    if name == "cv":
        return Motions((steady,), (np.zeros((ROAD.size, ROAD.size)),))
    size, place = ROAD_ACCELERATION.size, ROAD_ACCELERATION.names.index("acceleration")
    entry = np.zeros((size, size))
    entry[place, place] = ACCELERATION**2
    accelerated = AcceleratedMotion(slot_duration, JERK)
    if name == "ca":
        return Motions((accelerated,), (entry,))
    return Motions((UnacceleratedMotion(steady), accelerated), (np.zeros((size, size)), entry))
