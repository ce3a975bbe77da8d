"""The reference method does not turn to a solver that would fill the memory."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb

pytest.importorskip("cvxpy")

from echobeam.beamforming.reference import MOST_MEMORY, ReferenceProblem


def stated(n_tx, objects):
    problem = eb.BeamProblem(
        angles=np.linspace(0.6, 1.4, objects),
        distances=np.full(objects, 100.0),
        coverage_halfwidths=np.full(objects, 0.02),
        ripple=0.1 * n_tx,
        min_rate=0.0,
        power=1.0,
        noise=1.0,
        n_tx=n_tx,
    )
    return ReferenceProblem(problem)


@pytest.mark.parametrize(("n_tx", "objects", "tried"), [(30, 2, True), (64, 3, False)])
def test_an_interior_point_method_is_tried_where_it_fits(n_tx, objects, tried, monkeypatch):
    reference = stated(n_tx, objects)
    names = []

    def solve(problem, solver, **options):
        names.append(solver)
        raise reference._cvxpy.SolverError("not today")

    monkeypatch.setattr(reference._cvxpy.Problem, "solve", solve)
    assert reference.maximise(reference._cvxpy.Constant(0.0), []) is None
    assert names == (["SCS", "CLARABEL"] if tried else ["SCS"])
    assert (reference._clarabel_memory() <= MOST_MEMORY) is tried
