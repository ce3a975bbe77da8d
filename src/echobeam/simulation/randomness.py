"""The one door through which randomness enters: standard normals, keyed and scaled later.

A counter-based generator (Philox) is keyed by the seed; trial, object, slot and use are words of
its counter. So two schemes meet the same luck in the same trial, each object has draws of its
own, more slots or objects only add draws, and no number depends on how the work was split. Every
uniform word becomes one normal by the inverse of the distribution function.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from enum import IntEnum
from functools import cache

import numpy as np

from echobeam.values import Array, IntArray

MAX_SEED = 2**63 - 1

WORDS = 4
"""64-bit words that Philox gives for each value of its counter, and so for each trial."""


class Use(IntEnum):
    """Use of a draw; each has a stream of its own."""

    MEASUREMENT = 1
    PROCESS = 2
    SCHEME = 3
    SCHEME_UPDATE = 4
    DATA = 5
    NOISE = 6
    FLUCTUATION = 7
    SURROUNDINGS = 8
    DETECTION = 9
    FALSE_ALARM = 10
    ALTIMETER = 11
    TERRAIN = 12
    BACKGROUND = 13


def object_normals(
    seed: int, trials: range, slot: int, use: Use, objects: IntArray, count: int
) -> Array:
    """Return standard normals of some objects in one slot, ``(T, K, count)``.

    Parameters
    ----------
    seed
        0 to `MAX_SEED`.
    trials
        Successive trials.
    slot
        Counted from 0.
    use
        The use of the draws.
    objects
        ``(K,)``: identities, each with draws of its own; negative ones get zeros.
    count
        Draws for each, at most `WORDS`.
    """
    draws = np.zeros((len(trials), len(objects), count))
    for column, identity in enumerate(objects.tolist()):
        if identity >= 0:
            counter = [trials.start, identity, slot, int(use)]
            words = np.random.Philox(key=[seed, 0], counter=counter).random_raw(WORDS * len(trials))
            draws[:, column] = _normals(words).reshape(-1, WORDS)[:, :count]
    return draws


def trial_normals(seed: int, trials: range, slot: int, use: Use, shape: tuple[int, ...]) -> Array:
    """Return standard normals that belong to no object, ``(T, *shape)``, drawn trial by trial.

    Parameters
    ----------
    seed, trials, slot, use
        As in `object_normals`.
    shape
        Of one trial's draws.
    """
    return _rows(seed, 2, trials, slot, use, shape)


@cache
def scheme_key(seed: int) -> int:
    """Return the key of the draws that schemes may ask for, from which nobody finds the seed.

    A scheme is given draws by a call, and whoever looks into that call finds the key. With the
    seed it could draw nature's noise and subtract it.
    """
    return int.from_bytes(hashlib.sha256(f"schemes of seed {seed}".encode()).digest()[:8], "little")


@dataclass(frozen=True, slots=True)
class SchemeNormals:
    """Standard normals of a scheme in one slot, the same whenever they are asked for.

    Attributes
    ----------
    key
        `scheme_key` of the seed.
    trials, slot
        As in `object_normals`.
    use
        `Use.SCHEME` or `Use.SCHEME_UPDATE`.
    """

    key: int
    trials: range
    slot: int
    use: Use

    def __call__(self, shape: tuple[int, ...]) -> Array:
        """Return standard normals ``(T, *shape)``, drawn trial by trial."""
        return _rows(self.key, 1, self.trials, self.slot, self.use, shape)


def _rows(key: int, kind: int, trials: range, slot: int, use: Use, shape: tuple[int, ...]) -> Array:
    """Return normals ``(T, *shape)``, each trial's from the start of a counter of its own."""
    size = int(np.prod(shape))
    draws = np.empty((len(trials), size))
    for row, trial in enumerate(trials):
        generator = np.random.Philox(key=[key, kind], counter=[0, trial, slot, int(use)])
        draws[row] = _normals(generator.random_raw(size))
    return draws.reshape(len(trials), *shape)


def _normals(words: np.ndarray[tuple[int, ...], np.dtype[np.uint64]]) -> Array:
    """Return a standard normal for each 64-bit word: 53 bits, never 0 or 1, inverted."""
    from scipy.special import ndtri

    uniform = ((words >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    normals: Array = ndtri(uniform)
    return normals
