"""The posterior Cramer-Rao bound of a run: what no filter could beat on its measurements.

The recursion needs three expectations over the trials. They are sums, so that blocks of trials
can be added up without being kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from echobeam.estimation.bound import information_bound, measured_information, motion_square
from echobeam.physics.motion import uav_path
from echobeam.scenario.model import Scenario
from echobeam.tracking.evolution import evolution_jacobian
from echobeam.tracking.measurement import measurement_jacobian
from echobeam.values import Array

if TYPE_CHECKING:
    import xarray as xr

CHUNK = 256

TERMS = ("information", "motion", "motion_square", "predictions")
"""What the bound is made of, each with a leading axis of schemes."""

Arrays = Mapping[str, npt.NDArray[np.generic]]


def with_bound(result: xr.Dataset, scenario: Scenario) -> xr.Dataset:
    """Return the result with the variable ``bound`` (scheme, slot, object, state).

    It holds standard deviations in rad, m and m/s: NaN before the measurements determine the
    state, and for a scheme without doubtful predictions (a held estimate is biased, a genie needs
    no measurement; the bound is not for them). A result of a trace is returned as it is: its
    objects come and go, and the recursion would have to begin anew with every one.
    """
    if scenario.trace is not None or result.sizes["object"] == 0:
        return result
    total: dict[str, Array] = {}
    for first in range(0, result.sizes["trial"], CHUNK):
        part = result.isel(trial=slice(first, first + CHUNK))
        arrays = {name: _laid_out(part[name]) for name in ("truth", "measured_var")}
        arrays["predicted_cov"] = _laid_out(part["predicted_cov"])
        terms = bound_terms(arrays, scenario)
        total = {name: terms[name] + total.get(name, 0.0) for name in terms}
    bounds = np.stack(
        [
            bound_of({name: values[index] for name, values in total.items()}, scenario)
            for index in range(result.sizes["scheme"])
        ]
    )
    attributes = {"units": "rad, m, m/s", "long_name": "posterior Cramer-Rao bound (std)"}
    return result.assign(bound=(("scheme", "slot", "object", "state"), bounds, attributes))


def bound_terms(arrays: Arrays, scenario: Scenario) -> dict[str, Array]:
    """Return sums over some trials from which `bound_of` makes the bound; none of a trace.

    Parameters
    ----------
    arrays
        ``truth``, ``measured_var`` and ``predicted_cov``, laid out as in the result file.
    scenario
        What was run.

    Returns
    -------
    dict
        `TERMS`: ``information`` (scheme, slot, object, state, state), the sum of H^T R^-1 H;
        ``motion`` and ``motion_square`` (scheme, slot - 1, object, state, state), the sums of G
        and of G^T Q^-1 G on the truth; ``predictions`` (scheme, 2), the number of predictions
        with positive variances and of trials.
    """
    if scenario.trace is not None:
        return {}
    truth = np.asarray(arrays["truth"], dtype=np.float64)
    variance = np.asarray(arrays["measured_var"], dtype=np.float64)
    uav, trials, schemes = scenario.uav, len(truth), len(variance)
    path = uav_path(
        uav.height, uav.speed, uav.heading, scenario.frame.slot, truth.shape[1], uav.floor
    )
    speed, heading = path.speed[:, None], path.heading[:, None]
    G = evolution_jacobian(truth[:, :-1], speed[:-1], heading[:-1], scenario.frame.slot, "exact")
    H = measurement_jacobian(truth, speed, heading, scenario.radio.carrier)
    doubt = np.diagonal(np.asarray(arrays["predicted_cov"], dtype=np.float64), axis1=-2, axis2=-1)
    doubtful = (doubt > 0).all(axis=-1).sum(axis=(1, 2, 3))
    alike = {"motion": G.sum(axis=0), "motion_square": motion_square(G, _process(scenario))}
    return {
        "information": np.stack([measured_information(H, one) for one in variance]),
        **{name: np.stack([values] * schemes) for name, values in alike.items()},
        "predictions": np.stack([doubtful, np.full(schemes, trials)], axis=-1).astype(float),
    }


def bound_of(terms: Mapping[str, Array], scenario: Scenario) -> Array:
    """Return one scheme's bound, standard deviations ``(slot, object, state)``.

    Process noise counts as nature has it, not as the filter believes in it: without any
    (``truth.process_noise``) only the measurements' noise is left. The information is averaged
    over the trials' beams, so the bound also holds for designs that depend on measurements.

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
        return np.full((*information.shape[:2], 3), np.nan)
    F, Q = terms["motion"] / trials, _process(scenario)
    # E[(G - F)^T Q^-1 (G - F)] from sums that can be added up; zero without process noise.
    scatter = terms["motion_square"] / trials - motion_square(F[None], Q)
    prior = np.zeros((information.shape[1], 3, 3))
    if scenario.filter.velocity_prior > 0:
        prior[:, 2, 2] = scenario.filter.velocity_prior**-2
    covariance = information_bound(information / trials, F, scatter, Q, prior)
    squares = np.diagonal(covariance, axis1=-2, axis2=-1)
    deviations: Array = np.sqrt(np.where(np.isfinite(squares), squares, np.nan))
    return deviations


def _process(scenario: Scenario) -> Array:
    """Return the covariance of the process noise that nature has, ``(3, 3)``."""
    settings = scenario.filter
    if not scenario.truth.process_noise:
        return np.zeros((3, 3))
    noise: Array = np.diag([settings.angle_std, settings.distance_std, settings.velocity_std]) ** 2
    return noise


def _laid_out(variable: xr.DataArray) -> Array:
    """Return a variable's values with its axes in the file's order."""
    order = ("scheme", "trial", "slot", "object", "state", "state_b", "measurement")
    values: Array = variable.transpose(*(name for name in order if name in variable.dims)).values
    return values
