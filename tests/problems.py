"""Batches of problem (38) from distances and a linear array's three numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from echobeam.beamforming.problem import ProblemBatch
from echobeam.physics.array import LinearArray


def problem_batch(
    *,
    distances: Any,
    n_tx: int,
    noise: float = 1.0,
    alpha0: float = 1.0,
    spacing: float = 0.5,
    axis: Any = "vertical",
    **values: Any,
) -> ProblemBatch:
    loss = noise * (np.asarray(distances, dtype=float) / alpha0) ** 2
    return ProblemBatch(loss=loss, array=LinearArray(n_tx, spacing, axis), **values)
