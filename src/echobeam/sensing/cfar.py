"""Constant false-alarm rate: thresholds from the cells around, Finn and Johnson; Rohling."""

from __future__ import annotations

from functools import cache
from typing import Literal, assert_never

import numpy as np

from echobeam.values import Array

Cfar = Literal["cell-averaging", "ordered-statistic"]
"""Level of the noise around a cell: the mean of the training cells, or one of them by rank.

The mean loses least in homogeneous noise; the rank still detects beside other echoes. At the edges
of clutter both miss the set rate (Gandhi and Kassam).
"""

RANK = 0.75
"""Rank of the ordered statistic, as a share of the training cells (Rohling)."""


def noise_level(training: Array, kind: Cfar) -> Array:
    """Return the level of exponential noise estimated from training cells ``(..., W)``."""
    match kind:
        case "cell-averaging":
            mean: Array = training.mean(axis=-1)
            return mean
        case "ordered-statistic":
            rank = _rank(training.shape[-1])
            ordered: Array = np.partition(training, rank - 1, axis=-1)[..., rank - 1]
            return ordered
        case _:
            assert_never(kind)


@cache
def threshold_factor(cells: int, false_alarm: float, kind: Cfar) -> float:
    """Return the factor on `noise_level` that a cell of noise exceeds with a probability.

    Cell averaging: P_FA = (1 + factor / W)^-W; ordered statistic of rank k: P_FA = prod_{i < k}
    (W - i) / (W - i + factor).

    Parameters
    ----------
    cells
        W, number of training cells.
    false_alarm
        P_FA of one cell.
    kind
        Which level the factor belongs to.
    """
    match kind:
        case "cell-averaging":
            return float(cells * (false_alarm ** (-1.0 / cells) - 1.0))
        case "ordered-statistic":
            return _ordered_factor(cells, false_alarm)
        case _:
            assert_never(kind)


def training_cells(cells: Array, place: Array, width: int, guard: int, stride: int) -> Array:
    """Return the cells on both sides of places along the last axis, which is taken as periodic.

    Parameters
    ----------
    cells
        ``(..., n)``.
    place
        ``(...)``: index of the cell under test.
    width, guard
        Number of training and of guard cells on either side.
    stride
        Cells of the map per resolution cell; training cells are independent, one for each.

    Returns
    -------
    Array
        ``(..., 2 width)``.
    """
    offsets = stride * np.arange(guard + 1, guard + width + 1)
    index = (place[..., None] + np.concatenate([-offsets, offsets])) % cells.shape[-1]
    found: Array = np.take_along_axis(cells, index, axis=-1)
    return found


def _rank(cells: int) -> int:
    return max(1, round(RANK * cells))


def _ordered_factor(cells: int, false_alarm: float) -> float:
    from scipy.optimize import brentq

    left = cells - np.arange(_rank(cells))

    def excess(log_factor: float) -> float:
        ratio = np.log(left) - np.log(left + np.exp(log_factor))
        return float(ratio.sum() - np.log(false_alarm))

    return float(np.exp(brentq(excess, -30.0, 60.0, xtol=1e-13)))
