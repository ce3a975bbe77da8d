"""Python's numbers from numbers of any kind: NumPy's scalars, arrays without axes."""

from __future__ import annotations

import operator
from typing import Any


def plain(value: Any) -> Any:
    """Return a NumPy number or an array without axes as Python's number, all else as it is."""
    return value.item() if getattr(value, "ndim", None) == 0 and hasattr(value, "item") else value


def whole(value: Any) -> int | None:
    """Return a whole number of any kind as Python's; None if it is none (``True``, 3.0)."""
    value = plain(value)
    if isinstance(value, bool):
        return None
    try:
        return operator.index(value)
    except TypeError:
        return None
