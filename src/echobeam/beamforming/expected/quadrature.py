"""Expectations over a Gaussian angle as sums over nodes, as many as the beams' width asks for.

A beam of N elements is a trigonometric polynomial in the direction u; under a standard normal z
with theta = mean + deviation z its fastest term turns by

    omega = 2 pi spacing (N - 1) |du/dtheta| deviation

per unit of z. The Gauss-Hermite rule of Q points is exact for polynomials of degree 2 Q - 1 and
best while omega is about one; beyond, its number of points grows with omega^2. The trapezoidal
rule of step h has an error of exp(-(2 pi / h - omega)^2 / 2) for exp(j omega z) (Poisson's
summation formula, e.g. Trefethen and Weideman, SIAM Review 56, 2014, section 5), so its number of
points grows with omega alone.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.values import Array, IntArray

HERMITE = 7
"""Points of the Gauss-Hermite rule."""

SMOOTH = 1.3
"""omega up to which that rule is used; its error for exp(j omega z) is below 1e-5 there."""

FEW = 3
"""Points of that rule for very narrow beliefs."""

SMOOTHEST = 0.4
"""omega up to which those do; their error for exp(j omega z), 6 omega^6 / 6!, is below 4e-5."""

REACH = 4.0
"""Standard deviations to either side that the trapezoidal rule covers: all but 6e-5."""

MARGIN = 5.0
"""Excess of 2 pi / h over omega: an error of 4e-6."""

CLOSER = 3
"""Nodes of a floor for each of the expectation's: a weak direction must not hide between them."""

SIZES = (1, HERMITE, 11, 15, 21, 31, 43, 61, 87, 123, 175, 247, 349, 495, 699, 989)
"""Numbers of nodes; trials are brought together by it, so that none depends on its neighbours."""


def nodes_needed(angles: Array, deviation: Array, array: LinearArray) -> IntArray:
    """Return ``(T,)``: the number of nodes, of `SIZES`, that the widest belief of a trial needs.

    Parameters
    ----------
    angles, deviation
        ``(T, K)`` rad; an object without a belief has deviation zero.
    array
        The transmit array.
    """
    slope = np.minimum(np.abs(array.slope(angles)) + deviation, 1.0)  # it grows off the mean
    omega = 2.0 * np.pi * array.spacing * (array.n - 1) * slope * deviation
    fastest = np.max(omega, axis=-1, initial=0.0)
    return sizes_of(fastest, np.max(deviation, axis=-1, initial=0.0))


def sizes_of(fastest: Array, widest: Array, *, few: bool = False) -> IntArray:
    """Return the numbers of nodes ``(...)`` that beliefs need.

    Parameters
    ----------
    fastest
        ``(...)``: omega.
    widest
        ``(...)``: deviation; zero for no uncertainty, which has one node.
    few
        Whether `FEW` nodes may do, as products of rules should have few.
    """
    wanted = np.ceil(2.0 * REACH * (fastest + MARGIN) / (2.0 * np.pi)) + 1.0
    wanted = np.where(fastest <= SMOOTH, float(HERMITE), wanted)
    wanted = np.where(few & (fastest <= SMOOTHEST), float(FEW), wanted)
    wanted = np.where(widest == 0.0, 1.0, wanted)
    sizes = np.asarray((SIZES[0], FEW, *SIZES[1:]), dtype=np.int64)
    place = np.minimum(np.searchsorted(sizes, wanted), sizes.size - 1)
    return sizes[place]


@cache
def rule(count: int) -> tuple[Array, Array]:
    """Return nodes z and weights, ``(Q,)``, of an expectation over a standard normal number.

    Parameters
    ----------
    count
        Q, one of `SIZES`.
    """
    if count <= HERMITE:
        nodes, weights = np.polynomial.hermite_e.hermegauss(count)
    else:
        nodes = np.linspace(-REACH, REACH, count)
        weights = np.exp(-0.5 * nodes * nodes)
    weights = weights / np.sum(weights)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights


@cache
def fine_rule(count: int, least: int = 25) -> tuple[Array, Array]:
    """Return nodes and weights ``(4 Q,)`` at which a probability is told, equally spaced.

    Parameters
    ----------
    count
        Q, nodes of the expectation.
    least
        Nodes that are taken for it at least.
    """
    many = 1 if count == 1 else 4 * max(count, least)
    nodes = np.zeros(1) if many == 1 else np.linspace(-REACH, REACH, many)
    weights = np.exp(-0.5 * nodes * nodes)
    weights = weights / np.sum(weights)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights


def interval(edge: float, count: int) -> Array:
    """Return numbers ``(J,)`` from ``-edge`` to ``edge``, closer than the nodes of an expectation.

    Parameters
    ----------
    edge
        Standard deviations.
    count
        Nodes of the expectation, which has a width of twice `REACH`.
    """
    if count == 1:
        return np.zeros(1)
    many = CLOSER * int(np.ceil(edge / REACH * (count - 1))) + 1
    return np.linspace(-edge, edge, max(many | 1, 5))
