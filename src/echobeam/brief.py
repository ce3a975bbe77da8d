"""Short texts of values: shapes and ranges in place of arrays, one to six lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from enum import Enum
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

WIDTH = 88
MOST_NUMBERS = 8
"""Numbers up to which an array is spelled out."""

MOST_LETTERS = 48


class Brief:
    """Base of dataclasses (made with ``repr=False``) whose text stays short whatever they hold."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the class and its fields, arrays by shape and range."""
        return brief(self, {item.name: getattr(self, item.name) for item in fields(self)})  # type: ignore[arg-type]


def brief(value: object, named: Mapping[str, object]) -> str:
    """Return the text ``Class(name=value, ...)`` of a value, in lines of at most `WIDTH` letters.

    Parameters
    ----------
    value
        Whose class is named.
    named
        What is shown of it.
    """
    lines = [f"{type(value).__name__}("]
    for name, shown in named.items():
        item = f"{name}={shortened(shown)}, "
        if len(lines[-1]) + len(item) > WIDTH and lines[-1].strip():
            lines.append("    ")
        lines[-1] += item
    return "\n".join(line.rstrip() for line in lines).removesuffix(",") + ")"


def shortened(value: Any) -> str:
    """Return a value in a few words: no array is spelled out that has many numbers."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Brief) or callable(value):
        return f"<{getattr(value, '__name__', type(value).__name__)}>"
    text = " ".join(repr(value).split())
    if len(text) <= MOST_LETTERS:
        return text
    return (
        f"{text[: MOST_LETTERS - 3]}..." if isinstance(value, str) else f"<{type(value).__name__}>"
    )


def html_table(title: str, rows: Mapping[str, object]) -> str:
    """Return a small table for notebooks; every text is escaped."""
    lines = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th>'
        f'<td style="text-align:left">{escape(_cell(value))}</td></tr>'
        for name, value in rows.items()
    )
    return f"<table><caption>{escape(title)}</caption><tbody>{lines}</tbody></table>"


def _cell(value: object) -> str:
    return value if isinstance(value, str) else shortened(value)


def _array(array: npt.NDArray[Any]) -> str:
    """Return a small array's numbers, and of any other its shape, type and range."""
    if array.size <= MOST_NUMBERS and array.dtype.kind in "biufc":
        text = np.array2string(
            array,
            separator=", ",
            max_line_width=1000,
            formatter={"float_kind": "{:.4g}".format, "complex_kind": "{:.4g}".format},
        )
        return " ".join(text.split())
    return f"<{array.shape} {array.dtype}{_range(array)}>"


def _range(array: npt.NDArray[Any]) -> str:
    if array.dtype.kind not in "iuf" or not array.size:
        return ""
    known = array[np.isfinite(array)]
    others = "" if known.size == array.size else ", others not finite"
    return f" {known.min():.4g} to {known.max():.4g}{others}" if known.size else " none finite"
