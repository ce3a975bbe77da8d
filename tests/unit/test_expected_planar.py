"""Beams of the largest expected sum rate of planar arrays: Monte Carlo, eigenvectors, covers."""

from dataclasses import replace

import numpy as np
import pytest

import echobeam as eb
from echobeam.beamforming.expected.design import design_expected
from echobeam.beamforming.expected.directions import floor_nodes, nodes_of, sizes_needed
from echobeam.physics.planar import PlanarArray

from .. import beliefs as linear
from ..planar_beliefs import axes_of, beliefs, rates_at

EIGHT = PlanarArray(8, 8)


def normals(given, count=4_000, seed=7):
    return np.random.default_rng(seed).standard_normal((*given.active.shape, count, 2))


def matched(given):
    """Matched beams of equal power."""
    objects = given.active.shape[1]
    return given.array.steering(given.angles) / np.sqrt(given.array.n * objects)


@pytest.mark.parametrize("std", [0.003, 0.03, 0.1])
@pytest.mark.slow
def test_the_expected_rate_is_in_the_band_of_a_monte_carlo_integral(std):
    given = beliefs(10, 2, EIGHT, std, 2.0, seed=1)
    answer = design_expected(given)
    rate = rates_at(given, answer.beams, normals(given)).sum(axis=1)
    error = (rate.mean(axis=-1) - answer.expected_rate) / (rate.std(axis=-1) / np.sqrt(4_000))
    assert (error**2).sum() < 29.6  # chi-square with 10 degrees of freedom, 99.9 %


@pytest.mark.parametrize("std", [0.02, 0.1, 0.2])
def test_one_object_at_low_snr_has_the_principal_eigenvector(std):
    given = beliefs(4, 1, PlanarArray(6, 4), std, 1e-6, seed=2, angles=np.zeros((4, 1, 2)))
    answer = design_expected(given)
    z, p = np.polynomial.hermite_e.hermegauss(40)
    z = np.stack(np.meshgrid(z, z, indexing="ij"), axis=-1).reshape(-1, 2)
    p = np.multiply.outer(p, p).ravel() / p.sum() ** 2
    for trial in range(4):
        a = given.array.steering(z @ given.deviation[trial, 0])
        seen = p * (np.square(z @ given.deviation[trial, 0]).sum(axis=-1) <= 1.0)
        largest = np.linalg.eigvalsh((a.T * (seen / seen.sum())) @ a.conj())[-1]
        bound = largest / given.loss[trial, 0] / np.log(2.0)
        assert answer.expected_rate[trial] == pytest.approx(bound, rel=1e-3)


def test_a_narrow_belief_has_a_matched_beam():
    for std in (0.0, 1e-4):
        given = beliefs(4, 1, EIGHT, std, 3.0, seed=3, power=7.0)
        beams = design_expected(given).beams
        level = given.array.steering(given.angles) * np.sqrt(7.0 / 64)
        overlap = np.abs(np.sum(level.conj() * beams, axis=-1))
        np.testing.assert_allclose(overlap, 7.0, rtol=1e-5)


@pytest.mark.parametrize("snr", [1.0, 30.0])
@pytest.mark.slow
def test_a_wide_belief_gets_more_than_matched_beams_and_the_paper_s_cover(snr):
    """The cover (38f) of three standard deviations, by the same draws of the belief."""
    given = beliefs(5, 2, EIGHT, 0.08, snr, seed=4)
    z = normals(given)
    best = rates_at(given, design_expected(given).beams, z).sum(axis=1).mean(axis=-1)
    assert (best > rates_at(given, matched(given), z).sum(axis=1).mean(axis=-1)).all()
    for trial in range(5):
        F = given.deviation[trial]
        design = eb.design_beams(
            eb.BeamProblem(
                angles=given.angles[trial],
                distances=np.sqrt(given.loss[trial]),
                coverage_halfwidths=9.0 * np.swapaxes(F, -1, -2) @ F,
                ripple=6.4,
                min_rate=0.0,
                power=1.0,
                noise=1.0,
                array=EIGHT,
                resolution=0.03,
            )
        )
        one = given.taken(np.array([trial]))
        rate = rates_at(one, design.beams[None], z[[trial]]).sum(axis=1).mean()
        assert best[trial] > rate


def test_one_row_is_a_linear_array():
    """Of direction cosines along it alone, and beliefs without a width across."""
    angles = np.array([[0.3, -0.2], [0.1, 0.5]])
    std = np.array([[0.02, 0.05], [0.1, 0.01]])
    plane = beliefs(2, 2, PlanarArray(1, 12), 0.0, 4.0, seed=5)
    both = {"loss": plane.loss, "power": 2.0}
    plane = replace(
        plane,
        angles=np.stack([0.0 * angles, angles], axis=-1),
        deviation=axes_of(np.full((2, 2), np.pi / 2), np.stack([std, 0.0 * std], axis=-1)),
        **both,
    )
    z = np.random.default_rng(6).standard_normal((2, 2, 4_000))
    value = rates_at(plane, design_expected(plane).beams, np.stack([z, 0.0 * z], axis=-1))
    line = linear.beliefs(2, 2, 12, 0.0, 4.0, seed=5, **both)
    # the angle whose sine is the cosine, to first order: a narrow belief of the same width
    line = replace(line, angles=np.arcsin(angles), deviation=std / np.sqrt(1.0 - angles**2))
    same = linear.rates_at(line, design_expected(line).beams, z)
    np.testing.assert_allclose(
        value.sum(axis=1).mean(axis=-1), same.sum(axis=1).mean(axis=-1), rtol=0.02
    )


