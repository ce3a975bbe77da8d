"""Rate floors (38e) met with a probability: everywhere in the likeliest part of each belief.

P(rate_k >= Gamma_k) is at least 1 - outage if the rate is there at all angles within
``mean +- deviation Phi^-1(1 - outage / 2)``, an interval of just that probability. That is asked
for at nodes of the interval, far closer than a beam is wide. With beams of given shapes the powers

    I_k(p) = max_j threshold_k (sum_{i != k} gain_kij p_i + loss_kj) / gain_kkj

that the floors take while the others keep theirs are a standard interference function (Yates,
IEEE J. Sel. Areas Commun. 13, 1995), and so is max(lift p_wanted, I(p)): iterated from below it
ends in the least powers that meet all floors, and these grow with ``lift``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from echobeam.beamforming.expected import starts
from echobeam.beamforming.expected.ascent import ascend, step
from echobeam.beamforming.expected.objective import normalised, received
from echobeam.beamforming.expected.places import Places
from echobeam.beamforming.expected.quadrature import REACH
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

MET = 1e-6
"""Relative shortfall of an SINR that is put down to rounding."""

ROUNDS = 60
"""Iterations of the least powers, each from the last ones; bisections of the lift."""

HALVINGS = 16

CLOSER = 3
"""Nodes of a floor for each of the expectation's: a weak direction must not hide between them."""

POLISHING = 12
"""Steps of the climb that keep the floors."""

WORTH = 1e-5
"""Relative gain of a step below which they end."""

PARTS = (1.0, 0.3, 0.1)
"""Parts of a step that are tried."""

CARE = 0.3
"""Weight of the floors' nodes next to that of the expectation's in those steps."""

SHARPNESS = 10.0
"""Power of the inverse SINR by which that weight goes to the weakest directions."""

FLATTER = 4
"""Rounds in which the weights of a flat shape follow its weakest directions."""

CLEAR = 1e-3
"""Noise over what a flat shape is designed with: the climb then sees logarithms of the gain."""


def floor_nodes(outage: float, count: int) -> Array:
    """Return ``(J,)`` standard normal numbers: the central interval of probability 1 - outage.

    Parameters
    ----------
    outage
        Probability of being outside.
    count
        Nodes of the expectation, which has a width of twice `REACH`.
    """
    if count == 1:
        return np.zeros(1)
    edge = float(ndtri(1.0 - 0.5 * outage))
    many = CLOSER * int(np.ceil(edge / REACH * (count - 1))) + 1
    return np.linspace(-edge, edge, max(many | 1, 5))


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
        require = _Requirement(gains, self.places.loss, self.threshold)
        low, high = np.zeros(len(wanted)), np.full(len(wanted), 1.0)
        kept = require.least(np.zeros_like(wanted), np.zeros_like(wanted))
        feasible = kept.sum(axis=-1) <= 1.0 + MET
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            tried = require.least(middle[:, None] * wanted, kept)
            fits = tried.sum(axis=-1) <= 1.0
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
            kept = np.where(fits[:, None], tried, kept)
        total = kept.sum(axis=-1, keepdims=True)
        return kept / np.where(total > 0.0, total, 1.0), feasible


@dataclass(frozen=True, slots=True, eq=False)
class _Requirement:
    """The interference function of shapes with these gains."""

    gains: Array
    loss: Array
    threshold: Array

    def least(self, at_least: Array, begin: Array) -> Array:
        """Return the least powers, from below; a sum beyond 1 says that there are none."""
        which = np.arange(self.gains.shape[1])
        own = np.moveaxis(self.gains[:, which, :, which], 0, 1)
        foreign = self.gains.copy()
        foreign[:, which, :, which] = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.where(self.threshold[..., None] > 0.0, self.threshold[..., None] / own, 0.0)
        scale = np.minimum(np.nan_to_num(scale, nan=np.inf), 1e30)
        powers = np.maximum(begin, at_least)
        for _ in range(ROUNDS):
            noise = (foreign @ powers[:, None, :, None])[..., 0] + self.loss
            new = np.maximum(at_least, np.max(scale * noise, axis=-1))
            new = np.minimum(np.maximum(new, powers), 2.0)  # beyond the budget anyway
            grown = np.max(new - powers, initial=0.0)
            powers = new
            if grown <= 1e-12:
                break
        return powers


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """Beams ``(T, K, r)``, whether they keep all floors, and the part of the floors asked for."""

    beams: ComplexArray
    feasible: BoolArray
    part: Array


