"""Posterior Cramer-Rao bound of a run in which the UAV knows its height, to its accuracy.

The bound of `echobeam.simulation.bound` has angle, distance and velocity as three unknowns. An
object on the road has two, position and velocity, and the height over its ground is a third that
is known before, to ``uav.altimeter_std`` and ``uav.terrain_std``. So angle and distance come from
one number, which delay and height tell many times better than the angle does. The recursion is
the same (Tichavsky et al.), on states (x, v, b), with the information

    J_0 = diag(0, sigma_v^-2, sigma_b^-2)

before the first measurement; the bounds of angle, distance and velocity follow by their Jacobian.
As there, the variances of measurements count as given constants.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from echobeam.estimation.bound import information_bound, measured_information
from echobeam.faults import InputError
from echobeam.scenario.model import Scenario
from echobeam.tracking.ground import ROAD, GroundMeasurement, GroundMotion, polar_of
from echobeam.values import Array, UavState


def ground_bound(result: xr.Dataset, scenario: Scenario, scheme: str) -> Array:
    """Return bounds of the standard deviation of angle, distance, velocity, ``(n, K, 3)``.

    Parameters
    ----------
    result
        A labelled run of objects that are there from the first slot to the last, without process
        noise; the variances with which nature drew the scheme's measurements are in it.
    scenario
        What was run.
    scheme
        Name of the scheme.

    Returns
    -------
    Array
        rad, m, m/s; infinite before a first measurement.

    Raises
    ------
    InputError
        If objects come and go, detections are unlabelled, or nature adds process noise.
    """
    there = bool(result["present"].values.all())
    if scenario.unlabelled or scenario.truth.process_noise or not there:
        raise InputError(
            "the bound with known height is for labelled runs without process noise, of objects "
            "that are there in every slot"
        )
    trial = result.isel(trial=0).transpose("slot", "object", "axis", ...)
    position, state = trial["position"].values, trial["truth"].transpose("slot", ..., "state")
    x, v = position[..., 0], state.values[..., 2]
    truth = np.stack([x, v, np.zeros_like(x)], axis=-1)
    at = [
        UavState(position, velocity)
        for position, velocity in zip(
            result["uav_position"].values, result["uav_velocity"].values, strict=True
        )
    ]
    model = GroundMeasurement(scenario.radio.carrier)
    H = np.stack([model.jacobian(one, uav) for one, uav in zip(truth, at, strict=True)])
    drawn = result["true_var"].sel(scheme=scheme)
    variance = drawn.transpose("trial", "slot", "object", "measurement").values
    information = measured_information(H, variance) / len(variance)
    motion = GroundMotion(scenario.frame.slot, 0.0)
    F = np.stack([motion.jacobian(one, uav) for one, uav in zip(truth, at, strict=True)])[1:]
    stds = scenario.filter.new_velocity_std, scenario.uav.altitude_std
    prior = np.diag([0.0, *(std**-2 for std in stds)])
    nothing = np.zeros((ROAD.size, ROAD.size))
    covariance = information_bound(information, F, np.zeros_like(F), nothing, prior)
    seen = np.stack([_polar_jacobian(one, uav) for one, uav in zip(truth, at, strict=True)])
    square = seen @ covariance @ np.swapaxes(seen, -1, -2)
    deviations: Array = np.sqrt(np.diagonal(square, axis1=-2, axis2=-1))
    return deviations


def _polar_jacobian(state: Array, uav: UavState) -> Array:
    """Return the derivative of angle, distance and velocity by (x, v, b), ``(K, 3, 3)``."""
    theta, d, _ = np.moveaxis(polar_of(state, uav), -1, 0)
    zero, one = np.zeros_like(d), np.ones_like(d)
    rows = [
        np.stack([-np.sin(theta) / d, zero, np.cos(theta) / d], axis=-1),
        np.stack([np.cos(theta), zero, np.sin(theta)], axis=-1),
        np.stack([zero, one, zero], axis=-1),
    ]
    return np.stack(rows, axis=-2)
