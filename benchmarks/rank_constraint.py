"""What the rank constraint (38d) costs: ``python benchmarks/rank_constraint.py``.

Three parts: a line of sight and a uniform line of antennas, where it costs nothing and the
paper's iterative rank minimisation (IRM) still may; a reflection; other arrays. Needs CVXPY.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, minimize

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.coverage import coverage_grid
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.objective import rates
from echobeam.beamforming.problem import BeamProblem
from echobeam.beamforming.reference import (
    RANK_ONE,
    ReferenceProblem,
    minimise_rank,
    rank_ratio,
    relax,
)
from echobeam.beamforming.relaxation.rank_one import autocorrelation, beam_of
from echobeam.physics.array import LinearArray
from echobeam.values import Array, ComplexArray

HEIGHT = 100.0
PROVED = 1e-5
MARGIN = 0.1
"""Part of the difference to the relaxation that is left open for vectors not found."""

# Line of sight, uniform line -------------------------------------------------------------------


@dataclass(frozen=True)
class Setting:
    words: str
    n_tx: int
    angles: tuple[float, ...]
    halfwidth: float
    ripple: float
    power: float

    @property
    def problem(self) -> BeamProblem:
        angles = np.radians(self.angles)
        return BeamProblem(
            angles=angles,
            distances=HEIGHT / np.sin(angles),
            coverage_halfwidths=np.full(angles.size, np.radians(self.halfwidth)),
            ripple=self.ripple,
            min_rate=0.0,
            power=self.power,
            noise=1.0,
            n_tx=self.n_tx,
            resolution=np.radians(0.5),
        )


SETTINGS = (
    Setting("one object, narrow cover", 16, (75.0,), 3.0, 1.0, 1e4),
    Setting("one object, wide cover", 16, (75.0,), 12.0, 1.0, 1e4),
    Setting("one object, wide, flat", 12, (60.0,), 15.0, 0.25, 1e4),
    Setting("one object, wide, loose", 12, (60.0,), 15.0, 4.0, 1e4),
    Setting("two objects, low power", 12, (75.0, 135.0), 9.0, 1.0, 1.0),
    Setting("two objects, high power", 12, (75.0, 135.0), 9.0, 1.0, 1e5),
    Setting("two close objects, high power", 12, (60.0, 50.0), 6.0, 0.5, 1e5),
    Setting("two objects, narrow cover", 8, (60.0, 120.5), 2.0, 0.8, 1e4),
)


def principal(covariances: ComplexArray) -> ComplexArray:
    """Return the strongest eigenvector of each, with its own power only."""
    values, vectors = np.linalg.eigh(covariances)
    return vectors[:, :, -1] * np.sqrt(values[:, -1:])


HEADS = ("rate", "proved", "sdp", "relaxed", "ratio", "factored", "IRM", "violation", "ratio")
HEADING = f"{'':65s}{HEADS[0]:>10s}" + "".join(f"{head:>11s}" for head in HEADS[1:])


def line_of_sight(setting: Setting) -> str:
    """Return a line of figures, see `EXPLAINED`."""
    problem = setting.problem
    direct = design_beams(problem, certify=True, gap=PROVED)
    reduced = design_beams(problem, method="sdp")
    stated = ReferenceProblem(problem)
    relaxed = relax(stated)
    assert relaxed is not None, "the conic solvers gave nothing"
    factored = np.stack([beam_of(_columns(W)) for W in relaxed.covariances])
    final = minimise_rank(stated, relaxed)
    beams = principal(final.covariances) * np.sqrt(problem.power)
    ratio = rank_ratio(final.covariances)
    best = direct.objective
    figures = (
        direct.gap,
        1.0 - reduced.objective / best,
        1.0 - relaxed.objective / best,
        rank_ratio(relaxed.covariances),
        1.0 - _sum_rate(problem, factored * np.sqrt(problem.power)) / best,
        1.0 - _sum_rate(problem, beams) / best,
        violation(problem, beams).largest,
        ratio,
    )
    return (
        f"{setting.words:30s} N={setting.n_tx:<3d} +-{setting.halfwidth:<3g} B={setting.ripple:<5g}"
        f"P_T={setting.power:<8.0e}{best:10.6f}"
        + "".join(f"{figure:11.1e}" for figure in figures)
        + ("" if ratio <= RANK_ONE else "  not rank one")
    )


EXPLAINED = """\
rate: of the direct solver, bit/s/Hz; proved: relative gap to a bound on beams of any rank.
Losses relative to rate: sdp, the reduced relaxation; relaxed, covariances that SCA ends with at
full size, whose lambda2/lambda1 is next; factored, one beam each with the patterns of these.
IRM: loss of what rank minimisation ends with, by what its beams violate (38), lambda2/lambda1."""


def _sum_rate(problem: BeamProblem, beams: ComplexArray) -> float:
    return float(np.sum(rates(problem, beams)))


def _columns(covariance: ComplexArray) -> ComplexArray:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


# A reflection ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reflection:
    """Most |h^H w|^2 of |w| = 1 for h = a(own) + gain a(other), flat to ``ripple`` on a cover.

    Three antennas: few enough for every vector to be looked at.
    """

    gain: complex
    own: float = 80.0
    other: float = 155.0
    halfwidth: float = 45.0
    ripple: float = 0.05

    def channel(self) -> ComplexArray:
        own, other = LinearArray(3, axis="horizontal").steering(np.radians([self.own, self.other]))
        return np.asarray(own + self.gain * other)

    def forms(self) -> ComplexArray:
        """Return ``(J, 3, 3)``: a(own) a(own)^H - a(cover) a(cover)^H of (38f)."""
        grid, mask = coverage_grid(
            np.radians([self.own]), np.radians([self.halfwidth]), np.radians(2.5)
        )
        cover = LinearArray(3, axis="horizontal").steering(grid[mask])
        own = LinearArray(3, axis="horizontal").steering(np.radians(self.own))
        outer = np.einsum("jm,jn->jmn", cover, cover.conj())
        return np.asarray(
            (np.outer(own, own.conj()) - outer)[np.arange(len(cover)) != len(cover) // 2]
        )


def best_covariance(case: Reflection) -> ComplexArray:
    import cvxpy as cp

    h = case.channel()
    W = cp.Variable((3, 3), hermitian=True)
    limits = [cp.abs(cp.real(cp.trace(A @ W))) <= case.ripple for A in case.forms()]
    objective = cp.Maximize(cp.real(cp.trace(np.outer(h, h.conj()) @ W)))
    cp.Problem(objective, [W >> 0, cp.real(cp.trace(W)) == 1, *limits]).solve(solver="CLARABEL")
    return np.asarray(W.value)


def best_vector(case: Reflection, starts: int = 20) -> float:
    """Return the largest |h^H w|^2 that local searches from random starts find."""
    h, forms = case.channel(), case.forms()
    both = np.concatenate([forms, -forms])

    def margin(x: Array) -> Array:
        w = _complex(x)
        return case.ripple - np.einsum("m,jmn,n->j", w.conj(), both, w).real

    def margin_slope(x: Array) -> Array:
        return -2.0 * _real(both @ _complex(x))

    def cost(x: Array) -> tuple[float, Array]:
        response = h.conj() @ _complex(x)
        return -(np.abs(response) ** 2), -2.0 * _real(h * response)

    limits = [
        {"type": "ineq", "fun": margin, "jac": margin_slope},
        {"type": "eq", "fun": lambda x: x @ x - 1.0, "jac": lambda x: 2.0 * x},
    ]
    rng = np.random.default_rng(0)
    best = 0.0
    for _ in range(starts):
        options = {"maxiter": 200, "ftol": 1e-12}
        start = rng.normal(size=6)
        found = minimize(cost, start, jac=True, constraints=limits, method="SLSQP", options=options)
        feasible = margin(found.x).min() > -1e-8 and abs(found.x @ found.x - 1.0) < 1e-8
        best = max(best, -found.fun if feasible else 0.0)
    return float(best)


def _complex(x: Array) -> ComplexArray:
    return np.asarray(x[:3] + 1j * x[3:])


def _real(w: ComplexArray) -> Array:
    return np.concatenate([w.real, w.imag], axis=-1)


def no_vector_reaches(case: Reflection, value: float) -> tuple[bool, int]:
    """Tell whether no feasible vector has |h^H w|^2 >= value, and how many boxes that took.

    Every vector of unit length is, but for a phase that changes nothing,
    (cos s, sin s cos t e^jx, sin s sin t e^jy). In a box of half-side r around a point no vector is
    further from it than an angle of sqrt(3) r, and over an angle rho a form w^H A w changes by at
    most (largest - smallest eigenvalue of A) sin rho. Boxes that this does not rule out are split.
    """
    h = case.channel()
    forms = case.forms()[::4]  # fewer constraints rule out less, and what they do is ruled out
    reach, span = float(np.sum(np.abs(h) ** 2)), np.ptp(np.linalg.eigvalsh(forms), axis=1)
    side = np.pi / 16.0
    waiting = [(_centres(side), side)]
    boxes = 0
    while waiting:
        centres, side = waiting.pop()
        boxes += len(centres)
        w = _unit_vectors(centres)
        change = np.sin(np.sqrt(3.0) * side)
        near = np.abs(w @ h.conj()) ** 2 + reach * change >= value
        centres, w = centres[near], w[near]
        outer = (w[:, :, np.newaxis] * w[:, np.newaxis].conj()).reshape(-1, 9)
        ripple = np.abs((outer @ forms.transpose(2, 1, 0).reshape(9, -1)).real)
        left = np.all(ripple <= case.ripple + span * change, axis=1)
        if left.any() and side < 1e-3:
            return False, boxes
        parts = (centres[left][:, np.newaxis] + side / 2.0 * _CORNERS).reshape(-1, 4)
        waiting += [(parts[i : i + 100_000], side / 2.0) for i in range(0, len(parts), 100_000)]
    return True, boxes


_CORNERS = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 4), axis=-1).reshape(-1, 4)


def _centres(side: float) -> Array:
    quarter = np.arange(side, np.pi / 2.0, 2.0 * side)
    circle = np.arange(side - np.pi, np.pi, 2.0 * side)
    return np.stack(np.meshgrid(quarter, quarter, circle, circle), axis=-1).reshape(-1, 4)


def _unit_vectors(points: Array) -> ComplexArray:
    s, t, x, y = points.T
    parts = (
        np.cos(s),
        np.sin(s) * np.cos(t) * np.exp(1j * x),
        np.sin(s) * np.sin(t) * np.exp(1j * y),
    )
    return np.stack(parts, axis=-1)


def reflection(gain: complex) -> None:
    case = Reflection(gain)
    W = best_covariance(case)
    h = case.channel()
    relaxed = float((h.conj() @ W @ h).real)
    missed = np.max(np.abs(np.einsum("jmn,nm->j", case.forms(), W))) - case.ripple
    eigenvalues = np.linalg.eigvalsh(W)
    ratio = eigenvalues[-2] / eigenvalues[-1]
    vector = best_vector(case)
    print(
        f"gain {gain:.1f}: relaxation {relaxed:.6f}, ripple missed by {missed:.0e},"
        f" lambda2/lambda1 {ratio:.1e}; best vector found {vector:.6f},"
        f" {100.0 * (1.0 - vector / relaxed):.2f} % less"
    )
    if vector < 0.99 * relaxed:
        limit = vector + MARGIN * (relaxed - vector)
        proved, boxes = no_vector_reaches(case, limit)
        print(f"  every vector looked at, in {boxes} boxes: none reaches {limit:.6f}: {proved}")


# Other arrays ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pair:
    """Antennas, and the pattern of two beams that each use the first antenna and one other."""

    words: str
    places: list[tuple[int, int]]
    first: int
    second: int

    def covariance(self) -> ComplexArray:
        beams = np.zeros((len(self.places), 2), dtype=complex)
        beams[0] = beams[self.first, 0] = beams[self.second, 1] = 1.0
        return beams @ beams.T


PAIRS = (
    Pair("line, places 0 1 2 3", [(i, 0) for i in range(4)], 1, 3),
    Pair("line, places 0 1 3", [(0, 0), (1, 0), (3, 0)], 1, 2),
    Pair("plane, 2 x 2", [(0, 0), (1, 0), (0, 1), (1, 1)], 1, 2),
    Pair("plane, 2 x 3", [(i, j) for i in range(2) for j in range(3)], 3, 1),
)


def coefficients(places: list[tuple[int, int]]) -> Callable[[ComplexArray], ComplexArray]:
    """Return what sums a covariance's entries over pairs of antennas with one difference of place.

    These sums are the pattern's Fourier coefficients, so that they are what a pattern is.
    """
    apart = np.subtract(np.array(places)[:, np.newaxis], np.array(places))
    _, which = np.unique(apart.reshape(-1, 2), axis=0, return_inverse=True)
    sums = np.eye(which.max() + 1)[which.reshape(-1)].T
    return lambda covariance: sums @ covariance.reshape(-1)


def least_misfit(pair: Pair, starts: int = 100) -> float:
    """Return the least root mean square of a vector's pattern minus the pair's, relative to it."""
    pattern, count = coefficients(pair.places), len(pair.places)
    wanted = pattern(pair.covariance())

    def misfit(x: Array) -> Array:
        w = x[:count] + 1j * x[count:]
        error = (pattern(np.outer(w, w.conj())) - wanted) / np.linalg.norm(wanted)
        return np.concatenate([error.real, error.imag])

    rng = np.random.default_rng(0)
    found = (
        least_squares(misfit, rng.normal(size=2 * count), xtol=1e-15, ftol=1e-15, gtol=1e-15)
        for _ in range(starts)
    )
    return float(np.sqrt(2.0 * min(each.cost for each in found)))


def factored_misfit(pair: Pair) -> float:
    """Return the same for the spectral factor, which needs a uniform line."""
    columns = _columns(pair.covariance())
    wanted = autocorrelation(columns)
    error = autocorrelation(beam_of(columns)[:, np.newaxis]) - wanted
    return float(np.linalg.norm(error) / np.linalg.norm(wanted))


def main() -> None:
    print(f"line of sight, uniform line of antennas\n{EXPLAINED}\n{HEADING}")
    for setting in SETTINGS:
        print(line_of_sight(setting), flush=True)
    print(
        "\na reflection: most |h^H w|^2 of unit power, h = a(80 degrees) + gain a(155 degrees),"
        "\n3 antennas, cover +-45 degrees around 80, B = 0.05"
    )
    for gain in (0.0, 0.3j, 0.8j):
        reflection(gain)
    print("\nother arrays: least relative misfit of one vector's pattern to that of two beams")
    for pair in PAIRS:
        factored = f"; by spectral factor {factored_misfit(pair):.1e}" if pair is PAIRS[0] else ""
        print(f"{pair.words:22s} {least_misfit(pair):.1e}{factored}", flush=True)


if __name__ == "__main__":
    main()