def keep_floors(places: Places, floors: Floors, beams: ComplexArray) -> Kept:
    """Return beams that meet the floors and lose little of the expected sum rate.

    Parameters
    ----------
    places
        Nodes of the expectation.
    floors
        What has to be met.
    beams
        ``(T, K, r)``: a design without floors, unit power.
    """
    power = np.sum(np.abs(beams) ** 2, axis=-1)
    principal = starts.principal_shapes(places)
    free = np.where(power[..., None] > 0.0, starts.unit(beams), principal)
    easy = _easiest(floors, [free, principal, flat_shapes(floors, principal)])
    short = ~floors.met(beams) & (floors.threshold > 0.0)
    best, value = beams, np.full(len(places), -np.inf)
    for shapes in (free, np.where(short[..., None], easy, free), easy):
        made, feasible = _with_powers(floors, shapes, power)
        reached = np.where(feasible, received(places, made).value, -np.inf)
        better = reached > value
        best = np.where(better[:, None, None], made, best)
        value = np.where(better, reached, value)
    feasible = np.isfinite(value)
    best = _polished(places, floors, best, value)
    scaled, part = _scaled(floors, easy)
    return Kept(np.where(feasible[:, None, None], best, scaled), feasible, part)


def _polished(places: Places, floors: Floors, beams: ComplexArray, value: Array) -> ComplexArray:
    """Return beams that meet the floors as these do, of a larger expected sum rate.

    Steps of the climb, with weight on the directions in which the floors are nearest, as far as
    the floors permit.
    """
    best = beams.copy()
    running = np.flatnonzero(np.isfinite(value))
    for _ in range(POLISHING):
        if running.size == 0:
            break
        part, limits = places.taken(running), floors.taken(running)
        old, before = best[running], value[running]
        aimed = _with_care(part, limits, old)
        towards = step(aimed, received(aimed, old))
        new, after = old, before
        for length in PARTS:
            mixed = old + length * (towards - old)
            wanted = np.sum(np.abs(mixed) ** 2, axis=-1)
            made, fits = _with_powers(limits, starts.unit(mixed), wanted)
            reached = np.where(fits, received(part, made).value, -np.inf)
            better = reached > after
            new = np.where(better[:, None, None], made, new)
            after = np.where(better, reached, after)
        best[running], value[running] = new, after
        running = running[after > before * (1.0 + WORTH)]
    return best


