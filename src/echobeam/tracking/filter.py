"""The extended Kalman filter of the paper as two pure functions, Eqs. (39)-(49)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echobeam.estimation import gaussian
from echobeam.tracking.evolution import Evolution, evolution_jacobian, evolve
from echobeam.tracking.life import living
from echobeam.tracking.measurement import innovation, measurement_jacobian
from echobeam.values import Array, GaussianState, Measurement, UavMotion


def predict(
    state: GaussianState,
    uav: UavMotion,
    slot_duration: float,
    process_std: Array,
    kind: Evolution = "paper",
) -> GaussianState:
    """Return the prior of the next slot, Eqs. (44)-(46).

    Parameters
    ----------
    state
        Posterior of this slot; an unknown object stays unknown.
    uav
        The UAV's motion from this slot to the next.
    slot_duration
        DT, s.
    process_std
        ``(3,)`` rad, m, m/s: standard deviations of the process noise per slot, Eq. (40).
    kind
        Evolution model, see `evolution.evolve`.

    Returns
    -------
    GaussianState
        A track whose predicted state is impossible (angle not in (0, pi), distance not
        positive, not finite) is given up.
    """
    motion = uav.speed, uav.heading, slot_duration, kind
    with np.errstate(all="ignore"):  # a lost track may pass through the UAV; it is given up below
        mean = evolve(state.mean, *motion)
        G = evolution_jacobian(state.mean, *motion)
        cov = gaussian.propagate(state.cov, G, np.diag(np.square(process_std)))
    return living(mean, cov, state.known)


def predict_steps(
    state: GaussianState,
    uavs: Sequence[UavMotion],
    slot_duration: float,
    process_std: Array,
    kind: Evolution = "paper",
) -> list[GaussianState]:
    """Return the predictions of the next slots without any measurement in between.

    Parameters
    ----------
    state
        Posterior of this slot.
    uavs
        The UAV's motion in each step, one per slot to predict.
    slot_duration, process_std, kind
        As in `predict`.

    Returns
    -------
    list of GaussianState
        One for each element of ``uavs``; the last is the prior of the slot ``len(uavs)`` ahead.
    """
    predictions: list[GaussianState] = []
    for uav in uavs:
        state = predict(state, uav, slot_duration, process_std, kind)
        predictions.append(state)
    return predictions


def update(
    prior: GaussianState, measurement: Measurement, uav: UavMotion, carrier: float
) -> GaussianState:
    """Return the posterior of a slot, Eqs. (47)-(49), with H of Eq. (45) at the prior.

    Parameters
    ----------
    prior
        Prediction of the slot; an unknown object stays unknown.
    measurement
        What the radar gave. A component that was not measured changes nothing; an object of
        which nothing was measured keeps its prior in every bit.
    uav
        The UAV's motion in the slot.
    carrier
        f_c, Hz.

    Returns
    -------
    GaussianState
        A track whose state has become impossible is given up, as in `predict`.
    """
    with np.errstate(all="ignore"):  # unknown objects and infinite values; given up or unused below
        mean, cov = gaussian.update(
            prior.mean,
            prior.cov,
            innovation(prior.mean, measurement, uav, carrier),
            measurement_jacobian(prior.mean, uav.speed, uav.heading, carrier),
            measurement.variance,
        )
    return living(mean, cov, prior.known)
