"""How good beams are, proved to a wanted gap: branch and bound on the interference, Eq. (38).

Only the interference at the objects makes (38) hard. Where each object's interference is known
to lie between two limits, `box_relaxation` proves a bound, the tighter the narrower the limits.
So limits are halved where they matter until no box can hold a design that is better than the best
one known by more than the gap. A box that cannot be proved keeps its parent's bound; ending early
costs tightness, never truth.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from echobeam.beamforming.certify.bounds import dirty_paper_bound, interference_free_bound
from echobeam.beamforming.certify.box_bound import Box
from echobeam.beamforming.certify.box_relaxation import relax_box
from echobeam.beamforming.power import BUDGET_DIGITS, spend
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.relaxation.conic import limited
from echobeam.beamforming.relaxation.model import Model, build_model, model_gains
from echobeam.beamforming.relaxation.recovery import recover_beams
from echobeam.beamforming.relaxation.sdp import Design, improve, sum_rate
from echobeam.beamforming.relaxation.shape import Shape, best_shape
from echobeam.beamforming.relaxation.solver import meets_floors
from echobeam.beamforming.subspace import to_coordinates
from echobeam.values import Array, ComplexArray

MOST_BOXES = 2000
MOST_WORK = 6e7
"""Limit of `conic.limited`: a minute, about."""

BETTER = 1e-7
"""Relative rise of the sum rate that makes other beams the better ones."""

OVERSPENT = 1e-6
"""Part of the power by which a solver may miss the budget; what is more is no design."""

BISECTIONS = 40
MIDDLE = 0.1
"""A box is cut where its chord errs most, but no nearer to its ends than this part of it."""


@dataclass(frozen=True, slots=True, eq=False)
class Certified:
    """What branch and bound found out.

    Attributes
    ----------
    bound
        No feasible design has a larger sum rate, bit/s/Hz; proved.
    beams
        ``(K, N)``: beams better than those given, where the search came upon some.
    boxes
        Number of boxes whose relaxation was solved.
    """

    bound: float
    beams: ComplexArray | None
    boxes: int


def certify(
    problem: BeamProblem,
    beams: ComplexArray,
    objective: float,
    gap: float,
    most_boxes: int = MOST_BOXES,
    most_work: float = MOST_WORK,
) -> Certified:
    """Return a bound on what any design of a problem with K >= 1 objects reaches, Eq. (38a).

    Parameters
    ----------
    problem
        Problem (38).
    beams, objective
        ``(K, N)``, a design, and its sum rate, bit/s/Hz.
    gap
        Relative distance of bound and sum rate at which the search ends.
    most_boxes, most_work
        Or it ends here, with the bound that it has.
    """
    model = build_model(problem)
    with limited(most_work) as work:
        shapes = [best_shape(beam) for beam in model.beams]
        search = _Search(model, shapes, beams, problem, objective)
        search.run(gap, most_boxes, lambda: work.reached)
    return search.result(problem)


class _Search:
    """The open boxes, the largest bound of the closed ones, and the best design so far."""

    def __init__(
        self,
        model: Model,
        shapes: list[Shape],
        beams: ComplexArray,
        problem: BeamProblem,
        objective: float,
    ) -> None:
        self.model = model
        self.gains = np.array([shape.bound for shape in shapes])
        self.best = objective
        self.given = [_reduced(model, k, beam, problem.power) for k, beam in enumerate(beams)]
        self.design: Design | None = None
        self.cuts = [shape.cuts for shape in shapes]
        self.closed = -np.inf
        self.open: list[tuple[float, int, Box]] = []
        self.boxes = 0
        self.order = itertools.count()

    def run(self, gap: float, most_boxes: int, out_of_work: Callable[[], bool]) -> None:
        """Bound and divide, the box of largest bound first."""
        n_objects, n_tx = self.model.channels.shape
        whole = Box(np.zeros(n_objects), np.full(n_objects, n_tx * float(n_objects > 1)))
        root = self.free_bound(whole.low)
        if root > self.best * (1.0 + gap):
            root = min(root, dirty_paper_bound(self.model.channels, self.model.loss))
        self.open = [(-root, next(self.order), whole)]
        while self.open and -self.open[0][0] > self.best * (1.0 + gap):
            if n_objects == 1 or self.boxes >= most_boxes or out_of_work():
                break
            bound, _, box = heapq.heappop(self.open)
            self.visit(box, -bound, gap)

    def visit(self, box: Box, bound: float, gap: float) -> None:
        """Bound one box better than its parent was, and close or divide it."""
        narrowed = self.narrowed(box)
        if narrowed is None:
            return
        bound = min(bound, self.free_bound(narrowed.low))
        around = self.given if self.design is None else self.design.covariances
        enough = self.best * (1.0 + gap / 2.0)
        relaxed = relax_box(self.model, narrowed, around, self.cuts, enough)
        self.boxes += 1
        self.cuts = relaxed.cuts
        bound = min(bound, relaxed.bound)
        interference = 0.5 * (narrowed.low + narrowed.high)
        if relaxed.covariances is not None:
            gains = model_gains(self.model, relaxed.covariances)
            interference = gains.sum(axis=-1) - np.diagonal(gains)
            self.consider(relaxed.covariances, gains)
        if bound <= self.best * (1.0 + gap):
            self.closed = max(self.closed, bound)
            return
        for half in _halves(narrowed, self.model.loss, interference):
            heapq.heappush(self.open, (-bound, next(self.order), half))

    def free_bound(self, low: Array) -> float:
        """Return the bound of `interference_free_bound` with at least this much interference."""
        loss, threshold = self.model.loss + low, self.model.threshold
        if np.sum(threshold * loss / self.gains) > 1.0 + BUDGET_DIGITS:
            return -np.inf
        return interference_free_bound(self.gains, loss, threshold)

    def narrowed(self, box: Box) -> Box | None:
        """Return the part of a box that can hold better designs than the best; None if none."""
        if self.free_bound(box.low) < self.best:
            return None
        high = box.high.copy()
        for k in np.flatnonzero(box.high > box.low).tolist():
            ends = np.log(self.model.loss[k] + np.array([box.low[k], box.high[k]]))
            if self.free_bound(_put(box.low, k, box.high[k])) >= self.best:
                continue
            inside, outside = ends
            for _ in range(BISECTIONS):
                middle = 0.5 * (inside + outside)
                value = self.free_bound(_put(box.low, k, np.exp(middle) - self.model.loss[k]))
                inside, outside = (middle, outside) if value >= self.best else (inside, middle)
            high[k] = np.clip(np.exp(outside) - self.model.loss[k], box.low[k], box.high[k])
        return Box(box.low, high)

    def consider(self, covariances: list[Array], gains: Array) -> None:
        """Take relaxed beams as a start for better ones than the best, if they promise that."""
        units = [c / max(float(np.trace(c)), np.finfo(float).tiny) for c in covariances]
        powers = np.array([float(np.trace(c)) for c in covariances])
        if float(sum_rate(gains, self.model.loss)) < self.best * np.log(2.0) * (1.0 + BETTER):
            return
        design = Design(covariances, self.cuts, 0)
        if not meets_floors(self.model, design):
            spent = spend(model_gains(self.model, units), self.model.loss, self.model.threshold)
            if spent is None:
                return
            powers = spent
        start = Design([p * u for p, u in zip(powers, units, strict=True)], self.cuts, 0)
        climbed = improve(self.model, start)
        for better in (start, climbed):
            if better is None or not _within_budget(better):
                continue
            if not meets_floors(self.model, better):
                continue
            value = sum_rate(model_gains(self.model, better.covariances), self.model.loss)
            if float(value) > self.best * np.log(2.0) * (1.0 + BETTER):
                self.best, self.design = float(value) / float(np.log(2.0)), better

    def result(self, problem: BeamProblem) -> Certified:
        """Return the largest bound of all boxes, and better beams if there are any."""
        bounds = [-entry[0] for entry in self.open]
        beams = None
        if self.design is not None:
            beams = recover_beams(problem, self.model, self.design.covariances)
        return Certified(max([self.best, self.closed, *bounds]), beams, self.boxes)


def _within_budget(design: Design) -> bool:
    """Return whether a design spends no more than the power; a solver that gave up may."""
    spent = sum(float(np.trace(covariance)) for covariance in design.covariances)
    return spent <= 1.0 + OVERSPENT


def _put(values: Array, k: int, value: float) -> Array:
    changed = values.copy()
    changed[k] = value
    return changed


def _reduced(model: Model, k: int, beam: ComplexArray, power: float) -> Array:
    """Return the covariance of given antenna weights in reduced coordinates, real part.

    The columns of a beam of two polarisations stand one after the other in its weights.
    """
    basis = model.beams[k].basis
    columns = beam.reshape(-1, basis.shape[0])
    coordinates = [basis.T @ to_coordinates(column) / np.sqrt(power) for column in columns]
    return np.asarray(sum(np.outer(c, np.conj(c)).real for c in coordinates))


def _halves(box: Box, loss: Array, interference: Array) -> tuple[Box, Box]:
    """Cut a box in two where its chord errs most: on a logarithmic scale, at the interference."""
    k = int(np.argmax(box.lift(loss, interference)))
    if box.lift(loss, interference)[k] <= 0.0:
        k = int(np.argmax(np.log1p((box.high - box.low) / (loss + box.low))))
    low, high = np.log(loss[k] + np.array([box.low[k], box.high[k]]))
    at = np.log(loss[k] + np.clip(interference[k], box.low[k], box.high[k]))
    margin = MIDDLE * (high - low)
    place = float(np.exp(np.clip(at, low + margin, high - margin)) - loss[k])
    return Box(box.low, _put(box.high, k, place)), Box(_put(box.low, k, place), box.high)
