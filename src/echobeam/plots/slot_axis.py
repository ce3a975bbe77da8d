"""The axis that counts slots, and the slots without directional beams shaded on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from echobeam.plots import style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from echobeam.values import BoolArray


def label_slots(axes: Axes, slot_seconds: float | None) -> None:
    """Label the slot axis, with the slot's duration where it is known."""
    axes.set_xlabel("Slot" if slot_seconds is None else f"Slot ({slot_seconds * 1e3:g} ms each)")


def limit_slots(axes: Axes, result: xr.Dataset, ticks: int = 10) -> None:
    """Give the slot axis whole numbers and half a slot of room at both ends."""
    slots = result["slot"].values
    axes.xaxis.set_major_locator(MaxNLocator(nbins=ticks, integer=True, min_n_ticks=1))
    if slots.size:
        axes.set_xlim(slots[0] - 0.5, slots[-1] + 0.5)


def shade_phases(axes: Axes, result: xr.Dataset) -> list[Patch]:
    """Shade the slots without directional beams, and return the legend's entry for them.

    A scheme that never sends directional beams (omni) says nothing about the frame, nor does a
    slot in which trials differ.
    """
    phase = result["phase"].transpose("scheme", "slot").values.astype(str)
    phase = phase[np.isin(phase, ["directional", "mixed"]).any(axis=1)]
    kinds = [kind for kind in ("omni", "pilot") if (phase == kind).any()]
    slots = result["slot"].values
    shaded: BoolArray = np.asarray(np.isin(phase, kinds).any(axis=0))
    for first, last in _spells(shaded):
        low, high = slots[first] - 0.5, slots[last] + 0.5
        axes.axvspan(low, high, color=style.SHADE, linewidth=0, zorder=0)
    label = " or ".join(kinds) + " slot"
    return [Patch(facecolor=style.SHADE, edgecolor="0.7", label=label)] if kinds else []


def _spells(shaded: BoolArray) -> list[tuple[int, int]]:
    """Return the first and last index of each unbroken spell."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], shaded, [False]]).astype(int)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]
