"""Nature in one slot of a block of trials: it knows the truth and decides nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echobeam.physics.coordinates import direction_of, distance_of
from echobeam.physics.link import channel_loss, rate, sinr
from echobeam.schemes.base import Decision
from echobeam.simulation.elevation import elevated
from echobeam.simulation.headings import headings
from echobeam.simulation.movers import Ground
from echobeam.simulation.scene import Scene
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    IntArray,
    UavState,
    freeze,
)


@dataclass(frozen=True, slots=True)
class Link:
    """Downlink of one slot: ``(T, K)`` each."""

    sinr: Array
    rate: Array


@dataclass(frozen=True, slots=True)
class World:
    """Nature in one slot, for a block of trials.

    Attributes
    ----------
    scene
        Everything that the trials have in common.
    seed, trials
        Key of the draws.
    slot
        Counted from 0.
    uav
        The UAV.
    ground
        The objects in ground coordinates.
    state
        ``(T or 1, K, S)``: the objects as seen from the UAV; NaN where nobody is.
    heading
        ``(T or 1, K, 3)``: vector along each object's direction of travel, of any length.
    """

    scene: Scene
    seed: int
    trials: range
    slot: int
    uav: UavState
    ground: Ground
    state: Array
    heading: Array

    @property
    def identity(self) -> IntArray:
        """``(K,)``: who is in each column."""
        return self.ground.identity

    @property
    def present(self) -> BoolArray:
        """``(K,)``: whether somebody is."""
        present: BoolArray = self.ground.identity != NOBODY
        return present

    @property
    def place(self) -> Array:
        """``(T or 1, K, A + 1)`` or more: direction and distance of the objects.

        Laws of the echo are evaluated there. Its velocity is the heading, which an object at rest
        has as well.
        """
        geometry, position = self.scene.geometry, self.ground.position
        motion = self.ground.velocity if self.scene.law.target is None else self.heading
        motion = np.broadcast_to(motion, position.shape)  # of one path, altitudes of each trial
        return geometry.place(geometry.exact(position, motion, self.uav), self.uav)

    def link(self, decision: Decision, addressee: IntArray) -> Link:
        """Return SINR and rate at the true channel, Eqs. (7), (8), (10).

        Objects that are served by one stream take turns, with equal shares of the time.

        Parameters
        ----------
        decision
            What is sent.
        addressee
            ``(T, C)``: identity of the object that each column of the decision is for.
        """
        radio = self.scene.scenario.radio
        place, array = self.place, self.scene.law.transmitter
        loss = channel_loss(distance_of(place, array.axes), radio.noise, radio.alpha0)
        own = self.addressed(addressee)
        taken_in_turns = None
        if decision.carrier is not None:
            columns = np.arange(own.shape[-1])
            carries = decision.carrier[:, None, :] == columns[:, None]  # (T, stream, column)
            # A track that nobody is behind is served all the same: the UAV does not know.
            listeners = (carries & (decision.addressee != NOBODY)[:, None, :]).sum(axis=-1)
            own = np.any(own[:, :, None, :] & carries[:, None], axis=-1)
            taken_in_turns = np.where(own, listeners[:, None, :], 0).max(axis=-1, initial=1)
        ratio = sinr(decision.sent, own, direction_of(place, array.axes), loss, array)
        each = rate(ratio)
        return Link(ratio, each if taken_in_turns is None else each / taken_in_turns)

    def ideal(self) -> Array:
        """Return the objects' measurements without noise, ``(T or 1, K, M)``, Eqs. (17)-(19)."""
        geometry, ground = self.scene.geometry, self.ground
        state = geometry.exact(ground.position, ground.velocity, self.uav)
        return geometry.ideal(state, self.uav, self.scene.scenario.radio.carrier)

    def advance(self) -> World:
        """Return nature one slot later."""
        mover, slot = self.scene.mover, self.slot + 1
        ground = mover.advance(self.ground, self.slot, self.uav, self.seed, self.trials)
        heading = headings(ground, self.ground.identity, self.heading, mover, slot)
        return _seen(replace(self, slot=slot, ground=ground, heading=heading))

    def addressed(self, addressee: IntArray) -> BoolArray:
        """Return ``(T, K, C)``: whether a stream is for an object, by identities ``(T, C)``."""
        own: BoolArray = (addressee[:, None, :] == self.identity[:, None]) & self.present[:, None]
        return own


def begin(scene: Scene, seed: int, trials: range) -> World:
    """Return nature in the first slot of some trials."""
    ground = scene.mover.begin()
    nothing = np.empty(0)
    heading = headings(ground, ground.identity, None, scene.mover, 0)
    return _seen(World(scene, seed, trials, 0, scene.flight.at(0), ground, nothing, heading))


def _seen(world: World) -> World:
    """Return nature with the UAV in its slot and the objects as seen from there."""
    uav = world.scene.flight.at(world.slot)
    ground = elevated(world.ground, world.scene.scenario, world.seed, world.trials)
    state = world.scene.geometry.state(ground.position, ground.velocity, uav)
    freeze(state, ground.position, ground.velocity, ground.identity, uav.position, uav.velocity)
    freeze(world.heading)
    return replace(world, uav=uav, ground=ground, state=state)
