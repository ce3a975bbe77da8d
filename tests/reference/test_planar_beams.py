"""Beams of planar arrays, examined by code of its own: lattice, steering vectors, constraints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import echobeam as eb
from echobeam.beamforming.relaxation.model import build_model
from echobeam.beamforming.relaxation.shape import best_shape

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

STEP = np.radians(1.35)


def ellipse(first: float, second: float, correlation: float = 0.0) -> Any:
    """Return the matrix of three standard deviations, given in hundredths of pi / 1.8."""
    s, t = np.radians([first, second])
    return 9.0 * np.array([[s * s, correlation * s * t], [correlation * s * t, t * t]])


def alone(array: eb.PlanarArray, cover: Any, ripple: float) -> eb.BeamProblem:
    """Return a problem of one object whose rate is log2(1 + gain)."""
    return eb.BeamProblem(
        [[0.1, -0.2]], [1.0], [cover], ripple * array.elements, 0, 1, 1, array=array,
        resolution=STEP,
    )  # fmt: skip


def pattern(array: eb.PlanarArray, beam: Any, points: Any) -> Any:
    """Return the power of a beam in some directions, element by element."""
    columns = beam.reshape(array.polarisations, array.rows, array.columns)
    phase = (
        np.arange(array.rows)[:, None] * points[:, 0, None, None]
        + np.arange(array.columns) * points[:, 1, None, None]
    )
    a = np.exp(2j * np.pi * array.spacing * phase)
    return np.sum(np.abs(np.einsum("gij,pij->gp", a.conj(), columns)) ** 2, axis=1)


def lattice(centre: Any, cover: Any, step: float) -> Any:
    """Return the points of a cover: of a square lattice, and 24 of the edge."""
    reach = int(1.0 / step) + 1
    steps = np.arange(-reach, reach + 1) * step
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = np.einsum("gi,ij,gj->g", grid, np.linalg.inv(cover), grid) <= 1.0
    turn = 2.0 * np.pi * np.arange(24) / 24
    edge = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ np.linalg.cholesky(cover).T
    return centre + np.concatenate([grid[inside], edge])


def excess(problem: eb.BeamProblem, beams: Any, step: float) -> float:
    """Return the largest excess over the ripple allowed, relative to it."""
    worst = -1.0
    for k, beam in enumerate(beams):
        power = np.sum(np.abs(beam) ** 2)
        if power == 0.0:
            continue
        points = lattice(problem.angles[k], problem.coverage_halfwidths[k], step)
        centre = pattern(problem.array, beam, problem.angles[k : k + 1])
        ripple = np.abs(pattern(problem.array, beam, points) - centre)
        worst = max(worst, ripple.max() / (problem.ripple[k] * power) - 1.0)
    return worst


def rates(problem: eb.BeamProblem, beams: Any) -> Any:
    gains = np.stack([pattern(problem.array, beam, problem.angles) for beam in beams], axis=1)
    own = np.diagonal(gains)
    noise = problem.noise * problem.distances**2
    return np.log1p(own / (gains.sum(axis=1) - own + noise)) / np.log(2.0)


def drawn(seed: int, polarisations: int = 1) -> eb.BeamProblem:
    rng = np.random.default_rng(seed)
    rows, columns = [(4, 4), (4, 8), (8, 4), (8, 8)][seed % 4]
    count = 1 + seed % 3
    angle, radius = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0, 0.8, count))
    root = rng.normal(size=(count, 2, 2)) * np.radians(rng.uniform(1, 6, (count, 1, 1)))
    cover = root @ root.transpose(0, 2, 1) + np.radians(0.5) ** 2 * np.eye(2)
    return eb.BeamProblem(
        np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1),
        rng.uniform(60, 150, count), cover, rows * columns * rng.uniform(0.05, 0.4, count),
        0.2 if seed % 2 else 0.0, 10 ** rng.uniform(2, 5), 1.0,
        array=eb.PlanarArray(rows, columns, polarisations=polarisations), resolution=0.02,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "cover", "ripple"),
    [
        ((8, 8), ellipse(1, 0.7), 0.1),
        ((8, 8), ellipse(2, 1.4, 0.5), 0.1),
        ((8, 8), ellipse(4, 2.8), 0.3),
    ],
)
def test_one_beam_reaches_the_bound_on_any_rank_under_usual_covers(size, cover, ripple):
    problem = alone(eb.PlanarArray(*size), cover, ripple)
    bound = best_shape(build_model(problem).beams[0]).bound
    gain = 2.0 ** eb.design_beams(problem).objective - 1.0
    assert bound * (1.0 - 1e-6) <= gain <= bound * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("size", "cover", "least"),
    [((8, 8), ellipse(4, 2.8), 22.519), ((16, 4), ellipse(3, 2.1, 0.5), 23.698)],
)
def test_two_polarisations_close_the_gap_of_one(size, cover, least):
    one, two = (alone(eb.PlanarArray(*size, polarisations=r), cover, 0.1) for r in (1, 2))
    bound = best_shape(build_model(one).beams[0]).bound
    gain, twice = (2.0 ** eb.design_beams(problem).objective - 1.0 for problem in (one, two))
    assert least <= gain < bound * (1.0 - 1e-5)
    assert bound * (1.0 - 1e-6) <= twice <= bound * (1.0 + 1e-9)


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.2, -0.5)])
@pytest.mark.parametrize(
    ("size", "cover", "ripple", "polarisations", "gain"),
    [
        ((8, 8), ellipse(1, 0.7), 0.1, 1, 60.2725),
        ((8, 8), ellipse(2, 1.4, 0.5), 0.1, 1, 40.4680),
        ((8, 8), ellipse(4, 2.8), 0.3, 1, 35.7285),
        ((8, 8), ellipse(4, 2.8), 0.1, 2, 22.8472),
        ((16, 4), ellipse(3, 2.1, 0.5), 0.1, 2, 23.7063),
    ],
)
def test_gains_are_those_of_an_earlier_relaxation_written_apart_wherever_the_cover_lies(
    size, cover, ripple, polarisations, gain, centre
):
    array = eb.PlanarArray(*size, polarisations=polarisations)
    problem = eb.BeamProblem(
        [centre], [1.0], [cover], ripple * array.elements, 0, 1, 1, array=array, resolution=STEP
    )
    found = eb.design_beams(problem)
    assert 2.0**found.objective - 1.0 == pytest.approx(gain, rel=1e-5)
    assert found.proof.bound >= found.objective * (1.0 - 1e-9)


@pytest.mark.parametrize("polarisations", [1, 2])
@pytest.mark.parametrize("seed", range(8))
def test_every_constraint_holds_on_the_lattice_and_nearly_on_a_finer_one(seed, polarisations):
    problem = drawn(seed, polarisations)
    answer = eb.design_beams(problem)
    assert answer.outcome in ("converged", "floors lowered")
    assert np.sum(np.abs(answer.beams) ** 2) <= problem.power * (1.0 + 1e-9)
    assert excess(problem, answer.beams, problem.resolution) <= 1e-7
    assert excess(problem, answer.beams, problem.resolution / 3) <= 0.05
    reached = rates(problem, answer.beams)
    np.testing.assert_allclose(answer.rates, reached, rtol=1e-9)
    if answer.outcome == "converged":
        assert np.all(reached >= problem.min_rate * (1.0 - 1e-7))
    assert answer.proof.bound >= answer.objective * (1.0 - 1e-9)


def restarted(problem, beams):
    return eb.BeamProblem(
        problem.angles, problem.distances, problem.coverage_halfwidths, problem.ripple,
        problem.min_rate, problem.power, problem.noise, array=problem.array,
        resolution=problem.resolution, warm_start=beams,
    )  # fmt: skip


@pytest.mark.parametrize("polarisations", [1, 2])
@pytest.mark.parametrize("seed", range(4))
def test_an_answer_started_from_itself_is_not_worse_and_keeps_all(seed, polarisations):
    problem = drawn(seed, polarisations)
    answer = eb.design_beams(problem)
    again = eb.design_beams(restarted(problem, answer.beams))
    assert again.objective >= answer.objective * (1.0 - 1e-9)
    assert again.status == answer.status
    assert np.sum(np.abs(again.beams) ** 2) <= problem.power * (1.0 + 1e-9)
    assert excess(problem, again.beams, problem.resolution) <= 1e-7
    if again.status == "optimal":
        assert np.all(rates(problem, again.beams) >= problem.min_rate * (1.0 - 1e-7))


@pytest.mark.parametrize("polarisations", [1, 2])
def test_without_a_cover_the_beam_is_matched(polarisations):
    array = eb.PlanarArray(4, 6, polarisations=polarisations)
    problem = eb.BeamProblem([[0.3, 0.4]], [50.0], np.zeros((1, 2, 2)), 1, 0, 200, 1, array=array)
    best = math.log2(1.0 + 24 * 200 / 50.0**2)
    assert eb.design_beams(problem).objective == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_swapping_rows_and_columns_changes_nothing(seed):
    problem = drawn(seed)
    swapped = eb.BeamProblem(
        problem.angles[:, ::-1], problem.distances, problem.coverage_halfwidths[:, ::-1, ::-1],
        problem.ripple, problem.min_rate, problem.power, problem.noise,
        array=eb.PlanarArray(problem.array.columns, problem.array.rows),
        resolution=problem.resolution,
    )  # fmt: skip
    first, second = eb.design_beams(problem), eb.design_beams(swapped)
    assert second.objective == pytest.approx(first.objective, rel=1e-4)  # other points of the edge


@pytest.mark.parametrize("polarisations", [1, 2])
@pytest.mark.parametrize("count", [1, 2])
def test_swapping_rows_and_columns_swaps_ellipses_along_the_axes_exactly(count, polarisations):
    """The points of their edges, too, are those of the ellipses swapped."""
    rng = np.random.default_rng(count)
    angles, size = np.array([[0.2, -0.3], [-0.4, 0.1]])[:count], (4, 8)
    cover = np.stack([np.diag(half) ** 2 for half in rng.uniform(0.05, 0.15, (count, 2))])
    objectives = []
    for turn in (1, -1):
        array = eb.PlanarArray(*size[::turn], polarisations=polarisations)
        problem = eb.BeamProblem(
            angles[:, ::turn], [100.0, 80.0][:count], cover[:, ::turn, ::turn], 5, 0, 1e4, 1,
            array=array, resolution=0.02,
        )  # fmt: skip
        objectives.append(eb.design_beams(problem).objective)
    assert objectives[0] == pytest.approx(objectives[1], rel=1e-6)


def test_a_line_of_elements_is_a_linear_array():
    angles, distances, power = np.radians([70.0, 130.0]), [100.0, 140.0], 1e4
    line = eb.BeamProblem(angles, distances, [0, 0], 1, 0, power, 1, n_tx=12)
    u = np.stack([np.zeros(2), np.sin(angles)], axis=1)
    row = eb.BeamProblem(
        u, distances, np.zeros((2, 2, 2)), 1, 0, power, 1, array=eb.PlanarArray(1, 12)
    )
    first, second = eb.design_beams(line), eb.design_beams(row)
    assert second.objective == pytest.approx(first.objective, rel=1e-7)


@pytest.mark.slow
def test_the_relaxation_bounds_what_the_direct_solver_finds():
    problem = alone(eb.PlanarArray(8, 8), ellipse(4, 2.8), 0.1)
    relaxed, direct = eb.design_beams(problem, method="sdp"), eb.design_beams(problem)
    assert relaxed.outcome == "flat"  # no single beam has its pattern
    assert "bound" in relaxed.message
    assert relaxed.upper_bound >= direct.objective
    certified = eb.design_beams(problem, certify=True)
    assert certified.upper_bound == pytest.approx(math.log2(1.0 + 22.84718), rel=1e-5)
    assert "was not reached" in certified.message


@pytest.mark.parametrize("polarisations", [1, 2])
@pytest.mark.parametrize("seed", [0, 1, 2, 4])
def test_the_bound_of_the_relaxation_is_above_the_beams_of_the_direct_solver(seed, polarisations):
    problem = drawn(seed, polarisations)
    relaxed, direct = eb.design_beams(problem, method="sdp"), eb.design_beams(problem)
    if direct.status == "optimal":
        assert relaxed.proof.bound >= direct.objective * (1.0 - 1e-9)
        assert direct.proof.bound >= direct.objective * (1.0 - 1e-9)
    if relaxed.status == "optimal":
        assert excess(problem, relaxed.beams, problem.resolution) <= 1e-6


@pytest.mark.parametrize("polarisations", [1, 2])
def test_branch_and_bound_proves_beams_of_several_objects_under_narrow_ellipses(polarisations):
    """The gap that is left without it is that of a bound without interference."""
    array = eb.PlanarArray(6, 8, polarisations=polarisations)
    problem = eb.BeamProblem(
        [[0.1, -0.2], [0.35, 0.1], [-0.2, 0.3]], [100.0, 90.0, 120.0],
        [ellipse(0.5, 0.4), ellipse(0.6, 0.4, 0.3), ellipse(0.5, 0.5)],
        0.1 * array.elements, 0.1, 1e4, 1.0, array=array, resolution=STEP,
    )  # fmt: skip
    free, proved = eb.design_beams(problem), eb.design_beams(problem, certify=True)
    assert proved.gap <= 1e-4 < free.gap
    assert proved.objective >= free.objective * (1.0 - 1e-9)
    assert excess(problem, proved.beams, problem.resolution) <= 1e-6


def test_a_batch_of_planar_problems_answers_like_its_members():
    from echobeam.beamforming.design import design_batch
    from echobeam.beamforming.problem import ProblemBatch

    array, rng = eb.PlanarArray(4, 8), np.random.default_rng(5)
    covers = np.stack([ellipse(1 + k, 1.5) for k in range(6)]).reshape(3, 2, 2, 2)
    batch = ProblemBatch(
        angles=rng.uniform(-0.5, 0.5, (3, 2, 2)),
        loss=rng.uniform(5e3, 2e4, (3, 2)),
        coverage_halfwidths=covers,
        active=np.array([[1, 1], [1, 0], [1, 1]]) > 0,
        ripple=np.array([3.0, 4.0]),
        min_rate=np.zeros(2),
        power=1e4,
        array=array,
        resolution=0.02,
    )
    answer = design_batch(batch)
    for trial in range(3):
        one = design_batch(batch.taken(np.array([trial])))
        np.testing.assert_array_equal(answer.beams[trial], one.beams[0])
        own = eb.design_beams(batch.problem(trial))
        assert answer.objective[trial] == pytest.approx(own.objective, rel=1e-9)
