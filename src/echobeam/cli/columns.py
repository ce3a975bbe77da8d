"""Text in columns."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from typing import Any

WIDTH = 100


def aligned(rows: Sequence[Sequence[str]], left: int = 0) -> list[str]:
    """Return the rows of a table as aligned lines.

    Parameters
    ----------
    rows
        Cells, the headings first; all rows have the same number.
    left
        Number of leading columns that are aligned left; the others are aligned right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if place < left else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


def table(columns: dict[str, Callable[[Any], str]], rows: Sequence[Any]) -> list[str]:
    """Return a table as indented lines, the first column aligned left."""
    cells = [list(columns), *([cell(row) for cell in columns.values()] for row in rows)]
    return [f"  {line}" for line in aligned(cells, left=1)]


def filled(head: str, words: str) -> str:
    """Return wrapped text, its later lines indented by the length of the heading."""
    indent = " " * max(len(head), 4)
    return textwrap.fill(
        words, WIDTH, initial_indent=head, subsequent_indent=indent, break_on_hyphens=False
    )
