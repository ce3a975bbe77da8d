"""Method "reference": the paper's own way, full size, through CVXPY: SDR + SCA + IRM.

The examiner of the fast methods and the subject of comparisons: complex Hermitian matrices on the
antennas, the full grid of (38f), no reduction. Successive convex approximation (51)-(54) of the
relaxed problem, then iterative rank minimisation (55)-(57).

Departs: as the ledger says, floors (38e) in their exact linear form, V^H in place of V^T, the
objective of (55) minus w^p r in place of plus, its base point renewed at each step, and r relative
to the power.
"""

from __future__ import annotations

import logging
import time
import warnings
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.coverage import cover_grid
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem, ProblemError
from echobeam.beamforming.proposal import Proposal
from echobeam.beamforming.relaxation.floors import fair_proposal
from echobeam.beamforming.relaxation.model import build_model
from echobeam.beamforming.relaxation.rank_one import beam_of
from echobeam.beamforming.relaxation.recovery import keep_coverage, repair_beam_powers
from echobeam.beamforming.relaxation.shape import best_shape
from echobeam.beamforming.relaxation.solver import prove
from echobeam.values import ComplexArray

_LOG = logging.getLogger("echobeam.reference")

MOST_SCA_STEPS = 20
STEADY = 1e-6
"""Relative change of the sum rate at which the approximation (54) ends."""

MOST_IRM_STEPS = 12
WEIGHT_GROWTH = 4.0
"""w of (55): the weight of the rank grows by this factor at each step."""

LEAST_POWER = 1e-6
"""A beam with less of the power is not asked for its rank."""

SOLVERS: tuple[tuple[str, dict[str, float]], ...] = (
    ("SCS", {"eps_abs": 1e-6, "eps_rel": 1e-6, "max_iters": 4_000}),
    ("CLARABEL", {}),
)
"""In the order in which they are tried."""

MOST_MEMORY = 4e9
"""Bytes that Clarabel may need; beyond it SCS alone is tried."""

RESIDUAL = 1e-6
"""Largest violation with which a solution that its solver calls inaccurate is taken."""

RANK_ONE = 1e-6
"""Largest ratio of the second eigenvalue to the first that counts as rank one."""


@dataclass(frozen=True, slots=True, eq=False)
class Relaxed:
    """Covariances from a stage of the method, and what they reach.

    Attributes
    ----------
    covariances
        ``(K, N, N)`` complex: W_k / P_T.
    objective
        Sum rate, bit/s/Hz, Eq. (50).
    solves
        Convex programmes solved.
    """

    covariances: ComplexArray
    objective: float
    solves: int


class _Progress:
    """Log of the programmes solved: how many there may be, and how long they may take."""

    def __init__(self, problem: BeamProblem) -> None:
        self.done, self.spent = 0, 0.0
        self.most = MOST_SCA_STEPS + MOST_IRM_STEPS
        _LOG.info(
            "reference: at most %d semidefinite programmes over %d Hermitian matrices of size %d; "
            "the first one tells how long they take",
            self.most,
            problem.n_objects,
            problem.n_tx,
        )

    def solved(self, seconds: float) -> None:
        """Count a programme, and say how long the others may take."""
        self.done, self.spent = self.done + 1, self.spent + seconds
        left = (self.most - self.done) * self.spent / self.done
        _LOG.info(
            "reference: programme %d of at most %d took %.1f s; at most %.0f s left",
            self.done,
            self.most,
            seconds,
            left,
        )


