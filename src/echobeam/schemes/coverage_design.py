"""From a belief to the beams that cover its uncertainty: problem (38) for a block of trials."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.problem import ProblemBatch
from echobeam.schemes.base import System, View
from echobeam.values import Array, BoolArray, ComplexArray, GaussianState


def coverage_halfwidth(state: GaussianState, view: View) -> Array:
    """Return ``(..., K)`` rad: l sigma_theta of (38f), at most the scenario's widest coverage.

    The paper's sigma_theta is the bound of the last measurement; ``coverage.spread =
    "posterior"`` takes the state's own standard deviation instead.
    """
    coverage = view.system.coverage
    if coverage.spread == "posterior":
        spread = np.sqrt(np.maximum(state.cov[..., 0, 0], 0.0))
    else:
        spread = view.spread
    return np.minimum(coverage.width * spread, coverage.max_halfwidth)


def problems_at(
    angle: Array,
    distance: Array,
    halfwidth: Array,
    active: BoolArray,
    system: System,
    *,
    min_rate: float,
    warm_start: ComplexArray | None = None,
) -> ProblemBatch:
    """Return problem (38) for a block of trials, ``(T, K)`` objects each."""
    n_objects = angle.shape[-1]
    return ProblemBatch(
        angles=angle,
        distances=distance,
        coverage_halfwidths=halfwidth,
        active=active,
        ripple=np.full(n_objects, system.ripple),
        min_rate=np.full(n_objects, min_rate),
        power=system.radio.power,
        noise=system.radio.noise,
        n_tx=system.array.n_tx,
        alpha0=system.radio.alpha0,
        spacing=system.array.spacing,
        axis=system.array.axis,
        resolution=system.coverage.resolution,
        warm_start=warm_start,
    )


def problems_for(
    state: GaussianState, view: View, warm_start: ComplexArray | None = None
) -> ProblemBatch:
    """Return the problems of serving a belief's known objects and covering their uncertainty."""
    halfwidth = coverage_halfwidth(state, view)
    return problems_at(
        state.mean[..., 0],
        state.mean[..., 1],
        halfwidth,
        state.known & np.isfinite(halfwidth),
        view.system,
        min_rate=view.system.coverage.min_rate,
        warm_start=warm_start,
    )
