"""Slots of a frame that pictures of single slots show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from echobeam.plots.source import Source
from echobeam.values import BoolArray, ModeArray, with_beams

DEFAULT_SLOTS = (1, 2, 4, 6, 10)
"""Slots of a frame shown by default: the omni slot, the first directional one, and later ones."""


def choose_slots(
    source: Source,
    slots: npt.NDArray[np.int64],
    mode: ModeArray,
    beams: BoolArray,
    default: Sequence[int] = DEFAULT_SLOTS,
) -> list[int]:
    """Return the indices of the slots to show: those asked for, or some of the busiest frame.

    Parameters
    ----------
    source
        Source with the choice of slots.
    slots, mode
        ``(slot,)``: numbers and modes of the slots.
    beams
        ``(slot, object)``: whether a beam was sent for the object.
    default
        Slots of a frame, counted from 1.
    """
    if source.choice.slots:
        numbers = [int(slot) for slot in slots]
        return [numbers.index(slot) for slot in source.choice.slots]
    first, end = _busiest_frame(mode, beams.sum(axis=1))
    return [first + slot - 1 for slot in default if first + slot <= end]


def _busiest_frame(mode: ModeArray, beams: npt.NDArray[np.int64]) -> tuple[int, int]:
    """Return start and end of the frame with the most beams; the earliest if there are several.

    A frame begins with a slot without directional beams. A run without beams, or with beams in
    all slots, is one frame.
    """
    starts = np.flatnonzero(~with_beams(mode))
    bounds = np.unique([0, *starts, len(beams)]) if beams.any() else np.array([0, len(beams)])
    busiest = int(np.argmax(np.add.reduceat(beams, bounds[:-1])))
    return int(bounds[busiest]), int(bounds[busiest + 1])
