"""The extended Kalman filter as two pure functions of a model, Eqs. (39)-(49)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.brief import Brief
from echobeam.estimation import gaussian
from echobeam.tracking.life import living
from echobeam.tracking.models import MeasurementModel, MotionModel
from echobeam.values import Array, BoolArray, GaussianState, StateSpace, UavState


@dataclass(frozen=True, slots=True, repr=False)
class Update(Brief):
    """Posterior of a slot, and what gating, association and consistency need besides.

    Attributes
    ----------
    state
        The posterior.
    innovation
        ``(..., K, M)``: measured minus expected, angles wrapped; NaN where not measured.
    prior_cov, jacobian, variance
        ``(..., K, S, S)``, ``(..., K, M, S)``, ``(..., K, M)``: P, H and the diagonal of R.
    """

    state: GaussianState
    innovation: Array
    prior_cov: Array
    jacobian: Array
    variance: Array

    @property
    def innovation_cov(self) -> Array:
        """Covariance of the innovation, H P H^T + R of all components, ``(..., K, M, M)``.

        The diagonal is infinite where a component was not measured; all is NaN for an unknown
        object. It is computed at each access, so that an update alone does not pay for it.
        """
        noise = np.where(self._measured, self.variance, np.inf)
        return gaussian.innovation_cov(self.prior_cov, self.jacobian, noise)

    @property
    def log_likelihood(self) -> Array:
        """Logarithm of the density of the measured components given the prior, ``(..., K)``.

        It is 0 where nothing was measured, and for an unknown object; NaN where the innovation's
        covariance is singular to working precision. It is computed at each access.
        """
        measured = self._measured
        error = np.where(measured, self.innovation, 0.0)
        density = gaussian.log_density(error, self.innovation_cov)
        return np.where(measured.any(axis=-1), density, 0.0)

    @property
    def _measured(self) -> BoolArray:
        measured: BoolArray = np.isfinite(self.innovation) & np.isfinite(self.variance)
        return measured


def predict(state: GaussianState, motion: MotionModel, uav: UavState) -> GaussianState:
    """Return the prior of the next slot, Eqs. (44)-(46).

    Parameters
    ----------
    state
        Posterior of this slot; an unknown object stays unknown.
    motion
        The motion model.
    uav
        The UAV in this slot, until the next.

    Returns
    -------
    GaussianState
        A track whose predicted state is not possible in the model's state space is given up.
    """
    with np.errstate(all="ignore"):  # a lost track may pass through the UAV; it is given up below
        mean = motion.step(state.mean, uav)
        cov = gaussian.propagate(state.cov, motion.jacobian(state.mean, uav), motion.noise())
    return living(mean, cov, state.known, motion.space)


def update(
    prior: GaussianState,
    value: Array,
    variance: Array,
    model: MeasurementModel,
    uav: UavState,
    space: StateSpace,
) -> Update:
    """Return the posterior of a slot, Eqs. (47)-(49), with H of Eq. (45) at the prior.

    Parameters
    ----------
    prior
        Prediction of the slot; an unknown object stays unknown.
    value, variance
        ``(..., K, M)``: the measurement, NaN, and its variance, infinite where a component was
        not measured. Such a component changes nothing; an object of which nothing was measured
        keeps its prior in every bit.
    model
        The measurement model.
    uav
        The UAV in the slot.
    space
        State space of the prior, which says what is possible.

    Returns
    -------
    Update
        A track whose state has become impossible is given up, as in `predict`.
    """
    with np.errstate(all="ignore"):  # unknown objects and infinite values; given up or unused below
        innovation = model.residual(value, model.expected(prior.mean, uav))
        H = model.jacobian(prior.mean, uav)
        mean, cov = gaussian.update(prior.mean, prior.cov, innovation, H, variance)
    state = living(mean, cov, prior.known, space)
    return Update(state, innovation, prior.cov, H, variance)
