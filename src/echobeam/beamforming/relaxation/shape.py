"""The best shape of one beam alone: the largest gain that its coverage (38f) lets it have.

Coverage is homogeneous in W_k, so shape and power separate. Where objects do not disturb each
other (always at the paper's power) these shapes are the answer, and everywhere they give a bound
that can be proved and a start for what follows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.certify.bounds import gain_bound
from echobeam.beamforming.relaxation import conic
from echobeam.beamforming.relaxation.model import (
    FLATNESS,
    BeamModel,
    flattened,
    new_cuts,
    ripple_excess,
)
from echobeam.values import Array, BoolArray

ENOUGH = 1e-9
"""Relative distance of gain and bound at which a shape is the best one."""

MOST_ROUNDS = 10


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """One beam's best covariance of unit power.

    Attributes
    ----------
    covariance
        ``(r, r)``, in the beam's reduced coordinates.
    gain
        At its object.
    bound
        No beam that keeps this coverage has a larger gain; proved.
    cuts
        ``(G,)``: grid points that were imposed.
    solves
        Number of semidefinite programmes it took.
    """

    covariance: Array
    gain: float
    bound: float
    cuts: BoolArray
    solves: int


def best_shape(beam: BeamModel) -> Shape:
    """Return the shape of largest gain, Eq. (38f), with a proved bound on the gain.

    Every round is judged by what can be checked: its covariance after it has been made to keep
    the full grid, and the bound that its multipliers prove. A solver that stops early costs
    tightness, not truth.
    """
    n_tx = beam.basis.shape[0]
    matched = np.outer(beam.own, beam.own) / n_tx
    if np.max(ripple_excess(beam, matched)) <= 0.0:
        return Shape(matched, float(n_tx), float(n_tx), beam.start, 0)
    best = np.eye(beam.size) / beam.size
    gain, bound, cuts, solves = n_tx / beam.size, float(n_tx), beam.start, 0
    while solves < MOST_ROUNDS and bound > gain * (1.0 + ENOUGH):
        answer = conic.solve(_programme(beam, cuts))
        solves += 1
        if not answer.usable:
            break
        bound = min(bound, _proved_bound(beam, cuts, answer.own_multipliers[0]))
        covariance = answer.matrices[0] / np.trace(answer.matrices[0])
        excess = ripple_excess(beam, covariance)
        feasible = flattened(covariance, excess, beam.ripple)
        reached = float(beam.own @ feasible @ beam.own)
        if reached > gain:
            best, gain = feasible, reached
        found = new_cuts(beam, excess, FLATNESS) & ~cuts
        if not found.any():
            break
        cuts = cuts | found
    return Shape(best, gain, bound, cuts, solves)


def cover_rows(beam: BeamModel, cuts: BoolArray) -> Array:
    """Return (38f) at the chosen points as rows ``<= 0`` of a reduced covariance: above, below."""
    difference = beam.block.squares(beam.own) - beam.block.squares(beam.cover[cuts])
    allowed = beam.ripple * beam.block.identity()
    return np.concatenate([difference - allowed, -difference - allowed])


def _programme(beam: BeamModel, cuts: BoolArray) -> conic.Programme:
    return conic.Programme(
        blocks=[beam.block],
        cost=[-beam.block.squares(beam.own)],
        most=[beam.block.identity()[np.newaxis]],
        most_of=np.ones(1),
        own=[cover_rows(beam, cuts)],
    )


def _proved_bound(beam: BeamModel, cuts: BoolArray, multipliers: Array) -> float:
    above, below = np.split(multipliers, 2)
    steering = beam.steering
    return gain_bound(steering[0], steering[1:][cuts], beam.ripple, above, below)
