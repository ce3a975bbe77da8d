"""Beams to climb from: matched, principal, spread over the belief, of one object alone.

Real beams stay real in a climb (`places` has real coordinates), and a real pattern over a wide
belief has zeros; so one of the starts has a quadratic phase, which spreads a beam over the belief.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.expected.objective import normalised
from echobeam.beamforming.expected.places import Places
from echobeam.values import Array, BoolArray, ComplexArray


def gain_over_loss(places: Places, shapes: ComplexArray) -> Array:
    """Return ``(T, K)``: E[|c^T w|^2 / loss] of unit beams ``(T, K, r)``, no interference."""
    response = (places.channel @ shapes[..., None])[..., 0]
    gain: Array = np.sum(
        places.weight * (response.real**2 + response.imag**2) / places.loss, axis=-1
    )
    return gain


def principal_shapes(places: Places) -> ComplexArray:
    """Return ``(T, K, r)``: the unit beams of largest E[|c^T w|^2 / loss].

    They are the principal eigenvectors of E[c c^T / loss], and the optimum at low SNR of one
    object. Few nodes have a smaller matrix of products among themselves.
    """
    weight = np.sqrt(places.weight / places.loss)
    largest = np.max(weight, axis=-1, keepdims=True)
    rows = places.channel * (weight / np.where(largest > 0.0, largest, 1.0))[..., None]
    columns = np.swapaxes(rows, -1, -2)
    if rows.shape[-2] < rows.shape[-1]:
        _, vectors = np.linalg.eigh(rows @ columns)
        shapes = (columns @ vectors[..., -1:])[..., 0]
    else:
        shapes = np.linalg.eigh(columns @ rows)[1][..., -1]
    return unit(shapes.astype(complex))


def spread_shapes(places: Places, z: Array, chirp: Array) -> ComplexArray:
    """Return ``(T, K, r)``: unit beams sum_q p_q exp(j chirp z_q^2 / 2) c_q.

    The phases of several axes add up.

    Parameters
    ----------
    places
        Of T trials.
    z
        ``(Q,)`` or ``(Q, A)``: the nodes.
    chirp
        ``(T, K, A)``, see `directions.chirp`.
    """
    line = z.reshape(len(z), -1)
    phase: Array = np.sum(chirp[..., None, :] * line * line, axis=-1)
    turned = places.weight * np.exp(0.5j * phase)
    shapes: ComplexArray = (turned[..., None, :] @ places.channel)[..., 0, :]
    return unit(shapes)


def paired(first: ComplexArray, second: ComplexArray) -> ComplexArray:
    """Return beams ``(T, 2 K, r)`` of two polarisations, ``(T, K, r)`` each; total power 1."""
    trials, objects, size = first.shape
    return normalised(np.stack([first, second], axis=2).reshape(trials, 2 * objects, size))


def unit(shapes: ComplexArray) -> ComplexArray:
    """Return every beam ``(..., r)`` with norm one; zero ones stay zero."""
    norm = np.sqrt(np.sum(shapes.real**2 + shapes.imag**2, axis=-1, keepdims=True))
    scaled: ComplexArray = shapes / np.where(norm > 0.0, norm, 1.0)
    return scaled


def filled(places: Places, shapes: ComplexArray) -> ComplexArray:
    """Return beams of shapes ``(T, K, r)`` with water-filling powers over the expected gains."""
    gain = gain_over_loss(places, shapes)
    beams: ComplexArray = np.sqrt(pour(gain, places.active))[..., None] * shapes
    return beams


def equal(places: Places, shapes: ComplexArray) -> ComplexArray:
    """Return beams of shapes ``(T, K, r)`` with equal powers."""
    many = np.maximum(places.active.sum(axis=-1, keepdims=True), 1)
    beams: ComplexArray = np.sqrt(places.active / many)[..., None] * shapes
    return beams


def alone(places: Places, shapes: ComplexArray) -> ComplexArray:
    """Return the beam of the best object alone, with all the power: none interferes."""
    gain = np.where(places.active, gain_over_loss(places, shapes), -np.inf)
    best = np.arange(gain.shape[-1]) == np.argmax(gain, axis=-1)[:, None]
    return np.where((best & places.active)[..., None], shapes, 0.0)


def chosen(places: Places, shapes: ComplexArray) -> ComplexArray:
    """Return equal beams of objects that disturb each other little, zero for the others.

    Objects are taken one after the other, that with the largest gain next which is left off the
    span of those before (semi-orthogonal selection, Yoo and Goldsmith, IEEE J. Sel. Areas Commun.
    24, 2006), as many as make the sum of log(1 + gain / number) largest.
    """
    trials, objects, size = shapes.shape
    every = np.arange(trials)
    gain = gain_over_loss(places, shapes)
    left, taken = shapes.copy(), ~places.active
    kept: list[Array] = []
    masks, sums = [places.active & False], [np.zeros(trials)]
    for _ in range(min(objects, size)):
        off = np.sum(left.real**2 + left.imag**2, axis=-1)
        reach = np.where(taken, -1.0, gain * off)
        best = np.argmax(reach, axis=-1)
        kept.append(np.maximum(reach[every, best], 0.0))
        taken = taken.copy()
        taken[every, best] = True
        masks.append(taken & places.active)
        sums.append(np.sum(np.log1p(np.stack(kept) / len(kept)), axis=0))
        axis = unit(left[every, best])
        along = (left @ axis.conj()[..., None])[..., 0]
        left = left - along[..., None] * axis[:, None]
    most = np.argmax(np.stack(sums), axis=0)
    mask = np.stack(masks)[most, every]
    many = np.maximum(mask.sum(axis=-1, keepdims=True), 1)
    beams: ComplexArray = np.sqrt(mask / many)[..., None] * shapes
    return beams


def pour(gain: Array, active: BoolArray) -> Array:
    """Return water-filling powers ``(T, K)`` of unit sum, max(0, level - 1 / gain).

    Counted from the lowest ground: where noise is many times the power, digits would be lost.
    """
    with np.errstate(divide="ignore"):
        ground = np.where(active & (gain > 0.0), 1.0 / gain, np.inf)
    lowest = np.min(ground, axis=-1, keepdims=True, initial=np.inf)
    height = ground - np.where(np.isfinite(lowest), lowest, 0.0)
    order = np.sort(height, axis=-1)
    finite = np.isfinite(order)
    count = np.arange(1, order.shape[-1] + 1)
    level = (1.0 + np.cumsum(np.where(finite, order, 0.0), axis=-1)) / count
    wet = (finite & (level > np.where(finite, order, np.inf))).sum(axis=-1, keepdims=True)
    surface = np.take_along_axis(level, np.maximum(wet - 1, 0), axis=-1)
    powers: Array = np.where(np.isfinite(height), np.maximum(surface - height, 0.0), 0.0)
    return powers
