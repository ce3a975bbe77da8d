"""How long schemes take to decide on a slot's beams: measured, and kept out of every result.

A time is no number that the same seed gives again. So it travels in the blocks of a run under a
name of its own, which neither digests nor result files take up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from echobeam.schemes.base import Scheme, View
from echobeam.values import Array, GaussianState, Measurement

SECONDS = "timing:decision"
"""Name in a block of ``(scheme, slot)`` s per trial; NaN in slots without a decision."""


@dataclass(frozen=True, slots=True)
class DecisionTime:
    """Seconds that a scheme takes to decide on one trial's beams of one slot.

    Attributes
    ----------
    mean, p99
        Mean and 99th percentile over directional slots and blocks of trials, of a block's time
        divided by its trials; NaN for a scheme without directional slots.
    """

    mean: float
    p99: float


Decisions = dict[str, DecisionTime]
"""By scheme."""


def decision_times(blocks: Sequence[Array], names: Sequence[str]) -> Decisions:
    """Return what the times of some blocks, ``(scheme, slot)`` each, come to."""
    return {
        name: _summary(seconds[np.isfinite(seconds)])
        for name, seconds in zip(names, np.stack(blocks, axis=1), strict=True)
    }


def _summary(seconds: Array) -> DecisionTime:
    if not seconds.size:
        return DecisionTime(np.nan, np.nan)
    return DecisionTime(float(seconds.mean()), float(np.quantile(seconds, 0.99)))


_rehearsed: set[str] = set()


def rehearse(scheme: Scheme, prior: GaussianState, view: View) -> None:
    """Let a built-in scheme's first decision in a process be one for a single trial, not timed.

    What it takes to load or compile a solver, once, is no part of a slot's decision. Users' schemes
    are asked once per slot and no more.
    """
    if scheme.name in _rehearsed or type(scheme).__module__ not in _BUILT_IN:
        return
    _rehearsed.add(scheme.name)
    scheme.beamform(_first(prior), _first_of_view(view))


_BUILT_IN = frozenset(
    f"echobeam.schemes.{name}" for name in ("temporal", "pilot", "water_filling", "genie")
)


def _first(state: GaussianState) -> GaussianState:
    return GaussianState(state.mean[:1], state.cov[:1], state.known[:1])


def _first_of_view(view: View) -> View:
    """Return what a scheme sees of the first trial, with nothing remembered."""
    return replace(
        view,
        posterior=_first(view.posterior),
        measurement=Measurement(view.measurement.value[:1], view.measurement.variance[:1]),
        spread=view.spread[:1],
        memory=None,
        truth=None if view.truth is None else view.truth[:1],
        present=None if view.present is None else view.present[:1],
    )
