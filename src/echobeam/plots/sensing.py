"""Errors of the receiver's estimators against the bounds, over SNR and over separation."""

from __future__ import annotations

import numpy as np

from echobeam.plots.looks import BLACK, BLUE, DASHED, DOTTED, GREEN, VERMILION, Look
from echobeam.plots.record import Axis, FigureData, Panel, Series
from echobeam.simulation.sensing_check import QUANTITIES, SensingCheck

_SHOWN = {"angle": ("deg", 180.0 / np.pi), "delay": ("ns", 1e9), "doppler": ("kHz", 1e-3)}
_NAMES = {"matched_filter": "matched filter", "capon": "Capon", "glrt": "GLRT"}
_LOOKS = {
    "matched_filter": Look(GREEN, "^"),
    "glrt": Look(BLUE, "o"),
    "capon": Look(VERMILION, "s", DASHED),
}
_BOUNDS = {"exact": Look(BLACK), "paper": Look(BLACK, "", DOTTED)}


def sensing(check: SensingCheck, title: str, setting: str) -> FigureData:
    """Return RMSE of each quantity over SNR with both bounds, and the resolution of two objects."""
    x = Axis("SNR after integration and array", "dB")
    panels = []
    for quantity in QUANTITIES:
        unit, factor = _SHOWN[quantity]
        series = [
            Series(f"bound, {name}", check.total, factor * check.bound[name][quantity],
                   look=look, kind="line")
            for name, look in _BOUNDS.items()
        ]  # fmt: skip
        series += [
            Series(_NAMES[name], check.total, factor * rmse, look=_LOOKS[name])
            for name, rmse in check.rmse[quantity].items()
        ]
        y = Axis(f"{quantity.capitalize()} RMSE", unit, log=True)
        shown = tuple(one for one in series if np.isfinite(one.y).any())
        if any(one.kind != "line" for one in shown):
            panels.append(Panel(x, y, shown))
    apart = Axis("Separation of two objects", "deg")
    found = tuple(
        Series(_NAMES[name], np.degrees(check.separation), share, look=_LOOKS[name])
        for name, share in check.resolved.items()
        if np.isfinite(share).any()
    )
    if found:
        panels.append(Panel(apart, Axis("Share resolved", limits=(-0.02, 1.02)), found))
    return FigureData(
        "sense", title, tuple(panels), setting, f"{check.trials} trials per point",
        layout=((0, 1), (2, 3)) if len(panels) == 4 else ((0, 1),),
        size=(7.16, 4.6 if len(panels) == 4 else 2.6),
    )  # fmt: skip
