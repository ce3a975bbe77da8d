"""Beams that meet rate floors (38e) and lose little of the expected sum rate.

Shapes come from the climb without floors, from the principal beams, and from a flat beam for each
object; powers from `floors`. What is feasible is then climbed on, as far as the floors permit. If
nothing is feasible, all floors are scaled by one factor, as in problem (38).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.expected import starts
from echobeam.beamforming.expected.ascent import ascend, step
from echobeam.beamforming.expected.floors import Floors, Requirement
from echobeam.beamforming.expected.objective import normalised, received
from echobeam.beamforming.expected.places import Places
from echobeam.values import Array, BoolArray, ComplexArray

HALVINGS = 20
"""Bisections of the factor that scales floors out of reach."""

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

NARROW = 12
"""Nodes of a floor up to which the principal beam is flat enough."""

CLEAR = 1e-3
"""Noise over what a flat shape is designed with: the climb then sees logarithms of the gain."""


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """Beams ``(T, K, r)``, whether they keep all floors, and the part of the floors asked for."""

    beams: ComplexArray
    feasible: BoolArray
    part: Array


def keep_floors(places: Places, floors: Floors, beams: ComplexArray) -> Kept:
    """Return beams that meet the floors (38e) and lose little of the expected sum rate.

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
    several = [np.where(short[..., None], easy, free)]
    if floors.places.loss.shape[-1] > NARROW:
        several += [free, easy]
    for shapes in several:
        made, feasible = _with_powers(floors, shapes, power)
        reached = np.where(feasible, received(places, made).value, -np.inf)
        better = reached > value
        best = np.where(better[:, None, None], made, best)
        value = np.where(better, reached, value)
    feasible = np.isfinite(value)
    best = _polished(places, floors, best, value)
    part = np.ones(len(places))
    short_of = np.flatnonzero(~feasible)
    if short_of.size:
        best[short_of], part[short_of] = _scaled(floors.taken(short_of), easy[short_of])
    return Kept(best, feasible, part)


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
    if count <= NARROW:
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
        require = Requirement.of(gains, floors.places.loss, share)
        least = require.least(nothing, nothing)
        fits = least.sum(axis=-1) <= 1.0
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        best = np.where(fits[:, None], least, best)
    return normalised(np.sqrt(best)[..., None] * shapes), low


def _share(threshold: Array, part: Array) -> Array:
    """Return 2^(part Gamma) - 1 from 2^Gamma - 1: floors of rates are scaled, not of SINRs."""
    scaled: Array = np.expm1(part[:, None] * np.log1p(threshold))
    return scaled
