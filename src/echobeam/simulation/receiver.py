"""Receiver of the UAV: the detections that a scheme gets, with the variance that it can know."""

from __future__ import annotations

from typing import Literal

import numpy as np

from echobeam.physics.measurement import measured_place
from echobeam.physics.variance_law import VarianceLaw
from echobeam.sensing.directions import mirrored
from echobeam.simulation.sensor import Echoes
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    Detections,
    IntArray,
    Tracks,
    Transmission,
    freeze,
)

Knowledge = Literal["predicted", "known"]


def receive(
    echoes: Echoes,
    identity: IntArray,
    prior: Tracks,
    sent: Transmission,
    law: VarianceLaw,
    knowledge: Knowledge,
) -> Detections:
    """Return labelled detections, in the order of the objects.

    Parameters
    ----------
    echoes
        Measurements as nature drew them.
    identity
        ``(K,)``: labels.
    prior
        The scheme's prediction of this slot.
    sent
        The scheme's transmission.
    law
        Law of the variance, which the UAV knows.
    knowledge
        ``"predicted"``: the variance given is the law at the scheme's own prediction, at the
        measured angle and distance where it has none; ``"known"``: it is that at the true state.
    """
    label = np.broadcast_to(identity, echoes.snr.shape)
    measured = np.isfinite(echoes.variance)
    value = echoes.value
    if echoes.reported is not None:
        variance = np.where(measured, echoes.reported, np.inf)
        mean = by_identity(prior, label, prior.mean)
        angle = mirrored(law.receiver, value[..., 0], mean[..., 0])
        value = np.concatenate([angle[..., None], value[..., 1:]], axis=-1)
    elif knowledge == "known" or not measured.any():
        variance = echoes.variance
    else:
        here = expected_state(echoes.value, prior, label)
        snr = law.snr(sent, here) * echoes.strength
        variance = np.where(measured, law.variance(sent, here, snr), np.inf)
    valid = np.asarray(measured.any(axis=-1))
    freeze(value, variance, valid)
    return Detections(value, variance, valid, label)


def expected_state(value: Array, prior: Tracks, label: IntArray) -> Array:
    """Return where each object is thought to be, ``(T, K, S)``: predicted, else just measured."""
    mean, known = by_identity(prior, label, prior.mean), by_identity(prior, label, prior.known)
    predicted: BoolArray = np.asarray(known == 1)
    return np.where(predicted[..., None], mean, measured_place(value))


def by_identity(tracks: Tracks, label: IntArray, values: Array | BoolArray) -> Array:
    """Return an array of tracks ``(T, C, ...)`` in the order of some identities ``(T, K)``.

    NaN where an identity has no track.
    """
    numbers = np.asarray(values, dtype=np.float64)
    if tracks.id.shape == label.shape and np.array_equal(tracks.id, label):
        return numbers
    trailing = (1,) * (numbers.ndim - 2)
    if tracks.id.shape[-1] == 0:
        return np.full((*label.shape, *numbers.shape[2:]), np.nan)
    match = (tracks.id[:, None, :] == label[..., None]) & (label != NOBODY)[..., None]
    place = np.argmax(match, axis=-1).reshape(*label.shape, *trailing)
    found = match.any(axis=-1).reshape(*label.shape, *trailing)
    return np.where(found, np.take_along_axis(numbers, place, axis=1), np.nan)
