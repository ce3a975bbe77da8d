"""Results of local searches from one start, and the choice of the better of two."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from echobeam.values import Array, BoolArray, ComplexArray, IntArray

ALIKE = 1e-6
"""Relative difference of sum rates up to which beams that converged are the better ones."""


@dataclass(slots=True)
class Found:
    """Results of T trials: beams for unit power, and the rest as in `DirectResult`.

    ``proved``, ``(T,)``: the multipliers prove every shape the best for its prices, among beams of
    any rank. ``kept``, ``(T,)``: the beams keep their covers, converged or not.
    ``interference_loss``, ``(T,)``: the share of the sum rate that the beams' consideration for
    each other costs, roughly.
    """

    beams: ComplexArray
    objective: Array
    converged: BoolArray
    proved: BoolArray
    kept: BoolArray
    factor: Array
    iterations: IntArray
    interference_loss: Array

    def among(self, objects: IntArray, n_objects: int) -> Found:
        """Return the same with beams for more objects, zero but for ``objects``, ``(T, k)``."""
        beams = np.zeros((len(objects), n_objects, self.beams.shape[2]), dtype=complex)
        beams[np.arange(len(objects))[:, np.newaxis], objects] = self.beams
        return replace(self, beams=beams)

    def put(self, index: IntArray, other: Found) -> None:
        """Take over another search's trials, where it is better.

        Better are beams that keep their covers, then those that meet more of the floors, then the
        higher sum rate; where sum rates are alike, those that converged.
        """
        lift = other.kept.astype(int) - self.kept[index]
        rise = other.factor - self.factor[index]
        rise = np.where(rise == 0.0, other._value() - self._value()[index], rise)
        better = (lift > 0) | ((lift == 0) & (rise > 0.0))
        for field in fields(self):
            getattr(self, field.name)[index[better]] = getattr(other, field.name)[better]

    def _value(self) -> Array:
        """Return the sum rates, with what convergence is worth."""
        value: Array = self.objective * (1.0 + ALIKE * self.converged)
        return value
