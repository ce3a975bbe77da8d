"""The axis of slots that the paper's figures share."""

from __future__ import annotations

from echobeam.plots.looks import SHADE, Look
from echobeam.plots.record import Axis, Guide


def slot_axis(slots: int) -> Axis:
    """Return the axis of a frame's slots."""
    ticks = tuple(range(1, slots + 1)) if slots <= 12 else ()
    return Axis("Slot", "10 ms each", limits=(0.5, slots + 0.5), ticks=ticks)


def omni_slots(name: str = "omni slot", first: tuple[int, ...] = (1,)) -> tuple[Guide, ...]:
    """Return the shaded slots that begin a frame."""
    return tuple(Guide("x", slot - 0.5, slot + 0.5, Look(SHADE), name) for slot in first)
