"""Interacting multiple models: several motions, each with a Gaussian belief and a probability.

Before a slot every model starts from a mixture of all beliefs, as a Markov chain of the models
says; after it the probabilities follow the likelihoods (Blom and Bar-Shalom, "The interacting
multiple model algorithm for systems with Markovian switching coefficients", IEEE Trans. Automatic
Control 33, 1988). All models share one state space; what a model does not have is a component
of known law in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echobeam.values import Array


def mixing(probability: Array, transition: Array) -> tuple[Array, Array]:
    """Return the predicted probabilities and those of the model before, given the one after.

    Parameters
    ----------
    probability
        ``(..., M)`` of the models.
    transition
        ``(M, M)``: row i has the probabilities of the next model after model i.

    Returns
    -------
    predicted, origin
        ``(..., M)``, and ``(..., M, M)``: column j sums to 1 over the model i before.
    """
    joint = probability[..., :, None] * transition
    predicted = joint.sum(axis=-2)
    with np.errstate(invalid="ignore"):
        origin = joint / np.where(predicted == 0.0, 1.0, predicted)[..., None, :]
    return predicted, origin


def combined(weight: Array, mean: Array, cov: Array) -> tuple[Array, Array]:
    """Return mean and covariance of a mixture of Gaussians.

    Parameters
    ----------
    weight
        ``(..., M)``, of sum 1.
    mean, cov
        ``(..., M, S)`` and ``(..., M, S, S)``.
    """
    centre = (weight[..., None] * mean).sum(axis=-2)
    off = mean - centre[..., None, :]
    spread = cov + off[..., :, None] * off[..., None, :]
    return centre, (weight[..., None, None] * spread).sum(axis=-3)


def interacted(
    origin: Array, mean: Array, cov: Array, entries: Sequence[Array]
) -> tuple[Array, Array]:
    """Return the beliefs from which each model starts.

    Parameters
    ----------
    origin
        ``(..., M, M)`` of `mixing`.
    mean, cov
        ``(..., M, S)`` and ``(..., M, S, S)``: the models' posteriors.
    entries
        M covariances ``(S, S)``: added to the belief of another model that is taken over, for
        components that the other model does not have.
    """
    means, covs = [], []
    for j, entry in enumerate(entries):
        own = (np.arange(len(entries)) == j)[:, None, None]
        one, spread = combined(origin[..., :, j], mean, cov + np.where(own, 0.0, entry))
        means.append(one)
        covs.append(spread)
    return np.stack(means, axis=-2), np.stack(covs, axis=-3)


def reweighted(predicted: Array, log_likelihood: Array) -> Array:
    """Return the probabilities ``(..., M)`` after a measurement; the predicted if none is likely.

    Parameters
    ----------
    predicted
        ``(..., M)`` of `mixing`.
    log_likelihood
        ``(..., M)``: of the measurement under each model; NaN or 0 where there is none.
    """
    with np.errstate(all="ignore"):
        log = np.log(predicted) + log_likelihood
        weight = np.exp(log - log.max(axis=-1, keepdims=True))
        weight = weight / weight.sum(axis=-1, keepdims=True)
    return np.where(np.isfinite(weight).all(axis=-1, keepdims=True), weight, predicted)
