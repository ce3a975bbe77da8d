"""Powers for beams of given shapes: water-filling, and what the rate floors (38e) take."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array

MOST_STEPS = 100
BUDGET_DIGITS = 1e-9
"""Relative excess of the budget that is put down to rounding."""

ROUNDING = 1e-15


def water_filling(gains: Array, loss: Array, least: Array) -> tuple[Array, float]:
    """Return the powers of unit sum that maximise sum log(1 + gain power / loss), and the level.

    Parameters
    ----------
    gains
        ``(K,)``, positive: gain of each beam at its object per unit of power.
    loss
        ``(K,)``: noise referred to the array, relative to the whole power.
    least
        ``(K,)``: least power of each beam; sum at most 1.

    Returns
    -------
    powers, level
        ``(K,)``, max(least, level - loss / gain), summing to 1; and the water level.
    """
    # Counted from the lowest ground: where noise is many times the power, digits would be lost.
    bottom = float(np.min(loss / gains))
    ground = loss / gains - bottom
    threshold = least + ground
    order = np.argsort(threshold)
    rising = np.arange(1, order.size + 1)
    dry = np.sum(least) - np.cumsum(least[order])
    levels = (1.0 - dry + np.cumsum(ground[order])) / rising
    count = int(np.sum(levels >= threshold[order]))
    level = float(levels[max(count, 1) - 1])
    return np.maximum(least, level - ground), level + bottom


def least_powers(gains: Array, loss: Array, threshold: Array) -> Array | None:
    """Return the smallest powers that meet the floors (38e) with beams of given shapes.

    Parameters
    ----------
    gains
        ``(K, K)``: gain at object k (row) of beam i (column) per unit of power.
    loss
        ``(K,)``: noise referred to the array.
    threshold
        ``(K,)``: 2^Gamma_k - 1, the least SINR.

    Returns
    -------
    Array or None
        ``(K,)``, in the unit of ``loss``; None if no powers do, however large.
    """
    own = np.diagonal(gains)
    if np.any(own <= 0.0):
        return None
    weight = threshold / own
    coupling = weight[:, np.newaxis] * (gains - np.diag(own))
    try:
        powers = np.linalg.solve(np.eye(own.size) - coupling, weight * loss)
    except np.linalg.LinAlgError:
        return None
    # A non-negative coupling has a non-negative solution only if its spectral radius is below one.
    if not np.all(np.isfinite(powers)) or np.any(powers < 0.0):
        return None
    if np.any(powers < (1.0 - 1e-9) * weight * loss):
        return None
    return np.asarray(powers)


def spend(gains: Array, loss: Array, threshold: Array) -> Array | None:
    """Return powers of unit sum that meet the floors with given shapes and use the rest well.

    Parameters
    ----------
    gains, loss, threshold
        As in `least_powers`, loss relative to the whole power.

    Returns
    -------
    Array or None
        ``(K,)``; None if the floors cannot be met with these shapes.
    """
    least = least_powers(gains, loss, threshold)
    if least is None or np.sum(least) > 1.0 + BUDGET_DIGITS:
        return None
    least = least / max(1.0, float(np.sum(least)))
    wanted, _ = water_filling(np.diagonal(gains), loss, least)
    repaired = repair_powers(gains, loss, threshold, wanted)
    if np.all(_required(gains, loss, threshold, repaired) <= repaired * (1.0 + BUDGET_DIGITS)):
        return repaired
    # More power for all in the same proportion never harms a floor.
    total = float(np.sum(least))
    return least / total if total > 0.0 else wanted


def _required(gains: Array, loss: Array, threshold: Array, powers: Array) -> Array:
    """Return the power that each beam needs for its floor (38e) while the others keep theirs."""
    own = np.diagonal(gains)
    return np.asarray(threshold * (gains @ powers - own * powers + loss) / own)


def repair_powers(gains: Array, loss: Array, threshold: Array, powers: Array) -> Array:
    """Return nearly the same powers that meet the floors and the budget, if any near ones do.

    For the last digits that a solver leaves open: beams short of their floor are raised, and what
    that takes comes from beams above theirs. If there is not enough, all powers are scaled to the
    budget and the floors stay short by that much.

    Parameters
    ----------
    gains, loss, threshold
        As in `least_powers`, loss relative to the whole power.
    powers
        ``(K,)``: sum about 1.
    """
    for _ in range(MOST_STEPS):
        required = _required(gains, loss, threshold, powers)
        if np.all(required <= powers * (1.0 + ROUNDING)):
            break
        powers = np.maximum(powers, required)
    excess = float(np.sum(powers)) - 1.0
    slack = np.maximum(powers - required, 0.0)
    if 0.0 < excess < float(np.sum(slack)):
        powers = powers - slack * (excess / float(np.sum(slack)))
    return powers / max(1.0, float(np.sum(powers)))
