"""Numbers of any kind as Python's, and as JSON's: NumPy's scalars, arrays, NaN."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping
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


def as_json(value: Any) -> Any:
    """Return a value as strict JSON knows it: arrays as lists, what is no finite number as null."""
    if isinstance(value, Mapping):
        return {key: as_json(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return as_json(value.tolist())
    if isinstance(value, list | tuple):
        return [as_json(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
