"""The full-size CVXPY problem with one solver: SCA of the relaxation, and rank-one beams from it.

What a reader of the paper would write down first. Iterative rank minimisation is left out: the
pattern of the relaxed solution is one beam's pattern, which spectral factorisation finds.
"""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from typing import Any

import numpy as np

from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.reference import SOLVERS, ReferenceProblem, relax
from echobeam.beamforming.relaxation.rank_one import beam_of
from echobeam.beamforming.relaxation.recovery import keep_coverage, repair_beam_powers
from echobeam.values import ComplexArray


class OneSolver(ReferenceProblem):
    """The reference's problem, given to one solver whose solutions are taken as they are.

    What it calls inaccurate is taken too: the benchmark judges the beams itself.
    """

    def __init__(self, problem: BeamProblem, solver: str) -> None:
        super().__init__(problem)
        self._solver = solver

    def maximise(self, objective: Any, constraints: list[Any]) -> ComplexArray | None:
        """Return the covariances that maximise a concave objective, None if the solver failed."""
        cp = self._cvxpy
        stated = cp.Problem(cp.Maximize(objective), self.constraints + constraints)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                stated.solve(solver=self._solver, **dict(SOLVERS)[self._solver])
        except (cp.SolverError, ArithmeticError, ValueError):
            return None
        if stated.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            return None
        found = np.stack([np.asarray(W.value) for W in self.covariances])
        return found if np.isfinite(found).all() else None


def missing(solver: str) -> str:
    """Return what has to be installed before a solver can be used, nothing if all is there."""
    modules = ("cvxpy", solver.lower())
    return ", ".join(name for name in modules if find_spec(name) is None)


def design(problem: BeamProblem, solver: str) -> ComplexArray | None:
    """Return beams ``(K, n_tx)`` through CVXPY, None if the solver failed.

    Parameters
    ----------
    problem
        Problem (38).
    solver
        ``"SCS"`` or ``"CLARABEL"``.

    Raises
    ------
    ImportError
        If CVXPY is not installed.
    """
    stated = OneSolver(problem, solver)
    relaxed = relax(stated)
    if relaxed is None:
        return None
    beams = np.stack([beam_of(_columns(W)) for W in relaxed.covariances])
    beams = keep_coverage(problem, beams)
    beams = repair_beam_powers(problem, beams, stated.threshold)
    return np.asarray(beams * np.sqrt(problem.power))


def _columns(covariance: ComplexArray) -> ComplexArray:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
