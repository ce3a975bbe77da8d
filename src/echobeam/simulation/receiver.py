"""Receiver of the UAV: the detections that a scheme gets, with the variance that it can know."""

from __future__ import annotations

from typing import Literal

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.coordinates import Geometry
from echobeam.sensing.directions import mirrored
from echobeam.simulation.scene import Scene
from echobeam.simulation.sensor import Echoes
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    Detections,
    IntArray,
    Tracks,
    Transmission,
    UavState,
    freeze,
)

Knowledge = Literal["predicted", "known"]


def receive(
    echoes: Echoes,
    identity: IntArray,
    prior: Tracks,
    sent: Transmission,
    scene: Scene,
    uav: UavState,
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
    scene
        Its law of the variance and its geometry, which the UAV knows.
    uav
        The UAV in the slot.
    knowledge
        ``"predicted"``: the variance given is the law at the scheme's own prediction, at the
        measured angle and distance where it has none; ``"known"``: it is that at the true state.
    """
    law = scene.law
    label = np.broadcast_to(identity, echoes.snr.shape)
    measured = np.isfinite(echoes.variance)
    value = echoes.value
    if echoes.reported is not None:
        variance = np.where(measured, echoes.reported, np.inf)
        if isinstance(law.receiver, LinearArray):
            mean = by_identity(prior, label, prior.mean)
            angle = mirrored(law.receiver, value[..., 0], mean[..., 0])
            value = np.concatenate([angle[..., None], value[..., 1:]], axis=-1)
    elif knowledge == "known" or not measured.any():
        variance = echoes.variance
    else:
        here = expected_place(echoes.value, prior, label, scene.geometry, uav)
        snr = law.snr(sent, here) * echoes.strength
        variance = np.where(measured, law.variance(sent, here, snr), np.inf)
    valid = np.asarray(measured.any(axis=-1))
    freeze(value, variance, valid)
    return Detections(value, variance, valid, label)


def expected_place(
    value: Array, prior: Tracks, label: IntArray, geometry: Geometry, uav: UavState
) -> Array:
    """Return the place of each object, ``(T, K, A + 1)`` or more: predicted, else just measured."""
    mean, known = by_identity(prior, label, prior.mean), by_identity(prior, label, prior.known)
    predicted: BoolArray = np.asarray(known == 1)
    measured = geometry.measured_place(value)
    return np.where(predicted[..., None], geometry.place(mean, uav), measured)


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
