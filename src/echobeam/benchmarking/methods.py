"""The methods that are timed: how each takes a case's problems, and how many it is given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from echobeam.beamforming.design import design_batch, design_beams
from echobeam.beamforming.direct.batch import solve_batch
from echobeam.beamforming.methods import METHODS as DESIGN
from echobeam.beamforming.problem import ProblemBatch
from echobeam.benchmarking import full_size
from echobeam.benchmarking.problems import BATCH
from echobeam.faults import InputError
from echobeam.values import BoolArray, ComplexArray


@dataclass(frozen=True, slots=True, eq=False)
class Designed:
    """What one timed call gave.

    Attributes
    ----------
    beams
        Per problem ``(K, n_tx)`` of its active objects; None where the method failed.
    fallback
        ``(P,)``: the beams are a stated fallback.
    """

    beams: list[ComplexArray | None]
    fallback: BoolArray


Call = Callable[[], Designed]


@dataclass(frozen=True, slots=True)
class Method:
    """A way to make the slot decision.

    Attributes
    ----------
    name, words
        As on the command line, and what it is.
    prepare
        Makes the call that is timed of some problems; what it does itself is not timed.
    together
        Most problems in one call.
    most
        Most problems of a case.
    warm
        Whether it starts from the beams of the slot before.
    most_objects, most_antennas, most_problems
        Size of a problem, and number of problems of a case, up to which it is run unasked: beyond,
        it takes minutes.
    requires
        Returns what has to be installed first, nothing if all is there.
    """

    name: str
    words: str
    prepare: Callable[[ProblemBatch], Call]
    together: int = 1
    most: int = BATCH
    warm: bool = False
    most_objects: float = np.inf
    most_antennas: float = np.inf
    most_problems: float = np.inf
    requires: Callable[[], str] = str

    def suits(self, batch: ProblemBatch) -> bool:
        """Return whether problems are few and small enough for it to be run unasked."""
        return (
            len(batch) <= self.most_problems
            and batch.active.shape[1] <= self.most_objects
            and batch.n_tx <= self.most_antennas
        )


def _together(method: str, batch: ProblemBatch) -> Call:
    def call() -> Designed:
        answer = design_batch(batch, method)
        beams = zip(answer.beams, batch.active, strict=True)
        return Designed([each[active] for each, active in beams], answer.fallback)

    return call


def _alone(method: str, batch: ProblemBatch) -> Call:
    problem = batch.problem(0)

    def call() -> Designed:
        answer = design_beams(problem, method)
        return Designed([answer.beams], np.array([answer.status != "optimal"]))

    return call


def _direct(batch: ProblemBatch) -> Call:
    def call() -> Designed:
        found = solve_batch(batch)
        short = found.floors_infeasible | ~found.converged
        return Designed([found.beams[0, batch.active[0]]], short)

    return call


def _full_size(solver: str, batch: ProblemBatch) -> Call:
    problem = batch.problem(0)
    return lambda: Designed([full_size.design(problem, solver)], np.array([False]))


def _cvxpy(name: str, solver: str) -> Method:
    return Method(
        name,
        f"the full-size problem, SCA through CVXPY with {solver}",
        partial(_full_size, solver),
        most=2,
        most_objects=2,
        most_antennas=64,
        requires=partial(full_size.missing, solver),
    )


_FAST = partial(_together, "fast")

METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method("fast", "a batch in one call", _FAST, together=BATCH),
        Method("fast-warm", "the same, warm-started", _FAST, together=BATCH, warm=True),
        Method("fast-single", "one problem alone", partial(_alone, "fast")),
        Method("fast-single-warm", "the same, warm-started", partial(_alone, "fast"), warm=True),
        Method("direct", "one problem alone, not examined", _direct),
        Method("direct-warm", "the same, warm-started", _direct, warm=True),
        Method("sdp", DESIGN["sdp"].about, partial(_alone, "sdp"), most=16, most_objects=4),
        _cvxpy("cvxpy-scs", "SCS"),
        _cvxpy("cvxpy-clarabel", "CLARABEL"),
    )
}
"""Every method by its name."""

REFERENCE = ("cvxpy-scs", "cvxpy-clarabel")
"""Methods that take minutes for the usual cases."""

YARDSTICK = "cvxpy-scs"
"""Method of the reference that is run unasked where a case is a single problem: some seconds."""


def find_methods(names: Sequence[str], reference: bool) -> list[Method]:
    """Return methods by their names, each once; by default all, of the reference's only one.

    Parameters
    ----------
    names
        What was asked for.
    reference
        Whether the full-size problem is to be solved in every case of a fitting size.

    Raises
    ------
    InputError
        If there is no such method; the message names all there are.
    """
    for name in names:
        if name not in METHODS:
            raise InputError(f"unknown method {name!r}; there are: {', '.join(METHODS)}")
    usual = [name for name in METHODS if name not in REFERENCE]
    chosen = {*(names or usual), *(REFERENCE if reference else ())}
    found = [method for name, method in METHODS.items() if name in chosen]
    if not names and not reference:
        found.append(replace(METHODS[YARDSTICK], most_problems=1))
    return found
