"""What the figures share: titles with the paper's setting, bands, curves, legends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from echobeam.plots import style
from echobeam.plots.style import Look
from echobeam.scenario.model import Scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing
    from matplotlib.lines import Line2D

    from echobeam.values import Array

RATE_SCALE = 1e3
RATE_UNIT = "$10^{-3}$ bit/s/Hz"

LOOKS = (
    Look(style.VERMILION, "s", (0, (4.0, 1.5))),
    Look(style.BLUE, "o", "-"),
    Look(style.GREEN, "^", (0, (5.0, 1.2, 1.0, 1.2))),
    Look(style.PURPLE, "D", (0, (2.5, 1.0))),
    Look(style.ORANGE, "v", (0, (8.0, 2.0))),
)
"""Looks of curves that differ in a parameter instead of a scheme."""


def flight(scenario: Scenario, *, height: bool = True, antennas: bool = True) -> str:
    """Return the UAV's setting as a title says it; leave out what the figure varies."""
    uav = scenario.uav
    parts = [f"$h$ = {uav.height:g} m"] * height + [f"$v^u$ = {uav.speed:g} m/s"]
    parts += [f"$N_t$ = $N_r$ = {scenario.array.n_tx}"] * antennas
    return ", ".join(parts)


def objects(scenario: Scenario) -> str:
    """Return the objects' setting: initial angle, velocity and acceleration of each."""
    return "; ".join(
        f"({math.degrees(one.angle):.0f}°, {one.velocity:g} m/s, {one.acceleration:g} m/s²)"
        for one in scenario.objects
    ).replace("-", "−")


def titled(drawing: Drawing, what: str, setting: str, marks: str = "") -> None:
    """Give a drawing its title: what it shows, in which setting, and what the marks mean."""
    drawing.suptitle("\n".join(line for line in (what, setting, marks) if line))


def curve(
    axes: Axes,
    x: npt.ArrayLike,
    y: Array,
    band: Array | None,
    look: Look,
    label: str,
    zorder: float = 2.0,
) -> Line2D:
    """Draw a curve and, behind it, its band ``(..., 2)``."""
    if band is not None and np.isfinite(band).any():
        low, high = np.moveaxis(band, -1, 0)
        axes.fill_between(x, low, high, color=look.colour, alpha=0.2, linewidth=0, zorder=1.5)
    return style.draw_line(axes, np.asarray(x), y, look, label, zorder=zorder)


def slot_axis(axes: Axes, slots: int, first: tuple[int, ...] = (1,)) -> None:
    """Label the axis of slots and shade those that begin a frame."""
    axes.set_xlabel("Slot (10 ms each)")
    axes.set_xlim(0.5, slots + 0.5)
    for slot in first:
        axes.axvspan(slot - 0.5, slot + 0.5, color=style.SHADE, linewidth=0, zorder=0)
    if slots <= 12:
        axes.set_xticks(range(1, slots + 1))
