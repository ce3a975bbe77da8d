"""Ranked assignments of one problem, best first.

Murty, An algorithm for ranking all the assignments in order of increasing cost, Operations
Research 16(3), 1968, on SciPy's assignment.
"""

from __future__ import annotations

from collections.abc import Iterator
from heapq import heappop, heappush
from itertools import count

import numpy as np

from echobeam.values import NOBODY, Array, IntArray


def ranked_assignments(gain: Array) -> Iterator[IntArray]:
    """Yield the assignments ``(C,)`` of detections to tracks in descending order of their sum.

    Parameters
    ----------
    gain
        ``(C, D)``: what a detection adds for a track against a miss, `NOBODY`, which adds 0; -inf
        where the pair is impossible.
    """
    n_tracks, n_detections = gain.shape
    # Each track has a column of its own for a miss, so that a miss can be forbidden as well.
    own = np.where(np.eye(n_tracks, dtype=bool), 0.0, -np.inf)
    order = count()
    heap: list[tuple[float, int, IntArray, int, Array]] = []

    def consider(allowed: Array, fixed: int, columns: IntArray) -> None:
        """Solve a part of the assignments: its first rows fixed, some pairs forbidden."""
        rest = np.setdiff1d(np.arange(n_detections + n_tracks), columns[:fixed])
        found = _assigned(allowed[fixed:, rest])
        if found is not None:
            columns = np.concatenate([columns[:fixed], rest[found]])
            value = float(allowed[np.arange(n_tracks), columns].sum())
            heappush(heap, (-value, next(order), columns, fixed, allowed))

    consider(np.concatenate([gain, own], axis=1), 0, np.arange(0))
    while heap:
        _, _, columns, fixed, allowed = heappop(heap)
        yield np.where(columns < n_detections, columns, NOBODY)
        for row in range(fixed, n_tracks):
            part = allowed.copy()
            part[row, columns[row]] = -np.inf
            consider(part, row, columns)


def _assigned(gain: Array) -> IntArray | None:
    """Return the best column of each row, or nothing if no assignment is possible."""
    from scipy.optimize import linear_sum_assignment

    try:
        columns: IntArray = linear_sum_assignment(gain, maximize=True)[1]
    except ValueError:  # infeasible
        return None
    return columns
