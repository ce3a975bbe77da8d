"""Posterior Cramer-Rao bound of a run, for measurement variances taken as given.

The recursion needs three expectations over the trials. They are sums, so that blocks of trials
can be added up without being kept.

The information of a measurement is H^T R^-1 H with the variance R that nature drew it with, as a
given constant: the bound is one on filters that are told R. R depends on the state, steeply where
a narrow beam misses its object, so that a filter which uses the law of R may lie below it.

The bound is one on unbiased estimates, the Jacobians taken on the truth. An object that was not
measured in a slot has a prediction there, and none of the bound: from the first velocity, which
the paper's pulse leaves open to 1,300 m/s, a prediction is bent, for the angle cannot leave its
half-circle, and after nine slots its RMSE is 0.77 of the linear bound (``pilot-predict`` in
``paper-multi``; 1.00 with 30 dB more power).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from echobeam.estimation.bound import information_bound, measured_information, motion_square
from echobeam.physics.geometry import along_road_variance
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import geometry_of
from echobeam.schemes.models import exact_motion, measurement_model, velocity_prior_of
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.tracking.ground import GroundMotion
from echobeam.values import Array, UavState

if TYPE_CHECKING:
    import xarray as xr

CHUNK = 256

BOUND_NEEDS = ("truth", "true_var", "predicted_cov", "estimated", "uav_velocity")
"""Variables of a result that the bound is made of; on the ground also ``uav_position``."""

TERMS = ("information", "motion", "motion_square", "predictions", "estimates")
"""What the bound is made of, each with a leading axis of schemes."""

Arrays = Mapping[str, npt.NDArray[np.generic]]


def with_bound(result: xr.Dataset, scenario: Scenario) -> xr.Dataset:
    """Return the result with the variable ``bound`` (scheme, slot, object, state).

    It holds standard deviations in rad, m and m/s: NaN before the measurements determine the
    state, where an object is not measured, and for a scheme without doubtful predictions (a held
    estimate is biased, a genie needs no measurement; the bound is not for them). A result of a
    trace is returned as it is: its objects come and go, and the recursion would have to begin anew
    with every one.
    """
    if scenario.trace is not None or result.sizes["object"] == 0:
        return result
    total: dict[str, Array] = {}
    for first in range(0, result.sizes["trial"], CHUNK):
        part = result.isel(trial=slice(first, first + CHUNK))
        arrays = {name: _laid_out(part[name]) for name in (*BOUND_NEEDS, "uav_position")}
        terms = bound_terms(arrays, scenario)
        total = {name: terms[name] + total.get(name, 0.0) for name in terms}
    bounds = np.stack(
        [
            bound_of({name: values[index] for name, values in total.items()}, scenario)
            for index in range(result.sizes["scheme"])
        ]
    )
    units = ", ".join(geometry_of(scenario).space.units)
    attributes = {"units": units, "long_name": "posterior Cramer-Rao bound (std)"}
    return result.assign(bound=(("scheme", "slot", "object", "state"), bounds, attributes))


def flown(arrays: Arrays) -> UavState:
    """Return the UAV in every slot, for arrays ``(..., slot, object)``: ``(slot, 1, 3)`` each.

    A road's states are relative to it, so that its position is not needed there.
    """
    velocity = np.asarray(arrays["uav_velocity"], dtype=np.float64)
    position = np.asarray(arrays.get("uav_position", np.zeros_like(velocity)), dtype=np.float64)
    return UavState(position[:, None], velocity[:, None])


def bound_terms(arrays: Arrays, scenario: Scenario) -> dict[str, Array]:
    """Return sums over some trials from which `bound_of` makes the bound; none of a trace.

    Parameters
    ----------
    arrays
        `BOUND_NEEDS`, laid out as in the result file.
    scenario
        What was run.

    Returns
    -------
    dict
        `TERMS`: ``information`` (scheme, slot, object, state, state), the sum of H^T R^-1 H;
        ``motion`` and ``motion_square`` (scheme, slot - 1, object, state, state), the sums of G
        and of G^T Q^-1 G on the truth; ``predictions`` (scheme, 2), the number of predictions
        with positive variances and of trials; ``estimates`` (scheme, slot, object), of unlabelled
        detections the number of trials with a track of the object, else of all.
    """
    if scenario.trace is not None:
        return {}
    truth = np.asarray(arrays["truth"], dtype=np.float64)
    variance = np.asarray(arrays["true_var"], dtype=np.float64)
    trials, schemes = len(truth), len(variance)
    uav, geometry = flown(arrays), geometry_of(scenario)
    G = exact_motion(geometry, scenario.frame.slot).jacobian(
        truth[:, :-1], UavState(uav.position[:-1], uav.velocity[:-1])
    )
    H = measurement_model(geometry, scenario.radio.carrier).jacobian(truth, uav)
    doubt = np.diagonal(np.asarray(arrays["predicted_cov"], dtype=np.float64), axis1=-2, axis2=-1)
    doubtful = (doubt > 0).all(axis=-1).sum(axis=(1, 2, 3))
    alike = {
        "motion": G.sum(axis=0),
        "motion_square": motion_square(G, _process(scenario, truth.shape[1])),
    }
    tracked = np.isfinite(np.asarray(arrays["estimated"])[..., 0]).sum(axis=1).astype(float)
    unlabelled = scenario.unlabelled
    return {
        "information": np.stack([measured_information(H, one) for one in variance]),
        **{name: np.stack([values] * schemes) for name, values in alike.items()},
        "predictions": np.stack([doubtful, np.full(schemes, trials)], axis=-1).astype(float),
        "estimates": tracked if unlabelled else np.full(tracked.shape, float(trials)),
    }


def bound_of(terms: Mapping[str, Array], scenario: Scenario) -> Array:
    """Return one scheme's bound, standard deviations ``(slot, object, state)``.

    Process noise counts as nature has it, not as the filter believes in it: without any
    (``truth.process_noise``) only the measurements' noise is left. The information is averaged
    over the trials' beams, so the bound also holds for designs that depend on measurements. Without
    labels trials find an object at different times; those without a track of it have no
    information, and no error either, so that the average is over those with one.

    Parameters
    ----------
    terms
        What `bound_terms` gives, of one scheme: without its leading axis.
    scenario
        What was run.
    """
    information = terms["information"]
    predictions, trials = terms["predictions"]
    if predictions == 0:
        return np.full(information.shape[:3], np.nan)
    F, Q = terms["motion"] / trials, _process(scenario, len(information))
    # E[(G - F)^T Q^-1 (G - F)] from sums that can be added up; zero without process noise.
    scatter = terms["motion_square"] / trials - motion_square(F[None], Q)
    # An object that is not there yet waits, and what is known of its velocity stays known.
    absent = ~np.isfinite(F).all(axis=(-2, -1), keepdims=True)
    F, scatter = np.where(absent, np.eye(F.shape[-1]), F), np.where(absent, 0.0, scatter)
    prior = np.zeros(information.shape[1:])
    velocities = [2] if scenario.geometry == "road" else [2, 3]
    velocity_prior = velocity_prior_of(scenario.geometry, scenario.filter)
    if velocity_prior > 0:
        prior[:, velocities, velocities] = velocity_prior**-2
    covariance = information_bound(information / trials, F, scatter, Q, prior)
    squares = np.diagonal(covariance, axis1=-2, axis2=-1)
    measured = np.diagonal(information, axis1=-2, axis2=-1).sum(axis=-1, keepdims=True) > 0
    share = (terms["estimates"] / trials)[..., None]
    bounded = measured & (share > 0) & np.isfinite(squares)
    deviations: Array = np.sqrt(share * np.where(bounded, squares, np.nan))
    return deviations


def _process(scenario: Scenario, n_slots: int) -> Array:
    """Return the covariance of nature's process noise, ``(n - 1, K, S, S)``; zero if it adds none.

    Nature moves the object along the road; in angle and distance this noise has one direction,
    (-sin(theta) / d, cos(theta)). It is taken along the motion without noise, which is the same
    for all trials.
    """
    size = geometry_of(scenario).space.size
    if not scenario.truth.process_noise:
        return np.zeros((size, size))
    if scenario.geometry == "ground":
        motion = GroundMotion(scenario.frame.slot, scenario.truth_stds[2], 2, known_height=True)
        return np.broadcast_to(motion.noise(), (n_slots - 1, scenario.n_objects, size, size))
    angle_std, distance_std, velocity_std = scenario.truth_stds
    covariances = np.zeros((n_slots - 1, scenario.n_objects, 3, 3))
    world = begin(scene_of(scenario.calm), 0, range(1))
    for slot in range(n_slots - 1):
        theta, d = world.state[0, :, 0], world.state[0, :, 1]
        along = np.sqrt(along_road_variance(world.state[0], (angle_std, distance_std)))
        column = np.stack([-np.sin(theta) / d, np.cos(theta), np.zeros_like(d)], axis=-1)
        column = column * along[:, None]
        covariances[slot] = column[:, :, None] * column[:, None, :]
        covariances[slot, :, 2, 2] = velocity_std**2
        covariances[slot, ~world.present] = 0.0
        world = world.advance()
    return covariances


def _laid_out(variable: xr.DataArray) -> Array:
    """Return a variable's values with its axes in the file's order."""
    order = ("scheme", "trial", "slot", "object", "state", "state_b", "measurement", "axis")
    values: Array = variable.transpose(*(name for name in order if name in variable.dims)).values
    return values
