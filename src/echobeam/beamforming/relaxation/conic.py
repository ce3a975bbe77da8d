"""Semidefinite programmes over one small real matrix per beam, through Clarabel's own API.

All programmes of this room have one form: matrices X_k (positive semidefinite) and a few free
scalars, tied by shared rows; and rows ``<= 0`` of each matrix alone, the coverage. Matrices are
handled as vectors of their upper triangle, column by column, off-diagonals times sqrt(2), so that
inner products are kept.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from echobeam.values import Array, IntArray

TOLERANCE = 1e-9
MOST_ITERATIONS = 60

IMPOSSIBLE = (
    "PrimalInfeasible",
    "DualInfeasible",
    "AlmostPrimalInfeasible",
    "AlmostDualInfeasible",
    "Unsolved",
)


@lru_cache(maxsize=256)
def triangle(size: int) -> tuple[IntArray, IntArray, Array]:
    """Return rows, columns and weights of the scaled upper triangle, column by column."""
    column, row = (index.astype(np.int64) for index in np.tril_indices(size))
    return row, column, np.where(row == column, 1.0, np.sqrt(2.0))


@dataclass(frozen=True, slots=True)
class Block:
    """The form of one matrix, and its vector: the triangle, then the spare diagonal entry.

    Attributes
    ----------
    size
        r, number of rows.
    spare
        The last row is zero but for its diagonal. All data are orthogonal to the spare direction
        (see `subspace`), so nothing is lost, and the semidefinite cone is one row smaller.
    """

    size: int
    spare: bool = False

    @property
    def dense(self) -> int:
        """Rows of the semidefinite part."""
        return self.size - int(self.spare)

    @property
    def length(self) -> int:
        """Length of the vector."""
        return self.dense * (self.dense + 1) // 2 + int(self.spare)

    def squares(self, vectors: Array) -> Array:
        """Return the vectors of v v^T, ``(..., r)`` to ``(..., length)``."""
        row, column, weight = triangle(self.dense)
        product: Array = vectors[..., row] * vectors[..., column] * weight
        if not self.spare:
            return product
        return np.concatenate([product, vectors[..., -1:] ** 2], axis=-1)

    def identity(self) -> Array:
        """Return the identity's vector; its inner product with a matrix is the trace."""
        row, column, _ = triangle(self.dense)
        return np.concatenate([row == column, np.ones(int(self.spare), dtype=bool)]).astype(float)

    def matrix(self, vector: Array) -> Array:
        """Return the symmetric matrix ``(r, r)`` of a vector."""
        row, column, weight = triangle(self.dense)
        full = np.zeros((self.size, self.size))
        full[row, column] = vector[: row.size] / weight
        full[column, row] = vector[: row.size] / weight
        if self.spare:
            full[-1, -1] = vector[-1]
        return full


@dataclass(frozen=True, slots=True, eq=False)
class Programme:
    """Minimise ``sum_k cost_k . X_k + free_cost . z + z^T diag(curvature) z / 2``.

    Attributes
    ----------
    blocks
        Form of each X_k.
    cost
        Per matrix, ``(m_k,)``.
    equal, equal_free, equal_to
        ``sum_k equal_k X_k + equal_free z = equal_to``: per matrix ``(E, m_k)``; ``(E, F)``;
        ``(E,)``.
    most, most_of
        ``sum_k most_k X_k <= most_of``: per matrix ``(L, m_k)``; ``(L,)``.
    own
        Per matrix, ``(J_k, m_k)``: ``own_k X_k <= 0``.
    free_cost, curvature
        ``(F,)``: of the free scalars z.
    """

    blocks: list[Block]
    cost: list[Array]
    most: list[Array]
    most_of: Array
    own: list[Array]
    equal: list[Array] | None = None
    equal_free: Array = field(default_factory=lambda: np.zeros((0, 0)))
    equal_to: Array = field(default_factory=lambda: np.zeros(0))
    free_cost: Array = field(default_factory=lambda: np.zeros(0))
    curvature: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True, eq=False)
class ConicAnswer:
    """What Clarabel returned.

    Attributes
    ----------
    matrices
        X_k, with what is left of negative eigenvalues.
    own_multipliers
        Per matrix, ``(J_k,)``: of ``own_k X_k <= 0``.
    usable
        Finite, and not known to be impossible: a point to be judged, whatever its accuracy.
    infeasible
        Clarabel proved that nothing meets the constraints.
    objective
        Of the minimisation.
    most_multipliers
        ``(L,)``: of ``sum_k most_k X_k <= most_of``. With the others, the proof of it where the
        programme is infeasible.
    """

    matrices: list[Array]
    own_multipliers: list[Array]
    usable: bool
    infeasible: bool
    objective: float
    most_multipliers: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(slots=True)
class Work:
    """Work that may still be done, in units of `work_of`; a million is a second, about."""

    left: float
    reached: bool = False
    """True once a programme was refused for want of it."""


_WORK: ContextVar[Work | None] = ContextVar("work", default=None)


@contextmanager
def limited(units: float) -> Iterator[Work]:
    """Limit the work of all programmes solved within, so that nothing takes over for minutes.

    In work and not in time, so that answers do not depend on how busy the machine is. A programme
    beyond the limit has an answer that is not usable. Limits do not nest: the outer one holds.
    """
    outer = _WORK.get()
    work = Work(units) if outer is None else outer
    token = _WORK.set(work)
    try:
        yield work
    finally:
        _WORK.reset(token)


