"""Decision times of schemes: measured, and kept out of every result.

A time is no number that the same seed gives again. So it travels in the blocks of a run under a
name of its own, which neither statistics nor result files take up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echobeam.values import Array

SECONDS = "timing:decision"
"""Name in a block of ``(scheme, slot)`` s per trial; NaN in slots without a timed decision."""


@dataclass(frozen=True, slots=True)
class DecisionTime:
    """Seconds that a scheme takes to decide on one trial's beams of one slot.

    Attributes
    ----------
    mean, p99
        Mean and 99th percentile over directional slots and blocks of trials, of a block's time
        divided by its trials; NaN for a scheme without timed slots.
    """

    mean: float
    p99: float


Decisions = dict[str, DecisionTime]
"""By scheme."""


def decision_times(blocks: Sequence[Array], names: Sequence[str]) -> Decisions:
    """Return mean and percentile of the times of some blocks, ``(scheme, slot)`` each."""
    return {
        name: _summary(seconds[np.isfinite(seconds)])
        for name, seconds in zip(names, np.stack(blocks, axis=1), strict=True)
    }


def _summary(seconds: Array) -> DecisionTime:
    if not seconds.size:
        return DecisionTime(np.nan, np.nan)
    return DecisionTime(float(seconds.mean()), float(np.quantile(seconds, 0.99)))


_decided: set[str] = set()


def first_decision(name: str) -> bool:
    """Return whether this is the first decision of a user's scheme in this process.

    It may load or compile what it needs, which is no part of a slot's decision, and is not timed.
    """
    if name in _decided:
        return False
    _decided.add(name)
    return True
