"""Beliefs in, beams of the largest expected sum rate out: the door of this room."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from echobeam.beamforming.expected import starts
from echobeam.beamforming.expected.ascent import ascend
from echobeam.beamforming.expected.beliefs import BeliefBatch
from echobeam.beamforming.expected.caution import cautious, shared_out
from echobeam.beamforming.expected.directions import (
    Size,
    chirp,
    fine_nodes_of,
    floor_nodes,
    nodes_of,
    sizes_needed,
)
from echobeam.beamforming.expected.floors import Floors
from echobeam.beamforming.expected.keeping import keep_floors
from echobeam.beamforming.expected.objective import normalised, received
from echobeam.beamforming.expected.places import Places, places_at_nodes, places_of
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

PROBE = 3
"""Cycles after which the starts are compared, and one is climbed from to the end."""

FINALISTS = 2
"""Starts that are climbed from to the end."""

ALIKE = 1e-4
"""Relative difference of two starts' values that is not worth a second climb."""

HOPELESS = 0.2
"""Relative distance, after the first cycles, from the best value found that is given up."""

SLACK = 0.1
"""Relative excess of the outage, on nodes four times as close, that is put down to the nodes."""

SECOND = 0.1
"""Amplitude of the second polarisation that a climb begins with: at zero it would stay."""

SECOND_TURNS = np.array([1.0, -1.0])
"""Signs of its chirps along both axes of a belief: two alike would be one beam."""

CROWD = 8
"""Objects by whose multiples those that are served are brought together where there is room for
more, so that no trial depends on the others, not even in its last digits."""

TOGETHER = 400_000
"""Numbers in the channels at the nodes of the trials that are designed at a time."""


@dataclass(frozen=True, slots=True, eq=False)
class ExpectedAnswer:
    """Beams of T trials.

    Attributes
    ----------
    beams
        ``(T, K, N)`` complex, sqrt(power); zero for objects that are not served.
    expected_rate
        ``(T,)`` bit/s/Hz: the expected sum rate.
    fallback
        ``(T,)``: whether a floor is missed, or a belief makes no problem.
    messages
        Reasons, by trial.
    """

    beams: ComplexArray
    expected_rate: Array
    fallback: BoolArray
    messages: dict[int, str] = field(default_factory=dict)


def design_expected(beliefs: BeliefBatch) -> ExpectedAnswer:
    """Return the beams of the largest expected sum rate found, never worse than the starts.

    An object whose belief makes no problem (a lost track, say) gets no beam, and its trial is
    marked as a fallback; it does not stop the others.

    Parameters
    ----------
    beliefs
        Of T trials.
    """
    sound = beliefs.sound
    answer = ExpectedAnswer(
        beams=np.zeros((*sound.shape, beliefs.array.n), dtype=complex),
        expected_rate=np.zeros(len(beliefs)),
        fallback=np.asarray((beliefs.active & ~sound).any(axis=-1)),
    )
    for trial in np.flatnonzero(answer.fallback).tolist():
        answer.messages[trial] = "a belief is no number, or noise over gain is beyond 1e-24 to 1e24"
    for trials, columns in _crowds(beliefs, sound):
        _design_together(beliefs, sound, trials, columns, answer)
    return answer


