"""Results of local searches from one start, and the choice of the better of two."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from echobeam.values import Array, BoolArray, ComplexArray, IntArray


@dataclass(slots=True)
class Found:
    """Results of T trials: beams for unit power, and the rest as in `DirectResult`.

    ``proved``, ``(T,)``: the multipliers prove every shape the best for its prices, among beams of
    any rank. ``disturbance``, ``(T,)``: the share of the sum rate that the beams' consideration for
    each other costs, roughly.
    """

    beams: ComplexArray
    objective: Array
    converged: BoolArray
    proved: BoolArray
    factor: Array
    iterations: IntArray
    disturbance: Array

    def put(self, index: IntArray, other: Found) -> None:
        """Take over another search's trials, where it is better: converged, and higher."""
        lift = other.converged.astype(int) - self.converged[index]
        rise = other.factor - self.factor[index]
        rise = np.where(rise == 0.0, other.objective - self.objective[index], rise)
        better = (lift > 0) | ((lift == 0) & (rise > 0.0))
        for field in fields(self):
            getattr(self, field.name)[index[better]] = getattr(other, field.name)[better]
