"""The one door through which randomness enters: standard normals, keyed and scaled later.

Every trial has its own counter-based generator, keyed by (seed, trial) with the stream in the
counter, and draws slot after slot. So two schemes meet the same luck in the same trial, more
slots only add draws, and no number depends on how the work was split.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from echobeam.values import Array

MAX_SEED = 2**63 - 1


class Stream(IntEnum):
    """What the draws are used for; each use has a stream of its own."""

    MEASUREMENT = 1
    PROCESS = 2


def standard_normals(
    seed: int, trials: Sequence[int], stream: Stream, shape: tuple[int, ...]
) -> Array:
    """Return independent standard normals ``(len(trials), *shape)``, the slots first in shape."""
    draws = np.empty((len(trials), *shape))
    for row, trial in enumerate(trials):
        generator = np.random.Generator(
            np.random.Philox(key=[seed, trial], counter=[0, 0, 0, int(stream)])
        )
        draws[row] = generator.standard_normal(shape)
    return draws
