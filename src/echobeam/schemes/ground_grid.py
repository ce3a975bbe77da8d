"""Posterior of known objects on grids of positions, refined where a few points do not tell it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from echobeam.schemes.base import View
from echobeam.schemes.ground_echoes import Echoes, law_on
from echobeam.tracking import road_grid
from echobeam.tracking.ground import GroundMeasurement
from echobeam.tracking.road_grid import PositionGrid
from echobeam.tracking.road_shape import POINTS, REACH, Shape, shape_of
from echobeam.values import Array, BoolArray, GaussianState, IntArray, Transmission

ROUGH = 1.0
"""Mean change of log R from point to point above which a grid is refined.

Near a null of a beam the variance changes by orders of magnitude between few points."""

MISS = 1e-3
"""Probability that a refined grid misses where an echo is from: a null between two points."""

MISSED = 1e4
"""Variance of such an echo over that of a point."""


@dataclass(frozen=True, slots=True)
class OnGrid:
    """Posterior on a grid.

    Attributes
    ----------
    mean, cov
        ``(T, K, S)``, ``(T, K, S, S)``: moments.
    variance
        ``(T, K, M)``: that of mean information, infinite where a component was not measured.
    fine
        ``(T, K)``: the grid resolves the posterior.
    rough
        ``(T, K)``: a finer grid is called for.
    shape
        Shape of the position's density.
    """

    mean: Array
    cov: Array
    variance: Array
    fine: BoolArray
    rough: BoolArray
    shape: Shape

    def replaced(self, chosen: BoolArray, other: OnGrid) -> OnGrid:
        """Return it with some objects ``(T, K)`` of another, ``(M, 1)``."""
        made = []
        for own, of_other in (
            (self.mean, other.mean),
            (self.cov, other.cov),
            (self.variance, other.variance),
        ):
            made.append(own.copy())
            made[-1][chosen] = of_other[:, 0]
        fine, rough = self.fine.copy(), self.rough.copy()
        fine[chosen], rough[chosen] = other.fine[:, 0], other.rough[:, 0]
        mean, cov, variance = made
        shape = self.shape.placed(chosen, other.shape[:, 0])
        return OnGrid(mean, cov, variance, fine, rough, shape)


def grid_posterior(
    prior: GaussianState,
    shape: Shape | None,
    echoes: Echoes,
    model: GroundMeasurement,
    view: View,
    points: int,
) -> OnGrid:
    """Return the posterior of known objects.

    Parameters
    ----------
    prior
        Prediction of the slot.
    shape
        That of the prediction; None if all are Gaussian.
    echoes, model, view
        What was measured, and by what law.
    points
        Of the first grid.
    """
    first = road_grid.grid_of(prior, points, REACH)
    found = _on_grid(first, [law_on(first, echoes, view)], [1.0], echoes, model, view)
    again = found.rough
    if shape is not None:
        again = again | shape.bent
    again = np.asarray(again & prior.known)
    if not again.any():
        return found
    # each of these objects as if it were a trial of its own
    there, seen = view_of(view, np.nonzero(again)[0]), echoes.of_objects(again)
    some = GaussianState(
        prior.mean[again][:, None], prior.cov[again][:, None], prior.known[again][:, None]
    )
    if shape is None:
        grid = road_grid.grid_of(some, POINTS, REACH)
    else:
        own = shape[again]
        grid = road_grid.grid_of(some, POINTS, own.reach[:, None])
        grid = replace(grid, log_prior=grid.log_prior + own.log_ratio[:, None])
    laws = [law_on(place, seen, there) for place in road_grid.at_heights(grid)]
    laws.append(MISSED * laws[0])
    shares = [*((1.0 - MISS) * share for share in road_grid.HEIGHT_SHARES), MISS]
    return found.replaced(again, _on_grid(grid, laws, shares, seen, model, there))


def view_of(view: View, trials: BoolArray | IntArray) -> View:
    """Return the view with the transmission of some trials alone."""
    sent = view.sent
    if sent is None:
        return view
    some = Transmission(sent.beams[trials], sent.antenna_power[trials], sent.probing[trials])
    return replace(view, sent=some)


def _on_grid(
    grid: PositionGrid,
    laws: Sequence[Array],
    shares: Sequence[float],
    echoes: Echoes,
    model: GroundMeasurement,
    view: View,
) -> OnGrid:
    """Return the posterior on a grid, for several laws of known probability at each point."""
    many, law = road_grid.mixed(grid, shares), np.concatenate(laws, axis=-2)
    weight, mean, cov = road_grid.posterior(many, echoes.value, law, model, view.uav)
    variance = road_grid.effective_variance(weight, law)
    weight = weight.reshape(*weight.shape[:-1], len(laws), -1).sum(axis=-2)
    fine = road_grid.resolved(grid, cov)
    shape = shape_of(grid, weight, mean, cov).where(fine)
    rough = road_grid.roughness(weight, laws[0]) > ROUGH
    return OnGrid(
        mean,
        cov,
        np.where(np.isfinite(echoes.value), variance, np.inf),
        fine,
        np.asarray(rough | shape.bent),
        shape,
    )
