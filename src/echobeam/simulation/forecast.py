"""How far ahead a filter sees: errors of predictions without measurements, against the horizon."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echobeam.estimation.gaussian import propagate, wrap
from echobeam.physics.motion import UavPath, uav_path
from echobeam.scenario.model import Scenario
from echobeam.tracking.evolution import evolution_jacobian, evolve
from echobeam.values import Array, BoolArray

if TYPE_CHECKING:
    import xarray as xr

MOST_SLOTS = 50
"""The longest horizon."""

SIGMAS = 3.0
"""Half-width of the promised band, in standard deviations."""


def forecast_errors(result: xr.Dataset, scenario: Scenario) -> xr.Dataset:
    """Return what became of forecasts from every slot's posterior, per scheme and horizon.

    The UAV's flight is known ahead. A forecast counts where the object was known when it was
    made and the same object is still there when it falls due.

    Returns
    -------
    xarray.Dataset
        ``rmse`` and ``promised`` (scheme, horizon, state): root mean square of the errors and of
        the standard deviations that the filter promised; ``inside`` (scheme, horizon, state):
        share of errors within three promised standard deviations, 0.9973 for an honest Gaussian;
        ``count`` (scheme, horizon).
    """
    import xarray as xr

    n_slots, uav = result.sizes["slot"], scenario.uav
    horizons = range(1, min(MOST_SLOTS, n_slots - 1) + 1)
    path = uav_path(uav.height, uav.speed, uav.heading, scenario.frame.slot, n_slots, uav.floor)
    shape = (result.sizes["scheme"], len(horizons), 3)
    sums = {name: np.zeros(shape) for name in ("square", "variance", "inside")}
    counts = np.zeros(shape[:2])
    truth, present = result["truth"].values, result["present"].values
    for scheme in range(shape[0]):
        part = result.isel(scheme=scheme)
        mean, cov = part["estimated"].values, part["estimated_cov"].values
        for index, horizon in enumerate(horizons):
            mean, cov = _one_further(mean, cov, path, horizon, scenario)
            error = mean - truth[:, horizon:]
            error[..., 0] = wrap(error[..., 0])
            variance = np.diagonal(cov, axis1=-2, axis2=-1)
            counted = _due(present, horizon) & np.isfinite(error).all(-1) & (variance > 0).all(-1)
            error, variance = error[counted], variance[counted]
            counts[scheme, index] = len(error)
            sums["square"][scheme, index] = np.sum(error**2, axis=0)
            sums["variance"][scheme, index] = np.sum(variance, axis=0)
            sums["inside"][scheme, index] = np.sum(error**2 <= SIGMAS**2 * variance, axis=0)
    per = np.where(counts > 0, counts, np.nan)[..., None]
    dims = ("scheme", "horizon", "state")
    return xr.Dataset(
        {
            "rmse": (dims, np.sqrt(sums["square"] / per), {"units": "rad, m, m/s"}),
            "promised": (dims, np.sqrt(sums["variance"] / per), {"units": "rad, m, m/s"}),
            "inside": (dims, sums["inside"] / per, {"units": "1"}),
            "count": (dims[:2], counts, {"units": "1"}),
        },
        {"scheme": result["scheme"], "horizon": list(horizons), "state": result["state"]},
    )


def _one_further(
    mean: Array, cov: Array, path: UavPath, horizon: int, scenario: Scenario
) -> tuple[Array, Array]:
    """Return forecasts one slot longer; slot axis 1 holds the slot in which they were made."""
    mean, cov = mean[:, :-1], cov[:, :-1]
    settings, duration = scenario.filter, scenario.frame.slot
    flown = slice(horizon - 1, horizon - 1 + mean.shape[1])
    speed, heading = path.speed[flown, None], path.heading[flown, None]
    process = np.diag([settings.angle_std, settings.distance_std, settings.velocity_std]) ** 2
    G = evolution_jacobian(mean, speed, heading, duration, settings.evolution)
    return evolve(mean, speed, heading, duration, settings.evolution), propagate(cov, G, process)


def _due(present: BoolArray, horizon: int) -> BoolArray:
    """Return ``(trial, slot - horizon, object)``: somebody is there all the way to the horizon."""
    away = np.cumsum(~present, axis=1)
    before = np.concatenate([np.zeros_like(away[:, :1]), away[:, :-1]], axis=1)
    still: BoolArray = away[:, horizon:] == before[:, :-horizon]
    return still