def _with_care(places: Places, floors: Floors, beams: ComplexArray) -> Places:
    """Return the expectation's nodes together with the floors', weighted by their nearness."""
    inner = floors.places
    at = received(inner, beams)
    margin = at.own / at.noise
    least = np.min(margin, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.where(margin > 0.0, (least / margin) ** SHARPNESS, 0.0)
    total = np.sum(near, axis=-1, keepdims=True)
    near = CARE * near / np.where(total > 0.0, total, 1.0)
    near = np.where((floors.threshold > 0.0)[..., None], near, 0.0)
    return Places(
        np.concatenate([places.channel, inner.channel], axis=2),
        np.concatenate([places.weight, near], axis=2),
        np.concatenate([places.loss, inner.loss], axis=2),
        places.centre,
        places.basis,
        places.active,
    )


def flat_shapes(floors: Floors, shapes: ComplexArray) -> ComplexArray:
    """Return unit shapes ``(T, K, r)`` with a large smallest gain over the floors' nodes.

    Each object alone: the sum of the logarithms of its gains is climbed, with weights that move
    to the weakest directions.
    """
    trials, objects, count, size = floors.places.channel.shape
    if count == 1:
        return shapes
    channel = floors.places.channel.reshape(trials * objects, 1, count, size)
    loss = np.full((trials * objects, 1, count), CLEAR / size)
    weight = np.broadcast_to(floors.places.active.reshape(-1, 1, 1) / count, loss.shape)
    centre = floors.places.centre.reshape(trials * objects, 1, size)
    active = floors.places.active.reshape(-1, 1)
    basis = np.repeat(floors.places.basis, objects, axis=0)
    line = np.linspace(-1.0, 1.0, count)
    turns = np.exp(0.5j * np.pi * line**2 * max(size - 2, 0))
    begin = (weight * turns)[..., None, :] @ channel
    beams = starts.unit(begin[..., 0, :] + 0.1 * shapes.reshape(-1, 1, size))
    best = shapes.reshape(-1, 1, size)
    smallest = _weakest(channel, best)
    for _ in range(FLATTER):
        place = Places(channel, weight, loss, centre, basis, active)
        beams = ascend(place, beams, 5).beams
        gain = _gain(channel, beams)
        least = np.min(gain, axis=-1)
        better = least > smallest
        best = np.where(better[..., None], beams, best)
        smallest = np.where(better, least, smallest)
        weight = weight / np.sqrt(np.maximum(gain, 1e-6))
        total = np.sum(weight, axis=-1, keepdims=True)
        weight = weight / np.where(total > 0.0, total, 1.0)
    return best.reshape(trials, objects, size)


def _gain(channel: Array, shapes: ComplexArray) -> Array:
    response = (channel @ shapes[..., None])[..., 0]
    gain: Array = response.real**2 + response.imag**2
    return gain


def _weakest(channel: Array, shapes: ComplexArray) -> Array:
    weakest: Array = np.min(_gain(channel, shapes), axis=-1)
    return weakest


def _easiest(floors: Floors, several: list[ComplexArray]) -> ComplexArray:
    """Return for every object that of several shapes whose floor takes the least power."""
    places = floors.places
    margin = np.stack(
        [np.min(_gain(places.channel, shapes) / places.loss, axis=-1) for shapes in several]
    )
    best = np.argmax(margin, axis=0)
    trials, objects = np.indices(best.shape)
    easiest: ComplexArray = np.stack(several)[best, trials, objects]
    return easiest


def _with_powers(
    floors: Floors, shapes: ComplexArray, wanted: Array
) -> tuple[ComplexArray, BoolArray]:
    """Return beams of shapes and powers near those wanted, and whether all floors are met."""
    power, feasible = floors.powers(floors.gains(shapes), wanted)
    made = normalised(np.sqrt(power)[..., None] * shapes)
    return made, feasible & floors.met(made).all(axis=-1)


def _scaled(floors: Floors, shapes: ComplexArray) -> tuple[ComplexArray, Array]:
    """Return beams that meet as large a part of all floors as these shapes can, and that part."""
    gains = floors.gains(shapes)
    low, high = np.zeros(len(gains)), np.ones(len(gains))
    best = np.zeros(floors.threshold.shape)
    nothing = np.zeros_like(best)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        share = _share(floors.threshold, middle)
        require = _Requirement(gains, floors.places.loss, share)
        least = require.least(nothing, nothing)
        fits = least.sum(axis=-1) <= 1.0
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        best = np.where(fits[:, None], least, best)
    return normalised(np.sqrt(best)[..., None] * shapes), low


def _share(threshold: Array, part: Array) -> Array:
    """Return 2^(part Gamma) - 1 from 2^Gamma - 1: floors of rates are scaled, not of SINRs."""
    scaled: Array = np.expm1(part[:, None] * np.log1p(threshold))
    return scaled
