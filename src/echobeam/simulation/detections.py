"""Unlabelled detections of one slot: found, missed and false ones, in the order of their delays.

Under the bound an object is detected with the probability of its echo's SNR and measured with the
variance of the bound; false detections of noise and clutter are uniform over what is searched. A
receiver that processes the signal finds, misses and mistakes echoes by itself.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.detection import DetectionLaw
from echobeam.physics.fluctuation import STEADY
from echobeam.schemes.base import Decision
from echobeam.schemes.configure import detection_of
from echobeam.sensing.directions import angle_of, mirrored
from echobeam.simulation.randomness import Use, object_normals, trial_normals
from echobeam.simulation.sensor import fluctuation
from echobeam.simulation.signal_sensor import detect_in_signal
from echobeam.simulation.world import World
from echobeam.values import NOBODY, Array, BoolArray, Detections, IntArray, freeze

RAREST = 1e-9
"""Probability that a slot has more false detections than columns for them."""


class Sensed(NamedTuple):
    """Echoes of a slot by object, for the record: ``(T, K)`` and ``(T, K, M)``.

    Attributes
    ----------
    snr
        Of each object's echo.
    measured, measured_var
        The measurement and the variance stated with it; NaN and infinite without one.
    true_var
        The variance with which nature drew it.
    """

    snr: Array
    measured: Array
    measured_var: Array
    true_var: Array


def detect(world: World, decision: Decision) -> tuple[Detections, Sensed]:
    """Return the detections of the trials in which the radar receives.

    Their variance is the law at the measured place, or at the true one where
    ``radar.variance = "known"``; that of a false detection is drawn as if it were an object's, so
    that it does not give it away.
    """
    receives = np.asarray(decision.sensed.any(axis=-1))
    if world.scene.scenario.radar.model == "signal":
        return _of_signal(world, decision, receives)
    return _at_bound(world, decision, receives)


def _at_bound(world: World, decision: Decision, receives: BoolArray) -> tuple[Detections, Sensed]:
    """Return Gaussian measurements of what is detected, and false detections."""
    scenario, law, sent = world.scene.scenario, world.scene.law, decision.sent
    seen = detection_of(scenario)
    draws = (world.seed, world.trials, world.slot)
    geometry, here = world.scene.geometry, world.place
    shape = (len(world.trials), *here.shape[1:])
    place = np.broadcast_to(here, shape)
    amplitude = fluctuation(world)
    with np.errstate(invalid="ignore"):
        snr = law.snr(sent, place) * np.abs(amplitude) ** 2
    # The echo's strength is drawn: its probability is that of a constant one of this strength.
    constant = replace(seen, fluctuation=STEADY)
    probability = constant.probability(np.nan_to_num(snr, nan=0.0))
    luck = _uniform(object_normals(*draws, Use.DETECTION, world.identity, 1)[..., 0])
    truth = world.ideal()
    delay, doppler = truth[..., geometry.axes], truth[..., geometry.axes + 1]
    inside = (delay < seen.longest) & (np.abs(doppler) < seen.widest)
    found = world.present & inside & (luck < probability) & receives[:, None]
    variance = law.variance(sent, place, snr)
    found &= np.isfinite(variance).all(axis=-1)
    normals = object_normals(*draws, Use.MEASUREMENT, world.identity, variance.shape[-1])
    noise = np.sqrt(np.where(found[..., None], variance, 0.0)) * normals
    value = np.where(found[..., None], truth + noise, np.nan)
    variance = np.where(found[..., None], variance, np.inf)
    false, more = _false(world, seen, receives)
    everything = np.concatenate([_folded(value, seen), false], axis=1)
    own_strength = np.broadcast_to(np.abs(amplitude) ** 2, shape[:2])
    strength = _exceeding(seen, law.snr(sent, geometry.measured_place(false)), more[..., 0])
    strength = np.concatenate([own_strength, strength], axis=1)
    stated = _law_at(world, decision, everything, strength)
    if scenario.radar.variance == "known":
        objects = found.shape[1]
        off = np.where(np.isfinite(false), np.sqrt(stated[:, objects:]) * more[..., 1:], np.nan)
        stated[:, :objects] = variance
        stated[:, objects:] = _law_at(world, decision, false - off, strength[:, objects:])
    own = np.where(found[..., None], stated[:, : found.shape[1]], np.inf)
    return in_order(everything, stated), Sensed(snr, value, own, variance)


def _exceeding(law: DetectionLaw, snr: Array, luck: Array) -> Array:
    """Return strengths over the mean ``(T, F)`` of echoes that exceed the threshold.

    The receiver sees the strength of an echo, and cannot take a false one for an exception.

    Parameters
    ----------
    law
        Of the detection; strengths are 1 unless echoes fluctuate.
    snr
        ``(T, F)``: mean of an echo there, of one antenna.
    luck
        ``(T, F)``: standard normals.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        least = -np.log(law.false_alarm) / (law.receiver.elements * snr)
    return law.fluctuation.beyond(least, luck)