class ReferenceProblem:
    """The constraints (38b), (38c), (38e), (38f) as CVXPY has them, power in units of P_T."""

    def __init__(self, problem: BeamProblem) -> None:
        self._cvxpy = _cvxpy()
        self._progress = _Progress(problem)
        n_tx = problem.n_tx
        self.loss = problem.loss / problem.power
        self.channels = problem.array.steering(problem.angles)
        self.threshold = np.expm1(problem.min_rate * np.log(2.0))
        self.covariances = [
            self._cvxpy.Variable((n_tx, n_tx), hermitian=True) for _ in range(problem.n_objects)
        ]
        self.gains = [[_form(a, W) for W in self.covariances] for a in self.channels]
        self.constraints = self._power() + self._floors() + self._coverage(problem)

    def _power(self) -> list[Any]:
        total = sum(self._cvxpy.real(self._cvxpy.trace(W)) for W in self.covariances)
        return [total <= 1.0, *(W >> 0 for W in self.covariances)]

    def _floors(self) -> list[Any]:
        return [
            row[k] / self.loss[k]
            >= self.threshold[k] * (sum(row) - row[k]) / self.loss[k] + self.threshold[k]
            for k, row in enumerate(self.gains)
            if self.threshold[k] > 0.0
        ]

    def _coverage(self, problem: BeamProblem) -> list[Any]:
        cp = self._cvxpy
        covers = problem.angles, problem.coverage_halfwidths
        grid, mask = cover_grid(problem.array, *covers, problem.resolution)
        constraints = []
        for k, W in enumerate(self.covariances):
            elsewhere = grid[k] != problem.angles[k]
            if elsewhere.ndim > 1:
                elsewhere = elsewhere.any(axis=-1)
            angles = grid[k, mask[k] & elsewhere]
            if angles.size == 0:
                continue
            cover = problem.array.steering(angles)
            pattern = cp.real(cp.sum(cp.multiply(np.conj(cover), (W @ cover.T).T), axis=1))
            allowed = problem.ripple[k] * cp.real(cp.trace(W))
            constraints.append(cp.abs(self.gains[k][k] - pattern) <= allowed)
        return constraints

    def minorant(self, at: ComplexArray) -> Any:
        """Return sum_k R-tilde_k of (52), (56) around covariances ``at``, nats."""
        cp = self._cvxpy
        total = 0.0
        for k, row in enumerate(self.gains):
            foreign = sum(row) - row[k]
            present = self._foreign(k, at) / self.loss[k] + 1.0
            total = total + cp.log(1.0 + sum(row) / self.loss[k])
            total = total - np.log(present) - (foreign / self.loss[k] + 1.0 - present) / present
        return total

    def maximise(self, objective: Any, constraints: list[Any]) -> ComplexArray | None:
        """Return the covariances that maximise a concave objective, None if there are none.

        Solvers have returned wrong values as inaccurate ones here; such a solution is the last
        resort, and its constraints are examined.
        """
        cp = self._cvxpy
        stated = cp.Problem(cp.Maximize(objective), self.constraints + constraints)
        begun = time.perf_counter()
        for name, options in SOLVERS:
            if name == "CLARABEL" and self._clarabel_memory() > MOST_MEMORY:
                continue
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    stated.solve(solver=name, **options)
            except (cp.SolverError, ArithmeticError, ValueError):
                continue
            if stated.status == cp.INFEASIBLE:
                return None
            if stated.status == cp.OPTIMAL:
                break
        self._progress.solved(time.perf_counter() - begun)
        if stated.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            return None
        if stated.status != cp.OPTIMAL and _residual(stated) > RESIDUAL:
            return None
        return np.stack([np.asarray(W.value) for W in self.covariances])

    def _clarabel_memory(self) -> float:
        """Return about how many bytes Clarabel takes: dense blocks of all pairs of entries.

        64 antennas and three objects were measured to take more than 22 GB; this says 20.
        """
        size = 2 * int(self.channels.shape[-1])  # the real form of a Hermitian matrix
        return 100.0 * len(self.covariances) * (0.5 * size * (size + 1)) ** 2

    def minimise_rank_step(
        self, at: ComplexArray, scale: float, weight: float, radius: float
    ) -> tuple[ComplexArray | None, float]:
        """Return the solution of (55) around covariances, and its r_p.

        Parameters
        ----------
        at
            ``(K, N, N)``: M^(p-1), the base of (56) and the source of V^(p-1).
        scale
            Sum rate, nats, that objective and weight are relative to.
        weight
            w^p.
        radius
            r_(p-1), which r_p may not exceed.
        """
        cp = self._cvxpy
        r = cp.Variable()
        rest = at.shape[-1] - 1
        constraints = [r <= radius]
        for W, base in zip(self.covariances, at, strict=True):
            V = np.linalg.eigh(base)[1][:, :rest]
            small = V.conj().T @ W @ V
            constraints.append(r * np.eye(rest) - (small + small.H) / 2.0 >> 0)
        found = self.maximise(self.minorant(at) / scale - weight * r, constraints)
        return found, radius if found is None else float(r.value)

    def _foreign(self, k: int, covariances: ComplexArray) -> float:
        a = self.channels[k]
        gains = np.einsum("m,imn,n->i", a.conj(), covariances, a).real
        return float(gains.sum() - gains[k])

    def sum_rate(self, covariances: ComplexArray) -> float:
        """Return the sum rate (50) of covariances, bit/s/Hz."""
        gains = np.einsum("km,imn,kn->ki", self.channels.conj(), covariances, self.channels).real
        own = np.diagonal(gains)
        return float(np.sum(np.log1p(own / (gains.sum(axis=1) - own + self.loss))) / np.log(2.0))


