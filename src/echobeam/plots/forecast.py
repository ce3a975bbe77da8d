"""Errors of forecasts over their horizon, against the errors stated by the covariances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echobeam.estimation.consistency import chi_square_band
from echobeam.plots.looks import DOTTED, FAINT, Look
from echobeam.plots.record import Axis, FigureData, Guide, Panel, Series
from echobeam.plots.source import Source, empty_figure
from echobeam.simulation.forecast import MOST_SLOTS, SIGMAS, forecast_errors
from echobeam.values import Array

if TYPE_CHECKING:
    import xarray as xr

_PANELS = (
    ("angle", "Angle error, RMS", "deg", 180.0 / np.pi),
    ("position", "Position error, RMS", "m", 1.0),
)
_ON_GROUND = (
    ("position", "Position error, RMS", "m", 1.0),
    ("velocity", "Velocity error, RMS", "m/s", 1.0),
)
_EXPECTED_SHARE = 99.73
_EXPECTED = Look("0.25")
_LEAST_SHARE = 98.0


def forecast(source: Source) -> FigureData:
    """Return the error of forecasts without measurements over their horizon, up to 50 slots.

    Every horizon has the same forecasts: those made in the slots of `origins`. A dotted line is
    the RMS error stated by the forecasts' covariances; the shaded band contains the RMS error of
    a consistent filter with probability 95 %; the last panel shows the share of angles within
    three stated standard deviations, or of positions on the ground within the ellipse that holds
    as many.
    """
    source.check(
        "truth", "identity", "uav_velocity", "predicted", "estimated", "estimated_cov", "present"
    )
    if not source.result.sizes["object"]:
        return empty_figure(source, "forecast", "no objects to forecast")
    if np.ptp(source.slots) < 1:
        return empty_figure(source, "forecast", "one slot: nothing lies ahead")
    made = origins(source)
    found = forecast_errors(source.result.isel(slot=source.stretch), source.scenario, made)
    slots = f"slot {made[0]}" if len(made) == 1 else f"slots {made[0]} to {made[-1]}"
    shown = _ON_GROUND if source.scenario.geometry == "ground" else _PANELS
    return FigureData(
        "forecast", source.title, (*(_errors(source, found, *one) for one in shown),
                                   _shares(source, found)),
        f"{source.setting()}; forecasts made in {slots}",
        size=(7.16, 2.6), band="95 % band of the stated error",
        key=(("stated by the covariances", Look(FAINT, "", DOTTED)),
             (f"{_EXPECTED_SHARE:g} %, expected of a Gaussian error", _EXPECTED)),
    )  # fmt: skip


def origins(source: Source) -> range:
    """Return the slots in which forecasts are made.

    The first is the end of the first frame, or the middle of a single frame, when velocities are
    well measured; the last is early enough for the longest horizon of the first.
    """
    n, frame = int(np.ptp(source.slots)) + 1, source.scenario.frame.slots_per_frame
    first = frame if frame < n else max(1, n // 2)
    start = int(source.slots[0])
    return range(start + first - 1, start + n - min(MOST_SLOTS, n - first))


def stated_band(stated: Array, degrees: Array) -> Array:
    """Return the 95 % band of the RMS errors of a consistent filter, ``(n, 2)``.

    Parameters
    ----------
    stated
        ``(n,)``: root mean square of the stated standard deviations.
    degrees
        ``(n,)``: degrees of freedom of the mean square error; NaN gives NaN.
    """
    band = [chi_square_band(1, one) if np.isfinite(one) else (np.nan, np.nan) for one in degrees]
    return np.asarray(stated[:, None] * np.sqrt(np.array(band)))


def _axis(found: xr.Dataset) -> Axis:
    return Axis("Horizon", "slots", limits=(0.5, found.sizes["horizon"] + 0.5))


def _errors(
    source: Source, found: xr.Dataset, quantity: str, name: str, unit: str, factor: float
) -> Panel:
    horizon, series = found["horizon"].values, []
    for scheme in source.names:
        part, look = found.sel(quantity=quantity, scheme=scheme), source.looks[scheme]
        stated = factor * part["promised"].values
        band = stated_band(stated, part["degrees"].values)
        series.append(Series(scheme, horizon, factor * part["rmse"].values, look=look))
        if not series[-1].empty:
            series.append(
                Series(
                    f"stated, {scheme}", horizon, stated, band, look.plain(DOTTED), kind="line",
                    width=1.0, legend=False,
                )
            )  # fmt: skip
    return Panel(_axis(found), Axis(name, unit, log=True), tuple(series), empty="no forecast")


def _shares(source: Source, found: xr.Dataset) -> Panel:
    on_ground = source.scenario.geometry == "ground"
    part = found["inside"].sel(quantity="position" if on_ground else "angle")
    series = [
        Series(name, found["horizon"].values, 100.0 * part.sel(scheme=name).values,
               look=source.looks[name])
        for name in source.names
    ]  # fmt: skip
    lowest = min([_LEAST_SHARE, *(float(np.nanmin(one.y)) for one in series if not one.empty)])
    room = 0.06 * (100.0 - lowest)
    words = "Positions inside the ellipse" if on_ground else f"Angles inside ±{SIGMAS:g}σ"
    y = Axis(words, "%", limits=(lowest - room, 100.0 + room))
    guides = (Guide("y", _EXPECTED_SHARE, look=_EXPECTED),)
    return Panel(_axis(found), y, tuple(series), guides=guides, empty="no forecast")
