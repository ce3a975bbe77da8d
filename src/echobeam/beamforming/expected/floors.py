"""Rate floors (38e) met with a probability: everywhere in the likeliest part of each belief.

P(rate_k >= Gamma_k) is at least 1 - outage if the rate is there at all angles within
``mean +- deviation Phi^-1(1 - outage / 2)``, an interval of just that probability; of two direction
cosines it is an ellipse. That is asked for at its nodes (`directions.floor_nodes`), far closer than
a beam is wide. With beams of given shapes the powers

    I_k(p) = max_j threshold_k (sum_{i != k} gain_kij p_i + loss_kj) / gain_kkj

that the floors take while the others keep theirs are a standard interference function (Yates,
IEEE J. Sel. Areas Commun. 13, 1995), and so is max(lift p_wanted, I(p)): iterated from below it
ends in the least powers that meet all floors, and these grow with ``lift``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.expected.objective import received
from echobeam.beamforming.expected.places import Places
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

MET = 1e-6
"""Relative shortfall of an SINR that is put down to rounding."""

ROUNDS = 60
"""Iterations of the least powers, each from the last ones."""

LIFTS = 12
"""Most steps of the search for the lift."""

SPENT = 1e-5
"""Part of the power that may be left when that search ends; all powers are scaled to spend it."""

LEAST_GAIN = 1e-30

SETTLED = 1e-12
"""Growth of a power, of the whole, below which an iteration ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Floors:
    """Floors of K objects in T trials.

    Attributes
    ----------
    places
        Those of the floors' nodes, in the coordinates of the expectation's.
    threshold
        ``(T, K)``: 2^Gamma_k - 1, zero where there is no floor.
    """

    places: Places
    threshold: Array

    def taken(self, trials: IntArray) -> Floors:
        """Return some of the trials."""
        return Floors(self.places.taken(trials), self.threshold[trials])

    def met(self, beams: ComplexArray) -> BoolArray:
        """Return ``(T, K)``: whether beams ``(T, K, r)`` of unit power meet each floor."""
        at = received(self.places, beams)
        need = self.threshold[..., None] * (1.0 - MET)
        good: BoolArray = np.all(at.own >= need * at.noise, axis=-1)
        return good

    def probability(self, beams: ComplexArray) -> Array:
        """Return ``(T, K)``: the weight of the nodes at which beams meet each floor."""
        at = received(self.places, beams)
        good = at.own >= self.threshold[..., None] * (1.0 - MET) * at.noise
        chance: Array = np.sum(self.places.weight * good, axis=-1)
        return chance

    def gains(self, shapes: ComplexArray) -> Array:
        """Return ``(T, K, J, K)``: gains of unit shapes at the nodes."""
        channel = self.places.channel
        trials, objects, count, size = channel.shape
        response = channel.reshape(trials, -1, size) @ np.swapaxes(shapes, -1, -2)
        power: Array = response.real**2 + response.imag**2
        return power.reshape(trials, objects, count, objects)

    def powers(self, gains: Array, wanted: Array) -> tuple[Array, BoolArray]:
        """Return powers ``(T, K)`` of unit sum that meet the floors, and whether they do.

        Parameters
        ----------
        gains
            As of `gains`.
        wanted
            ``(T, K)``: powers that are lifted by a common factor as far as the floors permit.
        """
        require = Requirement.of(gains, self.places.loss, self.threshold)
        kept = require.least(np.zeros_like(wanted), np.zeros_like(wanted))
        feasible = kept.sum(axis=-1) <= 1.0 + MET
        low, high = np.zeros(len(wanted)), np.ones(len(wanted))
        below, above = kept.sum(axis=-1), require.least(wanted, kept).sum(axis=-1)
        for number in range(LIFTS):
            # The sum is convex in the lift: a chord's is feasible, and halves end what it leaves.
            chord = (1.0 - below) / np.maximum(above - below, SETTLED)
            part = np.where(number % 3 == 2, 0.5, np.clip(chord, 0.0, 1.0))
            middle = low + part * (high - low)
            tried = require.least(middle[:, None] * wanted, kept)
            total = tried.sum(axis=-1)
            fits = total <= 1.0 + SETTLED
            low, below = np.where(fits, middle, low), np.where(fits, total, below)
            high, above = np.where(fits, high, middle), np.where(fits, above, total)
            kept = np.where(fits[:, None], tried, kept)
            if (below >= 1.0 - SPENT)[feasible].all():
                break
        total = kept.sum(axis=-1, keepdims=True)
        return kept / np.where(total > 0.0, total, 1.0), feasible


@dataclass(frozen=True, slots=True, eq=False)
class Requirement:
    """The interference function of shapes with these gains.

    Attributes
    ----------
    foreign
        ``(T, K, J, K)``: gains of the other beams at an object's nodes.
    loss, scale
        ``(T, K, J)``: noise, and threshold over the gain of the own beam.
    """

    foreign: Array
    loss: Array
    scale: Array

    @classmethod
    def of(cls, gains: Array, loss: Array, threshold: Array) -> Requirement:
        """Return that of gains ``(T, K, J, K)`` and thresholds ``(T, K)``."""
        which = np.arange(gains.shape[1])
        own = np.moveaxis(gains[:, which, :, which], 0, 1)
        foreign = gains.copy()
        foreign[:, which, :, which] = 0.0
        asked = threshold[..., None]
        scale = np.where(asked > 0.0, asked / np.maximum(own, LEAST_GAIN), 0.0)
        return cls(foreign, loss, scale)

    def least(self, at_least: Array, begin: Array) -> Array:
        """Return the least powers, from below; a sum beyond 1 says that there are none."""
        powers = np.maximum(begin, at_least)
        going = np.ones(len(powers), dtype=bool)
        for _ in range(ROUNDS):
            noise = (self.foreign @ powers[:, None, :, None])[..., 0] + self.loss
            new = np.maximum(at_least, np.max(self.scale * noise, axis=-1))
            new = np.minimum(np.maximum(new, powers), 2.0)  # beyond the budget anyway
            new = np.where(going[:, None], new, powers)
            going = np.max(new - powers, axis=-1, initial=0.0) > SETTLED
            powers = new
            if not going.any():
                break
        return powers
