"""The expected sum rate of beams, and what a step towards a larger one needs to know of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.expected.places import Places
from echobeam.values import Array, BoolArray, ComplexArray


@dataclass(frozen=True, slots=True, eq=False)
class Received:
    """Figures of beams of unit total power at the nodes.

    Attributes
    ----------
    response
        ``(T, K, P, Q)`` complex: c(theta_kq)^T w_kp, of the object's own beam in P polarisations.
    own, noise
        ``(T, K, Q)``: its power, that of all polarisations, and the power of noise and of all
        other beams.
    value
        ``(T,)`` nats: sum over k of E[log(1 + SINR_k)].
    """

    response: ComplexArray
    own: Array
    noise: Array
    value: Array

    def where(self, better: BoolArray, other: Received) -> Received:
        """Return this where ``better``, ``(T,)``, and the other elsewhere."""
        each = better[:, None, None]
        return Received(
            np.where(each[..., None], self.response, other.response),
            np.where(each, self.own, other.own),
            np.where(each, self.noise, other.noise),
            np.where(better, self.value, other.value),
        )


def received(places: Places, beams: ComplexArray) -> Received:
    """Return what beams give at the nodes, Eqs. (10), (50), and their expected sum rate.

    Parameters
    ----------
    places
        Of T trials.
    beams
        ``(T, P K, r)`` in the basis, total power 1 for each trial: the P polarisations of an
        object's beam one after the other.
    """
    trials, objects, count, size = places.channel.shape
    columns = beams.shape[1]
    sides = np.concatenate([beams.real, beams.imag], axis=1)
    flat = places.channel.reshape(trials, objects * count, size) @ np.swapaxes(sides, -1, -2)
    both = flat.reshape(trials, objects, count, 2, columns)
    power = both[..., 0, :] ** 2 + both[..., 1, :] ** 2
    which = np.arange(objects)
    own_parts = both.reshape(trials, objects, count, 2, objects, -1)[:, which, :, :, which]
    own_parts = np.moveaxis(own_parts, (0, -1), (1, 2))  # (T, K, P, Q, 2)
    response = own_parts[..., 0] + 1j * own_parts[..., 1]
    each = power.reshape(trials, objects, count, objects, -1)
    own = np.moveaxis(each[:, which, :, which], 0, 1).sum(axis=-1)
    each[:, which, :, which] = 0.0  # not the total less the own: that would cancel
    noise = power.sum(axis=-1) + places.loss
    value = np.sum(places.weight * np.log1p(own / noise), axis=(-2, -1))
    return Received(response, own, noise, value)


def normalised(beams: ComplexArray) -> ComplexArray:
    """Return beams ``(T, P K, r)`` of total power 1; zero ones stay zero."""
    largest = np.max(np.abs(beams), axis=(-2, -1), keepdims=True, initial=0.0)
    level = beams / np.where(largest > 0.0, largest, 1.0)  # squares of tiny ones would vanish
    norm = np.sqrt(np.sum(level.real**2 + level.imag**2, axis=(-2, -1), keepdims=True))
    unit: ComplexArray = level / np.where(norm > 0.0, norm, 1.0)
    return unit
