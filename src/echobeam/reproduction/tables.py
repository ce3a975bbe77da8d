"""Tidy tables beside the pictures: one row per observation, a heading with units."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echobeam.store.writing import replacing

Cell = str | int | float


@dataclass(frozen=True, slots=True)
class Table:
    """Named columns and rows of cells; NaN is written as an empty cell."""

    columns: tuple[str, ...]
    rows: Sequence[tuple[Cell, ...]]

    def text(self) -> str:
        """Return the table as CSV."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows([_written(cell) for cell in row] for row in self.rows)
        return out.getvalue()

    def write(self, path: Path) -> Path:
        """Write the table as CSV, whole or not at all."""
        with replacing(path) as temporary:
            temporary.write_text(self.text(), encoding="utf-8")
        return path


def _written(cell: Cell) -> str | int:
    if isinstance(cell, str | int):
        return cell
    return "" if np.isnan(cell) else f"{float(cell):.9g}"
