"""Sizes of one beam's problem, and the work of a Newton step on all beams of a trial."""

from __future__ import annotations

import math

WIDE = 2.0
"""Cover, in Nyquist lobes, from which on one node more is taken."""

EXTRA_NODES = 4

PROBE_STEPS = 20
"""Steps from a set of objects after which its promise is compared with that of others."""


def node_count(lobes: float) -> int:
    """Return how many nodes stand for a cover that is so many Nyquist lobes 2 pi / N wide."""
    count = math.ceil(lobes) + EXTRA_NODES
    return count + 1 if lobes > WIDE else count


def point_counts(nodes: int) -> tuple[int, int]:
    """Return how many points of a cover are imposed first, and how many are kept to spare.

    Over very wide covers a pattern touches its limits at so many places that too few spare points
    are passed from one to the other without end.
    """
    return max(2 * nodes + 1, 6 * nodes - 23), max(nodes + 1, 4 * nodes - 35)


def step_work(n_objects: int, n_tx: int, lobes: float) -> float:
    """Return the multiplications of a step: Newton matrix and factor of every beam."""
    nodes = node_count(lobes)
    rows = sum(point_counts(nodes)) + n_objects - 1
    size = 2.0 * (min(n_tx, n_objects + nodes + 1) - 1)
    return n_objects * (size**2 * rows + size**3 / 3.0)
