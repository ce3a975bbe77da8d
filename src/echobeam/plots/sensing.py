"""Errors of the receiver's estimators against the bounds, over SNR and over separation."""

from __future__ import annotations

import numpy as np

from echobeam.plots.looks import BLACK, BLUE, DASHED, DOTTED, GREEN, VERMILION, Look
from echobeam.plots.record import Axis, FigureData, Panel, Series
from echobeam.simulation.sensing_check import SensingCheck

_SHOWN = {
    "angle": ("Angle", "deg", 180.0 / np.pi),
    "u": ("Direction cosine $u$:", "", 1.0),
    "v": ("Direction cosine $v$:", "", 1.0),
    "delay": ("Delay", "ns", 1e9),
    "doppler": ("Doppler", "kHz", 1e-3),
}
_NAMES = {"matched_filter": "matched filter", "capon": "Capon", "glrt": "GLRT"}
_LOOKS = {
    "matched_filter": Look(GREEN, "^"),
    "glrt": Look(BLUE, "o"),
    "capon": Look(VERMILION, "s", DASHED),
}
_LAYOUTS = {
    2: (((0, 1),), 2.6),
    4: (((0, 1), (2, 3)), 4.6),
    5: (((0, 1), (2, 3), (4, -1)), 6.6),
}
"""Places of so many panels, and the height in inches."""

_BOUNDS = {"exact": Look(BLACK), "paper": Look(BLACK, "", DOTTED)}


def sensing(check: SensingCheck, title: str, setting: str) -> FigureData:
    """Return RMSE of each quantity over SNR with both bounds, and the resolution of two objects."""
    x = Axis("SNR after integration and array", "dB")
    panels = []
    for quantity in (*check.directions, "delay", "doppler"):
        words, unit, factor = _SHOWN[quantity]
        series = [
            Series(f"bound, {name}", check.total, factor * check.bound[name][quantity],
                   look=look, kind="line")
            for name, look in _BOUNDS.items()
        ]  # fmt: skip
        series += [
            Series(_NAMES[name], check.total, factor * rmse, look=_LOOKS[name])
            for name, rmse in check.rmse[quantity].items()
        ]
        y = Axis(f"{words} RMSE", unit, log=True)
        shown = tuple(one for one in series if np.isfinite(one.y).any())
        if any(one.kind != "line" for one in shown):
            panels.append(Panel(x, y, shown))
    on_road = check.directions == ("angle",)
    apart = Axis("Separation of two objects", "deg" if on_road else "")
    distance = np.degrees(check.separation) if on_road else check.separation
    found = tuple(
        Series(_NAMES[name], distance, share, look=_LOOKS[name])
        for name, share in check.resolved.items()
        if np.isfinite(share).any()
    )
    if found:
        panels.append(Panel(apart, Axis("Share resolved", limits=(-0.02, 1.02)), found))
    layout, height = _LAYOUTS[len(panels)]
    return FigureData(
        "sense", title, tuple(panels), setting, f"{check.trials} trials per point",
        layout=layout, size=(7.16, height),
    )  # fmt: skip