def work_of(programme: Programme) -> float:
    """Return the work of solving a programme: its variables and rows squared, as measured."""
    variables = sum(block.length for block in programme.blocks)
    rows = programme.most_of.size + sum(len(own) for own in programme.own)
    return float((variables + rows) ** 2)


def solve(programme: Programme, tolerance: float = TOLERANCE) -> ConicAnswer:
    """Solve a programme with Clarabel, if the work is within the limit.

    Equilibration is off: scaling a semidefinite cone as a whole it was seen to spoil these
    programmes, whose rows are of one size as they come. Where numbers overflow, in the programme
    or in Clarabel itself, which then panics, the answer is one that is not usable.
    """
    work, units = _WORK.get(), work_of(programme)
    if work is not None:
        if units > work.left:
            work.reached = True
            return _no_answer(programme)
        work.left -= units
    import clarabel
    from scipy import sparse

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.max_iter = MOST_ITERATIONS
    settings.equilibrate_enable = False
    settings.presolve_enable = False
    settings.chordal_decomposition_enable = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    columns, constants = _constraints(programme)
    linear = np.concatenate([*programme.cost, programme.free_cost])
    numbers = (columns.data, constants, linear, programme.curvature)
    if not all(np.isfinite(part).all() for part in numbers):
        return _no_answer(programme)
    bent = np.arange(programme.curvature.size) + sum(b.length for b in programme.blocks)
    width = columns.shape[1]
    quadratic = sparse.csc_matrix((programme.curvature, (bent, bent)), shape=(width, width))
    cones = [
        clarabel.ZeroConeT(programme.equal_to.size),
        clarabel.NonnegativeConeT(programme.most_of.size + sum(len(own) for own in programme.own)),
    ]
    for block in programme.blocks:
        cones.append(clarabel.PSDTriangleConeT(block.dense))
        if block.spare:
            cones.append(clarabel.NonnegativeConeT(1))
    solver = clarabel.DefaultSolver(
        quadratic,
        linear,
        columns,
        constants,
        cones,
        settings,
    )
    try:
        solution = solver.solve()
    except BaseException as error:  # what Rust's panics become is no Exception
        if type(error).__name__ != "PanicException":
            raise
        return _no_answer(programme)
    return _read(programme, solution)


def _no_answer(programme: Programme) -> ConicAnswer:
    return ConicAnswer(
        matrices=[block.matrix(np.zeros(block.length)) for block in programme.blocks],
        own_multipliers=[np.zeros(len(own)) for own in programme.own],
        usable=False,
        infeasible=False,
        objective=np.nan,
        most_multipliers=np.zeros(programme.most_of.size),
    )


def _constraints(programme: Programme) -> tuple[Any, Array]:
    """Return A and b of A x + s = b: per matrix a dense strip and a diagonal below it."""
    from scipy import sparse

    n_equal, n_most = programme.equal_to.size, programme.most_of.size
    shared = n_equal + n_most
    row_own = shared
    row_cone = shared + sum(len(own) for own in programme.own)
    data, indices, counts = [], [], []
    for k, own in enumerate(programme.own):
        width = programme.cost[k].size
        equal = np.zeros((0, width)) if programme.equal is None else programme.equal[k]
        strip = np.concatenate([equal, programme.most[k], own, np.full((1, width), -1.0)])
        rows = np.concatenate([np.arange(shared), row_own + np.arange(len(own)), [0]])
        places = np.broadcast_to(rows, (width, rows.size)).copy()
        places[:, -1] = row_cone + np.arange(width)
        data.append(strip.T.ravel())
        indices.append(places.ravel())
        counts.append(np.full(width, rows.size))
        row_own += len(own)
        row_cone += width
    n_free = programme.free_cost.size
    if n_free:
        data.append(programme.equal_free.T.ravel())
        indices.append(np.tile(np.arange(n_equal), n_free))
        counts.append(np.full(n_free, n_equal))
    pointers = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    size = (row_cone, pointers.size - 1)
    constants = np.zeros(row_cone)
    constants[:shared] = np.concatenate([programme.equal_to, programme.most_of])
    return (
        sparse.csc_matrix((np.concatenate(data), np.concatenate(indices), pointers), shape=size),
        constants,
    )


def _read(programme: Programme, solution: object) -> ConicAnswer:
    status = str(solution.status)  # type: ignore[attr-defined]
    point = np.array(solution.x)  # type: ignore[attr-defined]
    multipliers = np.array(solution.z)  # type: ignore[attr-defined]
    matrices, own_multipliers = [], []
    place, row = 0, programme.equal_to.size + programme.most_of.size
    for block, own in zip(programme.blocks, programme.own, strict=True):
        matrices.append(block.matrix(point[place : place + block.length]))
        own_multipliers.append(multipliers[row : row + len(own)])
        place, row = place + block.length, row + len(own)
    return ConicAnswer(
        matrices=matrices,
        own_multipliers=own_multipliers,
        usable=status not in IMPOSSIBLE and bool(np.isfinite(point).all()),
        infeasible=status == "PrimalInfeasible",
        objective=float(solution.obj_val),  # type: ignore[attr-defined]
        most_multipliers=multipliers[programme.equal_to.size :][: programme.most_of.size],
    )