def _law_at(world: World, decision: Decision, value: Array, strength: Array) -> Array:
    """Return the law of the variance of measurements ``(T, D, M)``; infinite where NaN."""
    law, sent = world.scene.law, decision.sent
    place = world.scene.geometry.measured_place(value)
    with np.errstate(all="ignore"):
        snr = law.snr(sent, place) * strength
        variance = law.variance(sent, place, snr)
    there = np.isfinite(value[..., 0]) & np.isfinite(variance).all(axis=-1)
    return np.where(there[..., None], variance, np.inf)


def _folded(value: Array, law: DetectionLaw) -> Array:
    """Return measurements of which a vertical array gives the angle below 90 degrees."""
    if not isinstance(law.receiver, LinearArray):
        return value
    angle = mirrored(law.receiver, value[..., 0], np.zeros(1))
    return np.concatenate([angle[..., None], value[..., 1:]], axis=-1)


def _false(world: World, law: DetectionLaw, receives: BoolArray) -> tuple[Array, Array]:
    """Return false detections ``(T, F, M)``, uniform over what is searched; NaN for none.

    Their number is drawn from Poisson's law. The second are standard normals ``(T, F, M + 1)`` for
    what else is drawn of each.
    """
    from scipy.stats import poisson

    mean, size = law.mean_false, law.receiver.axes + 2
    most = _most(mean)
    each = 1 + (2 * size + 1) * most
    draws = trial_normals(world.seed, world.trials, world.slot, Use.FALSE_ALARM, (each,))
    uniform = _uniform(draws[:, : 1 + size * most])
    count = poisson.ppf(uniform[:, 0], mean) if mean > 0.0 else np.zeros(len(draws))
    place = uniform[:, 1:].reshape(len(draws), most, size)
    value = np.stack(
        [
            *_directions(law, place),
            law.longest * place[..., -2],
            law.widest * (2.0 * place[..., -1] - 1.0),
        ],
        axis=-1,
    )
    there = (np.arange(most) < count[:, None]) & receives[:, None]
    more = draws[:, 1 + size * most :].reshape(len(draws), most, size + 1)
    return np.where(there[..., None], value, np.nan), more


def _directions(law: DetectionLaw, uniform: Array) -> list[Array]:
    """Return components of directions that are uniform over what the array tells apart."""
    if isinstance(law.receiver, LinearArray):
        low, high = law.directions
        return [angle_of(law.receiver, low + (high - low) * uniform[..., 0])]
    radius, turn = np.sqrt(uniform[..., 0]), 2.0 * np.pi * uniform[..., 1]
    return [radius * np.cos(turn), radius * np.sin(turn)]


@cache
def _most(mean: float) -> int:
    """Return the columns that false detections of a mean number need, see `RAREST`."""
    from scipy.stats import poisson

    return int(poisson.isf(RAREST, mean)) if mean > 0.0 else 0


def _uniform(normals: Array) -> Array:
    from scipy.special import ndtr

    uniform: Array = ndtr(normals)
    return uniform


def in_order(value: Array, variance: Array) -> Detections:
    """Return detections ``(T, D)`` in the order of their delays, which says nothing of whose.

    Those that are none, NaN or of infinite variance, are last, and as many columns are left out as
    no trial needs.
    """
    valid = np.isfinite(value).all(axis=-1) & np.isfinite(variance).all(axis=-1)
    order: IntArray = np.argsort(np.where(valid, value[..., -2], np.inf), axis=-1, kind="stable")
    order = order[:, : int(valid.sum(axis=-1).max(initial=0))]
    valid = np.take_along_axis(valid, order, axis=-1)
    value = np.take_along_axis(value, order[..., None], axis=-2)
    variance = np.take_along_axis(variance, order[..., None], axis=-2)
    value = np.where(valid[..., None], value, np.nan)
    variance = np.where(valid[..., None], variance, np.inf)
    label = np.full(valid.shape, NOBODY)
    freeze(value, variance, valid, label)
    return Detections(value, variance, valid, label)


def _of_signal(world: World, decision: Decision, receives: BoolArray) -> tuple[Detections, Sensed]:
    """Return the echoes that the receiver finds, and which of them are the objects'."""
    law, sent = world.scene.law, decision.sent
    amplitude = fluctuation(world)
    with np.errstate(invalid="ignore"):
        snr = law.snr(sent, world.place) * np.abs(amplitude) ** 2
    found, value, reported = detect_in_signal(world, sent, amplitude, receives)
    valid = found.valid & receives[:, None]
    angle = found.angle[..., None] if law.receiver.axes == 1 else found.angle
    others = np.stack([found.delay, found.doppler], axis=-1)
    every = np.concatenate([angle, others], axis=-1)
    every = np.where(valid[..., None], every, np.nan)
    stated = np.where(valid[..., None], found.variance, np.inf)
    variance = np.where(np.isfinite(value), law.variance(sent, world.place, snr), np.inf)
    return in_order(every, stated), Sensed(snr, value, reported, variance)
