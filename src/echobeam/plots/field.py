"""Fields over two axes as records: a quantity on a grid, drawn as filled contours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from echobeam.values import Array


@dataclass(frozen=True, slots=True)
class Field:
    """Values of a quantity on a grid of the panel's axes.

    Attributes
    ----------
    name, unit
        Quantity and its unit, for the colour bar and the table.
    x, y
        ``(n,)`` and ``(m,)``: positions of the columns and of the rows.
    values
        ``(m, n)``; NaN where there is none.
    levels
        Edges of the shades, ascending; values beyond them have the shade of the nearest.
    """

    name: str
    unit: str
    x: Array
    y: Array
    values: Array
    levels: tuple[float, ...]

    def __str__(self) -> str:
        """Return the quantity as a column heading."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def rows(self) -> Iterator[tuple[float, float, float]]:
        """Yield position and value of every point of the grid."""
        for y, row in zip(self.y, self.values, strict=True):
            for x, value in zip(self.x, row, strict=True):
                yield float(x), float(y), float(value)


def levels_below(highest: float, step: float, count: int) -> tuple[float, ...]:
    """Return ``count + 1`` multiples of ``step``, of which the last is not below ``highest``."""
    top = step * float(np.ceil(highest / step)) if np.isfinite(highest) else 0.0
    return tuple(top - step * number for number in range(count, -1, -1))
