"""Moments of mixtures against NumPy's weighted covariance, Stone Soup, and turned circles."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.tracking.association import moment_matched


def mixture(seed: int, lead: tuple[int, ...] = (4, 3), parts: int = 5) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(*lead, parts, 3, 3))
    weight = rng.dirichlet(np.ones(parts), lead)
    return weight, rng.normal(size=(*lead, parts, 3)), root @ np.swapaxes(root, -1, -2)


def test_moments_are_those_of_numpy() -> None:
    weight, mean, cov = mixture(1)
    found, found_cov = moment_matched(weight, mean, cov)
    for i in np.ndindex(4, 3):
        np.testing.assert_allclose(found[i], np.average(mean[i], axis=0, weights=weight[i]))
        spread = np.cov(mean[i].T, aweights=weight[i], ddof=0)
        within = np.einsum("k,kij->ij", weight[i], cov[i])
        np.testing.assert_allclose(found_cov[i], spread + within, rtol=1e-12, atol=1e-13)


def test_moments_are_those_of_stone_soup() -> None:
    functions = pytest.importorskip("stonesoup.functions")
    from stonesoup.types.array import StateVectors

    weight, mean, cov = mixture(2, ())
    expected = functions.gm_reduce_single(
        StateVectors(mean.T), np.moveaxis(cov, 0, -1), weight / weight.sum()
    )
    found, found_cov = moment_matched(weight, mean, cov)
    np.testing.assert_allclose(found, np.asarray(expected[0], dtype=float)[:, 0], rtol=1e-12)
    np.testing.assert_allclose(found_cov, np.asarray(expected[1], dtype=float), rtol=1e-12)


def test_weights_need_no_normalisation_and_one_part_is_itself() -> None:
    weight, mean, cov = mixture(3)
    for plain, scaled in zip(
        moment_matched(weight, mean, cov), moment_matched(1e-30 * weight, mean, cov), strict=True
    ):
        np.testing.assert_allclose(scaled, plain, rtol=1e-12, atol=1e-14)
    one, one_cov = moment_matched(np.ones((4, 3, 1)), mean[..., :1, :], cov[..., :1, :, :])
    assert np.array_equal(one, mean[..., 0, :])
    assert np.array_equal(one_cov, cov[..., 0, :, :])


def test_parts_of_weight_zero_are_not_read() -> None:
    weight, mean, cov = mixture(4)
    weight[..., 2] = 0.0
    without = moment_matched(
        *(np.delete(part, 2, axis=2) for part in (weight, mean, cov)), angles=(0,)
    )
    mean[..., 2, :], cov[..., 2, :, :] = np.nan, np.inf
    found = moment_matched(weight, mean, cov, angles=(0,))
    np.testing.assert_allclose(found[0], without[0], rtol=1e-13)
    np.testing.assert_allclose(found[1], without[1], rtol=1e-13)


def test_no_weight_at_all_gives_nan_beside_others() -> None:
    weight, mean, cov = mixture(5, (2,))
    weight[0] = 0.0
    found, found_cov = moment_matched(weight, mean, cov)
    assert np.isnan(found[0]).all()
    assert np.isnan(found_cov[0]).all()
    assert np.isfinite(found[1]).all()


@pytest.mark.parametrize("turn", [0.5, 2.0, np.pi, -3.0])
def test_a_circle_that_is_turned_turns_the_mean_and_nothing_else(turn: float) -> None:
    weight, mean, cov = mixture(6)
    mean[..., 1] *= 0.5  # so that the parts are within half a turn of each other
    plain, plain_cov = moment_matched(weight, mean, cov)
    turned = mean.copy()
    turned[..., 1] = np.angle(np.exp(1j * (mean[..., 1] + turn)))
    found, found_cov = moment_matched(weight, turned, cov, angles=(1,))
    np.testing.assert_allclose(
        np.exp(1j * found[..., 1]), np.exp(1j * (plain[..., 1] + turn)), atol=1e-12
    )
    assert (np.abs(found[..., 1]) <= np.pi).all()
    np.testing.assert_allclose(found_cov, plain_cov, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[..., [0, 2]], plain[..., [0, 2]], rtol=1e-12)


def test_two_angles_on_both_sides_of_half_a_turn() -> None:
    mean = np.array([[np.pi - 0.1], [-np.pi + 0.1]])
    found, cov = moment_matched(np.array([0.5, 0.5]), mean, np.zeros((2, 1, 1)), angles=(0,))
    assert abs(found[0]) == pytest.approx(np.pi)
    assert cov[0, 0] == pytest.approx(0.01)


def test_input_that_cannot_be_used_is_refused() -> None:
    weight, mean, cov = mixture(7)
    with pytest.raises(ValueError, match="negative"):
        moment_matched(-weight, mean, cov)
    with pytest.raises(ValueError, match="do not fit"):
        moment_matched(weight[..., :2], mean, cov)