def _crowds(beliefs: BeliefBatch, sound: BoolArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Give trials with about as many objects that are served, and the columns of these ``(T, J)``.

    A tracker of unlabelled detections has room for many more than there are.
    """
    count, room = sound.sum(axis=-1), sound.shape[1]
    width = np.full(count.size, room)
    if room > CROWD and (beliefs.min_rate == beliefs.min_rate[0]).all():
        width = np.minimum(-(-count // CROWD) * CROWD, room)
    order = np.argsort(~sound, axis=-1, kind="stable")
    for size in np.unique(width[count > 0]).tolist():
        trials = np.flatnonzero((width == size) & (count > 0))
        every = np.broadcast_to(np.arange(room), (trials.size, room))
        yield trials, every if size == room else order[trials, :size]


def _design_together(
    beliefs: BeliefBatch,
    sound: BoolArray,
    trials: IntArray,
    columns: IntArray,
    answer: ExpectedAnswer,
) -> None:
    """Put the beams of some trials into the answer, of some columns ``(T, J)`` of each."""
    whole = beliefs.taken(trials)
    if columns.shape[1] < sound.shape[1]:
        whole = whole.arranged(columns)
    there = np.take_along_axis(sound[trials], columns, axis=1)
    count = sizes_needed(whole, there)
    for size in map(tuple, np.unique(count, axis=0).tolist()):
        which = np.flatnonzero((count == size).all(axis=-1))
        many = max(TOGETHER // (math.prod(size) * there.shape[1] * beliefs.array.elements), 1)
        for begin in range(0, which.size, many):
            part = which[begin : begin + many]
            taken = whole.taken(part)
            places = places_at_nodes(taken, there[part], size)
            dimensions = places.dimensions
            for width in np.unique(dimensions).tolist():
                alike = np.flatnonzero(dimensions == width)
                few, some = places.taken(alike).narrowed(width), part[alike]
                where = trials[some], columns[some]
                _design_alike(few, taken.taken(alike), size, where, answer)


def _design_alike(
    places: Places,
    beliefs: BeliefBatch,
    size: Size,
    where: tuple[IntArray, IntArray],
    answer: ExpectedAnswer,
) -> None:
    """Put the beams of some trials, of one number of nodes and coordinates, into the answer.

    ``where`` are their indices ``(T,)``, and their objects' columns ``(T, J)``.
    """
    trials, columns = where
    if beliefs.least_snr > 0.0:
        aimed = cautious(places, beliefs.least_snr)
        beams = shared_out(places, _climbed(aimed, beliefs, size))
    else:
        beams = _climbed(places, beliefs, size)
    floored = None
    if (beliefs.min_rate > 0.0).any():
        beams, missed, floored = _with_floors(places, beliefs, size, beams)
        for trial, words in missed.items():
            answer.fallback[trials[trial]] = True
            answer.messages[int(trials[trial])] = words
    if beliefs.array.polarisations > 1 and set(size) != {1} and not beliefs.least_snr > 0.0:
        beams = _with_both(places, beliefs, size, beams, floored)
    made = places.beams(beams, beliefs.power)
    answer.beams[trials[:, None], columns, : made.shape[-1]] = made
    answer.expected_rate[trials] = received(places, beams).value / np.log(2.0)


def _with_both(
    places: Places, beliefs: BeliefBatch, size: Size, beams: ComplexArray, floored: Floors | None
) -> ComplexArray:
    """Return beams ``(T, 2 K, r)`` in two polarisations where they are better, and keep the floors.

    Climbed to from the beams given with a weak second one, and from two that are spread over the
    belief in different ways.
    """
    z, _ = nodes_of(size)
    turns = chirp(beliefs, places.active)
    first = starts.spread_shapes(places, z, turns)
    second = starts.spread_shapes(places, z, turns * SECOND_TURNS)
    strength = np.sqrt(np.sum(np.abs(beams) ** 2, axis=-1, keepdims=True))
    best = starts.paired(beams, np.zeros_like(beams))
    value = received(places, best).value
    pairs = [(beams, SECOND * strength * second), (strength * first, strength * second)]
    for pair in pairs:
        made = ascend(places, starts.paired(*pair))
        better = made.value > value
        if floored is not None:
            better &= floored.met(best).all(axis=-1) & floored.met(made.beams).all(axis=-1)
        best = np.where(better[:, None, None], made.beams, best)
        value = np.where(better, made.value, value)
    return best


def _with_floors(
    places: Places, beliefs: BeliefBatch, size: Size, beams: ComplexArray
) -> tuple[ComplexArray, dict[int, str], Floors]:
    """Return beams that meet the floors, as far as they were found, words where not, and floors."""
    z = floor_nodes(beliefs.outage, size)
    inner = places_of(beliefs, places.active, z, np.full(len(z), 1.0 / len(z)), places.basis)
    threshold = np.where(places.active, np.expm1(np.log(2.0) * beliefs.min_rate), 0.0)
    floors = Floors(inner, threshold)
    words: dict[int, str] = {}
    which = np.flatnonzero(~floors.met(beams).all(axis=-1))
    if which.size:
        kept = keep_floors(places.taken(which), floors.taken(which), beams[which])
        beams = beams.copy()
        beams[which] = kept.beams
        for place in np.flatnonzero(~kept.feasible):
            words[int(which[place])] = (
                "no beams were found that meet the rate floors with probability "
                f"{1.0 - beliefs.outage:.6g}; these are for floors scaled by {kept.part[place]:.4g}"
            )
    z, weight = fine_nodes_of(size)
    met = Floors(places_of(beliefs, places.active, z, weight, places.basis), threshold)
    chance = met.probability(beams)
    least = np.min(np.where(places.active, chance, 1.0), axis=-1, initial=1.0)
    for trial in np.flatnonzero(least < 1.0 - beliefs.outage * (1.0 + SLACK)).tolist():
        if trial not in words:
            words[trial] = f"a rate floor is met with probability {least[trial]:.3g} only"
    return beams, words, floors


def _climbed(places: Places, beliefs: BeliefBatch, size: Size) -> ComplexArray:
    """Return beams ``(T, K, r)``: the best that climbs from the starts lead to.

    All starts are climbed from for a few cycles, the best `FINALISTS` of different value to the
    end.
    """
    tried = starting_beams(places, beliefs, size)
    if len(tried) == 1:
        return ascend(places, tried[0]).beams
    probed = [ascend(places, beams, PROBE) for beams in tried]
    value = np.stack([each.value for each in probed])
    beams = np.stack([each.beams for each in probed])
    every = np.arange(len(places))
    best = np.argmax(value, axis=0)
    reached = ascend(places, beams[best, every])
    found, highest = reached.beams, reached.value
    for _ in range(FINALISTS - 1):
        value = np.where(value > value[best, every] * (1.0 - ALIKE), -np.inf, value)
        best = np.argmax(value, axis=0)
        left = np.flatnonzero(value[best, every] > highest * (1.0 - HOPELESS))
        if left.size == 0:
            break
        again = ascend(places.taken(left), beams[best[left], left])
        better = again.value > highest[left]
        found[left] = np.where(better[:, None, None], again.beams, found[left])
        highest[left] = np.where(better, again.value, highest[left])
    if places.active.shape[1] > 2:
        again = ascend(places, _without_the_weakest(places, found))
        better = again.value > highest
        found = np.where(better[:, None, None], again.beams, found)
    return found


def _without_the_weakest(places: Places, beams: ComplexArray) -> ComplexArray:
    """Return the beams but that of the object with the smallest rate of those with power."""
    at = received(places, beams)
    rate = np.sum(places.weight * np.log1p(at.own / at.noise), axis=-1)
    served = np.any(beams != 0.0, axis=-1)
    weakest = np.argmin(np.where(served, rate, np.inf), axis=-1)
    others = np.arange(rate.shape[1]) != weakest[:, None]
    left: ComplexArray = np.where(others[..., None], beams, 0.0)
    return normalised(left)


def starting_beams(places: Places, beliefs: BeliefBatch, size: Size) -> list[ComplexArray]:
    """Return beams ``(T, K, r)`` to climb from; where none are given, matched ones stand in."""
    matched = starts.filled(places, starts.unit(places.centre.astype(complex)))
    several = places.active.shape[1] > 1
    if set(size) == {1}:
        tried = [matched]
        shapes = starts.unit(places.centre.astype(complex))
    else:
        z, _ = nodes_of(size)
        shapes = starts.principal_shapes(places)
        spread = starts.spread_shapes(places, z, chirp(beliefs, places.active))
        tried = [matched, starts.filled(places, shapes), starts.filled(places, spread)]
        if several:
            tried.append(starts.alone(places, spread))
    if several:
        tried += [starts.equal(places, shapes), starts.alone(places, shapes)]
    if places.active.shape[1] > 2:
        tried.append(starts.chosen(places, shapes))
    if beliefs.warm_start is not None:
        warm = beliefs.warm_start[..., : beliefs.array.elements]
        tried.append(_given(places, warm, matched))
    return tried


def _given(places: Places, warm: ComplexArray, matched: ComplexArray) -> ComplexArray:
    """Return the beams given, matched ones in trials where some are missing."""
    there = (np.isfinite(warm).all(axis=-1) | ~places.active).all(axis=-1)
    clean = np.where(places.active[..., None] & np.isfinite(warm), warm, 0.0)
    inside = normalised(places.coordinates(clean))
    there &= received(places, inside).value > 0.0
    return np.where(there[:, None, None], inside, matched)
