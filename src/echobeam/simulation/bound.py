"""The posterior Cramer-Rao bound of a result: what no filter could beat on its measurements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echobeam.estimation.bound import posterior_bound
from echobeam.physics.motion import uav_path
from echobeam.scenario.model import Scenario
from echobeam.tracking.evolution import evolution_jacobian
from echobeam.tracking.measurement import measurement_jacobian
from echobeam.values import Array

if TYPE_CHECKING:
    import xarray as xr

MOST_TRIALS = 256
"""Trials over which the recursion's expectations are taken."""


def with_bound(result: xr.Dataset, scenario: Scenario) -> xr.Dataset:
    """Return the result with the variable ``bound`` (scheme, slot, object, state).

    It holds standard deviations in rad, m and m/s: NaN before the measurements determine the
    state, and for a scheme that predicts nothing (a held estimate is biased, and the bound is not
    for it). A result of a trace is returned as it is: its objects come and go, and the recursion
    would have to begin anew with every one.
    """
    if scenario.trace is not None or result.sizes["object"] == 0:
        return result
    part = result[["truth", "measured_var"]].isel(trial=slice(0, MOST_TRIALS)).load()
    predicts = np.isfinite(result["predicted"].isel(trial=0).values).any(axis=(1, 2, 3))
    bounds = np.stack(
        [
            _scheme_bound(scenario, part["truth"].values, variance)
            for variance in part["measured_var"].values
        ]
    )
    bounds[~predicts] = np.nan
    attributes = {"units": "rad, m, m/s", "long_name": "posterior Cramer-Rao bound (std)"}
    return result.assign(bound=(("scheme", "slot", "object", "state"), bounds, attributes))


def _scheme_bound(scenario: Scenario, truth: Array, variance: Array) -> Array:
    """Return standard deviations ``(n, K, S)`` from the truth and the variances it was seen with.

    Process noise counts as nature has it, not as the filter believes in it: without any
    (``truth.process_noise``) only the measurements' noise is left. The information is averaged
    over the trials' beams, so the bound also holds for designs that depend on measurements.
    """
    uav, settings = scenario.uav, scenario.filter
    path = uav_path(
        uav.height, uav.speed, uav.heading, scenario.frame.slot, truth.shape[1], uav.floor
    )
    speed, heading = path.speed[:, None], path.heading[:, None]
    G = evolution_jacobian(truth[:, :-1], speed[:-1], heading[:-1], scenario.frame.slot, "exact")
    H = measurement_jacobian(truth, speed, heading, scenario.radio.carrier)
    believed = np.diag([settings.angle_std, settings.distance_std, settings.velocity_std]) ** 2
    process = believed if scenario.truth.process_noise else np.zeros((3, 3))
    prior = np.zeros((truth.shape[2], 3, 3))
    if settings.velocity_prior > 0:
        prior[:, 2, 2] = settings.velocity_prior**-2
    covariance = posterior_bound(G, process, H, variance, prior)
    squares = np.diagonal(covariance, axis1=-2, axis2=-1)
    deviations: Array = np.sqrt(np.where(np.isfinite(squares), squares, np.nan))
    return deviations