def solve(problem: BeamProblem) -> Proposal:
    """Solve problem (38) with K >= 1 objects as the paper does, Eqs. (50)-(57).

    Raises
    ------
    ImportError
        If CVXPY is not installed.
    ProblemError
        If the array has two polarisations, which the paper does not have.
    """
    if problem.array.polarisations > 1:
        raise ProblemError("method 'reference' takes arrays of one polarisation only")
    stated = ReferenceProblem(problem)
    relaxed = relax(stated)
    if relaxed is None:
        return _fair(problem)
    final = minimise_rank(stated, relaxed)
    beams = np.stack([_beam(problem, W) for W in final.covariances])
    beams = keep_coverage(problem, beams)
    beams = repair_beam_powers(problem, beams, stated.threshold) * np.sqrt(problem.power)
    return Proposal(
        beams=beams,
        proof=Proof(partial(prove, problem, 0.0)),
        outcome="converged",
        message=_message(relaxed, final, float(np.sum(rates(problem, beams)))),
        iterations=final.solves,
    )


def relax(stated: ReferenceProblem) -> Relaxed | None:
    """Return where SCA (54) of the relaxed problem ends, None if nothing meets its constraints."""
    n_objects, n_tx = stated.channels.shape
    at = np.broadcast_to(np.eye(n_tx, dtype=complex) / (n_tx * n_objects), (n_objects, n_tx, n_tx))
    value, scale = 0.0, stated.sum_rate(at) * np.log(2.0)
    for step in range(1, MOST_SCA_STEPS + 1):
        found = stated.maximise(stated.minorant(at) / scale, [])
        if found is None:
            return None if step == 1 else Relaxed(at, value, step)
        reached = stated.sum_rate(found)
        at, rise, value = found, reached - value, reached
        scale = value * np.log(2.0)
        if rise <= STEADY * value:
            break
    return Relaxed(at, value, step)


def minimise_rank(stated: ReferenceProblem, relaxed: Relaxed) -> Relaxed:
    """Return where IRM (55) ends, started from the relaxed solution; Eqs. (55)-(57)."""
    at, solves = relaxed.covariances, relaxed.solves
    scale = relaxed.objective * np.log(2.0)
    radius, weight = 1.0, 1.0
    for _ in range(MOST_IRM_STEPS):
        if rank_ratio(at) <= RANK_ONE:
            break
        found, radius = stated.minimise_rank_step(at, scale, weight, radius)
        solves += 1
        if found is None:
            break
        at, weight = found, weight * WEIGHT_GROWTH
    return Relaxed(at, stated.sum_rate(at), solves)


def rank_ratio(covariances: ComplexArray) -> float:
    """Return the largest ratio of second to first eigenvalue among covariances with power."""
    values = np.linalg.eigvalsh(covariances)
    if values.shape[-1] < 2:
        return 0.0
    first = np.maximum(values[:, -1], LEAST_POWER)
    return float(np.max(np.maximum(values[:, -2], 0.0) / first))


def _residual(stated: Any) -> float:
    """Return the largest violation of a CVXPY problem's constraints at its solution."""
    return max(float(np.max(constraint.violation())) for constraint in stated.constraints)


def _columns(covariance: ComplexArray) -> ComplexArray:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _beam(problem: BeamProblem, covariance: ComplexArray) -> ComplexArray:
    """Return the beam of a covariance: of the same pattern, or its strongest column."""
    columns = _columns(covariance)
    if problem.array.axes == 1:
        return beam_of(columns)
    strongest: ComplexArray = columns[:, -1] * np.sqrt(
        np.sum(np.abs(columns) ** 2) / max(np.sum(np.abs(columns[:, -1]) ** 2), 1e-300)
    )
    return strongest


def _fair(problem: BeamProblem) -> Proposal:
    model = build_model(problem)
    return fair_proposal(problem, model, [best_shape(beam) for beam in model.beams])


def _message(relaxed: Relaxed, final: Relaxed, reached: float) -> str:
    """Say what iterative rank minimisation lost of the relaxation's sum rate, bit/s/Hz."""
    lost = 1.0 - reached / relaxed.objective if relaxed.objective > 0.0 else 0.0
    words = [
        f"rank minimisation and repair lost {100.0 * max(lost, 0.0):.3g} % of the relaxation's "
        f"{relaxed.objective:.6g} bit/s/Hz"
    ]
    ratio = rank_ratio(final.covariances)
    if ratio > RANK_ONE:
        words.append(f"it ended at an eigenvalue ratio of {ratio:.1e}, not at rank one")
    return "; ".join(words)


def _form(a: ComplexArray, covariance: Any) -> Any:
    """Return a^H W a as a real CVXPY expression."""
    cp = _cvxpy()
    return cp.real(cp.sum(cp.multiply(np.outer(a.conj(), a), covariance)))


def _cvxpy() -> Any:
    try:
        import cvxpy
    except ImportError as error:
        raise ImportError("method 'reference' needs CVXPY: pip install cvxpy scs") from error
    return cvxpy
