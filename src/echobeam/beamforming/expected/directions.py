"""Directions of a belief around its mean: one angle, or two direction cosines.

One angle has a deviation. Two cosines have a covariance, and along its principal axes they are
independent: an expectation is a sum over the product of two rules, each with as many nodes as the
beams' width asks for along its axis. Under one standard deviation f along an axis the fastest term
of a beam of ``rows x columns`` elements turns by

    omega = 2 pi spacing ((rows - 1) |f_u| + (columns - 1) |f_v|).

A cosine beyond the visible region, u^2 + v^2 > 1, is no direction; such nodes have no weight.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import ndtri

from echobeam.beamforming.expected.beliefs import BeliefBatch
from echobeam.beamforming.expected.quadrature import (
    fine_rule,
    interval,
    nodes_needed,
    rule,
    sizes_of,
)
from echobeam.physics.array import LinearArray
from echobeam.values import Array, BoolArray, IntArray, aligned

Size = tuple[int, ...]
"""Numbers of nodes along the axes of a belief."""

COVERED = 1.75
"""Standard deviations over which the outermost antennas of a spread beam point."""

EDGE = 12
"""Points of the edge of a floor's ellipse."""


def where(mask: BoolArray, values: Array) -> Array:
    """Return values ``(T, K, ...)`` where a mask ``(T, K)`` is true, and zero elsewhere."""
    return np.where(aligned(mask, values), values, 0.0)


def sizes_needed(beliefs: BeliefBatch, sound: BoolArray) -> IntArray:
    """Return the numbers of nodes ``(T, A)`` that the widest belief of each trial needs.

    Parameters
    ----------
    beliefs
        Of T trials.
    sound
        ``(T, K)``: the objects that count.
    """
    deviation, mean = where(sound, beliefs.deviation), where(sound, beliefs.angles)
    if isinstance(beliefs.array, LinearArray):
        return nodes_needed(mean, deviation, beliefs.array)[:, None]
    elements = np.array(beliefs.array.shape) - 1.0
    turns = np.pi * 2.0 * beliefs.array.spacing * (np.abs(deviation) @ elements)  # (T, K, A)
    widest = np.max(np.abs(deviation), axis=(1, 3), initial=0.0)
    return sizes_of(np.max(turns, axis=1, initial=0.0), widest, few=True)


@cache
def nodes_of(size: Size) -> tuple[Array, Array]:
    """Return nodes z ``(Q,)`` or ``(Q, 2)``, and weights ``(Q,)``, of an expectation.

    Parameters
    ----------
    size
        Nodes along each axis.
    """
    return _product([rule(count) for count in size])


@cache
def fine_nodes_of(size: Size) -> tuple[Array, Array]:
    """Return nodes and weights at which a probability is told."""
    if len(size) == 1:
        return fine_rule(size[0])
    return _product([fine_rule(count, least=6) for count in size])


@cache
def floor_nodes(outage: float, size: Size) -> Array:
    """Return nodes ``(J,)`` or ``(J, 2)`` of the likeliest part, of probability 1 - outage.

    One normal number is within an interval, two are in a disc: |z|^2 <= -2 log(outage).

    Parameters
    ----------
    outage
        Probability of being outside.
    size
        Nodes of the expectation.
    """
    if len(size) == 1:
        return interval(float(ndtri(1.0 - 0.5 * outage)), size[0])
    radius = float(np.sqrt(-2.0 * np.log(outage)))
    lines = [interval(radius, count) for count in size]
    grid, _ = _product([(line, np.ones(line.size)) for line in lines])
    inside = grid[np.hypot(grid[:, 0], grid[:, 1]) <= radius * (1.0 + 1e-12)]
    turn = 2.0 * np.pi * np.arange(EDGE) / EDGE
    wide = np.array(size) > 1
    edge = radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1) * wide
    return np.concatenate([inside, edge]) if wide.any() else inside


def shift(beliefs: BeliefBatch, active: BoolArray, z: Array) -> Array:
    """Return how far directions are off the mean, ``(T, K, Q)`` rad or ``(T, K, Q, 2)``.

    Parameters
    ----------
    beliefs
        Of T trials.
    active
        ``(T, K)``.
    z
        Standard normal numbers ``(Q,)``, or ``(Q, 2)`` along the principal axes.
    """
    deviation = where(active, beliefs.deviation)
    return deviation[..., None] * z if beliefs.array.axes == 1 else z @ deviation


def longer(beliefs: BeliefBatch, active: BoolArray, moved: Array) -> Array:
    """Return distances relative to the mean one, ``(T, K, Q)``, of `shift`."""
    stretch = where(active, beliefs.stretch)
    if beliefs.array.axes == 1:
        return 1.0 + stretch[..., None] * moved
    return 1.0 + (moved @ stretch[..., None])[..., 0]


def phases(beliefs: BeliefBatch, active: BoolArray, moved: Array | None = None) -> Array:
    """Return phase steps at the mean, ``(T, K, A)`` rad, or off it, ``(T, K, Q, A)``."""
    mean = where(active, beliefs.angles)
    if moved is None:
        return beliefs.array.phases(mean)
    if beliefs.array.axes == 1:
        return beliefs.array.phases(mean[..., None] + moved)
    return beliefs.array.phases(mean[..., None, :] + moved)


def visible_weight(beliefs: BeliefBatch, active: BoolArray, moved: Array, weight: Array) -> Array:
    """Return the weights ``(T, K, Q)`` of nodes; cosines that are no direction have none."""
    shared = active[..., None] * weight
    if beliefs.array.axes == 1:
        return shared
    cosines = where(active, beliefs.angles)[..., None, :] + moved
    seen = np.square(cosines).sum(axis=-1) <= 1.0
    some = shared * seen
    total = some.sum(axis=-1, keepdims=True)
    return np.where(total > 0.0, some / np.where(total > 0.0, total, 1.0), shared)


def chirp(beliefs: BeliefBatch, active: BoolArray) -> Array:
    """Return the quadratic phase that spreads a beam over a belief, ``(T, K, A)``.

    By stationary phase an antenna at m points where chirp z = 2 pi spacing m (du/dz), so that the
    outermost ones point at z = `COVERED`.
    """
    deviation, array = where(active, beliefs.deviation), beliefs.array
    if isinstance(array, LinearArray):
        angle = where(active, beliefs.angles)
        slope = np.minimum(np.abs(array.slope(angle)) + 0.5 * deviation, 1.0) * deviation
        return (np.pi * array.spacing * array.n * slope / COVERED)[..., None]
    reach: Array = np.abs(deviation) @ np.array(array.shape, dtype=np.float64)
    return np.pi * array.spacing * reach / COVERED


def _product(rules: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the product of rules of one number; that of one is itself."""
    if len(rules) == 1:
        return rules[0]
    nodes = np.stack(np.meshgrid(*(z for z, _ in rules), indexing="ij"), axis=-1)
    weight = np.multiply.outer(rules[0][1], rules[1][1])
    z, p = nodes.reshape(-1, len(rules)), weight.ravel()
    z.flags.writeable = p.flags.writeable = False
    return z, p