@pytest.mark.slow
def test_the_distance_follows_the_direction():
    """A belief that says: the larger u, the nearer; the beam leans that way."""
    given = beliefs(3, 1, EIGHT, 0.1, 1e-3, seed=8, stretch=np.full((3, 1, 2), [-2.0, 0.0]))
    answer = design_expected(given)
    z = normals(given, 40_000)
    rate = rates_at(given, answer.beams, z)[:, 0]
    error = (rate.mean(axis=-1) - answer.expected_rate) / (rate.std(axis=-1) / 200.0)
    assert np.abs(error).max() < 4.5  # of 3, after nodes and truncation
    mirrored = design_expected(replace(given, stretch=-given.stretch))
    assert (rates_at(given, mirrored.beams, z)[:, 0].mean(axis=-1) < rate.mean(axis=-1)).all()


def test_no_weight_goes_beyond_the_horizon():
    """A belief at the edge is that of its visible part, up to half a step of the nodes."""
    given = beliefs(
        1,
        1,
        EIGHT,
        0.0,
        1.0,
        angles=np.array([[[1.0, 0.0]]]),
        deviation=np.eye(2)[None, None] * 0.1,
    )
    z = normals(given, 40_000)
    seen = np.square(given.angles[..., None, :] + 0.1 * z).sum(axis=-1) <= 1.0
    answer = design_expected(given)
    rate = rates_at(given, answer.beams, z)[seen]
    assert answer.expected_rate[0] == pytest.approx(rate.mean(), rel=0.05)


@pytest.mark.slow
def test_floors_are_met_with_their_probability():
    given = beliefs(6, 2, EIGHT, 0.04, 5.0, seed=9, min_rate=np.full(2, 0.3))
    answer = design_expected(given)
    assert not answer.fallback.any()
    chance = (rates_at(given, answer.beams, normals(given, 20_000)) >= 0.3 * (1 - 1e-6)).mean(-1)
    assert (chance >= 0.95 - 3.0 * np.sqrt(0.05 * 0.95 / 20_000)).all()
    free = design_expected(replace(given, min_rate=np.zeros(2)))
    low = (rates_at(given, free.beams, normals(given, 20_000)) >= 0.3).mean(axis=-1)
    assert low.min() < 0.95  # without floors somebody would be short
    assert (answer.expected_rate <= free.expected_rate * (1.0 + 1e-3)).all()


def test_an_ellipse_has_its_probability():
    nodes = floor_nodes(0.05, (11, 7))
    radius = np.hypot(*nodes.T)
    draws = np.random.default_rng(10).standard_normal((200_000, 2))
    inside = np.hypot(*draws.T) <= radius.max()
    assert inside.mean() == pytest.approx(0.95, abs=2e-3)
    assert np.isclose(radius, radius.max()).sum() >= 12


@pytest.mark.parametrize("size", [(1, 1), (3, 1), (3, 7), (15, 11)])
def test_nodes_have_the_moments_of_two_normal_numbers(size):
    z, weight = nodes_of(size)
    assert len(z) == np.prod(size)
    cov = (z * weight[:, None]).T @ z
    expected = np.diag([float(count > 1) for count in size])
    np.testing.assert_allclose(cov, expected, atol=2e-3)


def test_narrow_axes_have_few_nodes():
    given = beliefs(1, 1, EIGHT, 0.0, 1.0)

    def needed(*stds):
        turned = replace(given, deviation=axes_of(np.zeros((1, 1)), np.array([[stds]])))
        return sizes_needed(turned, given.active).tolist()[0]

    assert needed(0.0, 0.0) == [1, 1]
    assert needed(0.01, 0.0) == [3, 1]
    assert needed(0.05, 0.01) == [7, 3]
    assert needed(0.3, 0.05) == [21, 7]


def test_two_polarisations_are_served_with_the_first():
    one = beliefs(3, 2, EIGHT, 0.03, 2.0, seed=11)
    two = replace(one, array=PlanarArray(8, 8, polarisations=2))
    single, double = design_expected(one), design_expected(two)
    np.testing.assert_array_equal(double.beams[..., :64], single.beams)
    assert not double.beams[..., 64:].any()
    np.testing.assert_array_equal(double.expected_rate, single.expected_rate)
    again = design_expected(replace(two, warm_start=double.beams))
    np.testing.assert_allclose(again.expected_rate, single.expected_rate, rtol=1e-3)


def test_lost_objects_get_nothing_and_harm_nobody():
    given = beliefs(2, 2, EIGHT, 0.02, 1.0, seed=12)
    angles = given.angles.copy()
    angles[0, 1, 1] = np.nan
    answer = design_expected(replace(given, angles=angles))
    assert answer.fallback.tolist() == [True, False]
    assert not answer.beams[0, 1].any()
    assert np.isfinite(answer.beams).all()
