"""Arithmetic of weights that are never negative: plain numbers, or their logarithms.

Sums over joint events are written once and run in either. Plain numbers are several times faster;
logarithms cannot overflow or underflow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from echobeam.values import Array, BoolArray


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """Operations on weights, elementwise.

    Attributes
    ----------
    add, multiply, divide
        Of two weights; `add` has `accumulate`.
    zero, one
        As weights.
    of_log, log, number
        A weight from its logarithm, and the logarithm and plain number of a weight.
    """

    add: np.ufunc
    multiply: np.ufunc
    divide: np.ufunc
    zero: float
    one: float
    of_log: Callable[[Array], Array]
    log: Callable[[Array], Array]
    number: Callable[[Array], Array]


LINEAR = Arithmetic(np.add, np.multiply, np.divide, 0.0, 1.0, np.exp, np.log, np.asarray)
LOGARITHMIC = Arithmetic(
    np.logaddexp, np.add, np.subtract, -np.inf, 0.0, np.asarray, np.asarray, np.exp
)

_LINEAR_RANGE = 600.0
"""Logarithm of the ratio of weights up to which plain numbers are used.

Doubles reach to e^-745. The most probable event of a problem in this range is at least e^-600, so
that what underflows is less than e^-145 of the total per event."""


def scaled(log_odds: Array, missed: Array) -> tuple[Array, Array, BoolArray]:
    """Return log odds and misses with the largest of each track at 0, and whether to use logs.

    Parameters
    ----------
    log_odds, missed
        ``(B, C, D)`` and ``(B, C)``.

    Returns
    -------
    log_odds, missed
        The same less the largest of the track, which changes no probability.
    wide
        ``(B,)``: whether plain numbers could underflow. The bound is the event in which the track
        with the worst miss has its best detection, and all others are missed.
    """
    largest = np.maximum(log_odds.max(axis=-1, initial=-np.inf), missed)
    missed = missed - largest
    loss = -missed.sum(axis=-1) + missed.min(axis=-1, initial=0.0)
    return log_odds - largest[..., None], missed, loss > _LINEAR_RANGE
