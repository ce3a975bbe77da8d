"""Filter algebra against sixty digits, the printed equations and exact invariances."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from echobeam.estimation.gaussian import propagate, update, wrap
from echobeam.values import Array

C = 299_792_458.0
CARRIER = 30e9


def radar_rows(theta: float, across: float) -> Array:
    """Rows of Eq. (43): rad, s and Hz against rad, m and m/s."""
    scale = 2.0 * CARRIER / C
    return np.array(
        [[1.0, 0.0, 0.0], [0.0, 2.0 / C, 0.0], [scale * across, 0.0, -scale * np.cos(theta)]]
    )


def first_update(rng: np.random.Generator, velocity_std: float) -> tuple[Array, ...]:
    """Prior, innovation, Jacobian and variance as at a first directional slot."""
    theta = rng.uniform(0.5, 1.3)
    std = np.array([0.06, 1.55, velocity_std])
    L = np.tril(rng.uniform(-0.4, 0.4, (3, 3)), -1) + np.eye(3)
    cov = std[:, None] * (L @ L.T) * std
    cov = 0.5 * (cov + cov.T)
    mean = np.array([theta, rng.uniform(80, 150), rng.uniform(-900, 900)])
    noise = np.array([0.011, 1.9e-9, 1.5e4])
    return mean, cov, noise * rng.normal(size=3), radar_rows(theta, mean[2]), noise**2


def textbook_exactly(
    mean: Array, cov: Array, innovation: Array, H: Array, variance: Array
) -> tuple[Array, Array]:
    """Eqs. (47)-(49) with 60 digits."""
    with mpmath.workdps(60):
        P, Hm, R = (mpmath.matrix(a.tolist()) for a in (cov, H, np.diag(variance)))
        K = P * Hm.T * (Hm * P * Hm.T + R) ** -1
        e = mpmath.matrix(mean.tolist()) + K * mpmath.matrix(innovation.tolist())
        posterior = (mpmath.eye(3) - K * Hm) * P
        return (
            np.array([float(x) for x in e]),
            np.array(posterior.tolist(), dtype=object).astype(float),
        )


def scaled_error(cov: Array, exact: Array) -> float:
    std = np.sqrt(np.diag(exact))
    return float(np.max(np.abs(cov - exact) / np.outer(std, std)))


@pytest.mark.parametrize("velocity_std", [0.5, 30.0, 828.0, 1e4])
def test_update_agrees_with_sixty_digits_also_when_the_velocity_is_hardly_known(
    velocity_std: float,
) -> None:
    rng = np.random.default_rng(3)
    for _ in range(10):
        case = first_update(rng, velocity_std)
        mean, cov = update(*case)
        exact_mean, exact_cov = textbook_exactly(*case)
        np.testing.assert_allclose(mean, exact_mean, rtol=1e-11)
        assert scaled_error(cov, exact_cov) < 1e-12


@pytest.mark.parametrize("velocity_std", [0.5, 30.0, 828.0])
def test_update_agrees_with_the_printed_equations_in_double_precision(velocity_std: float) -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        mean, cov, innovation, H, variance = first_update(rng, velocity_std)
        posterior, posterior_cov = update(mean, cov, innovation, H, variance)
        K = cov @ H.T @ np.linalg.inv(H @ cov @ H.T + np.diag(variance))
        np.testing.assert_allclose(posterior, mean + K @ innovation, rtol=1e-9)
        assert scaled_error((np.eye(3) - K @ H) @ cov, posterior_cov) < 1e-9


def test_covariance_keeps_its_digits_where_the_textbook_form_cancels() -> None:
    prior, noise = 1e8, 1e-10
    one = np.ones((1, 1))
    mean, cov = update(np.zeros(1), prior * one, np.array([2.0]), one, np.array([noise]))
    assert cov[0, 0] == pytest.approx(prior * noise / (prior + noise), rel=1e-14)
    assert mean[0] == pytest.approx(2.0)
    assert (1.0 - prior / (prior + noise)) * prior == 0.0  # what (I - K H) P makes of it


def test_posterior_is_symmetric_in_every_bit() -> None:
    _, cov = update(*first_update(np.random.default_rng(5), 828.0))
    assert np.array_equal(cov, cov.T)


def test_a_change_of_units_by_powers_of_two_changes_no_bit() -> None:
    mean, cov, innovation, H, variance = first_update(np.random.default_rng(6), 828.0)
    unit = 2.0 ** np.array([-7, 40, -20])
    plain = update(mean, cov, innovation, H, variance)
    scaled = update(mean, cov, innovation * unit, H * unit[:, None], variance * unit**2)
    assert np.array_equal(plain[0], scaled[0])
    assert np.array_equal(plain[1], scaled[1])


@pytest.mark.parametrize(
    ("spoil", "value"), [("variance", np.inf), ("variance", np.nan), ("innovation", np.nan)]
)
def test_a_component_that_was_not_measured_has_no_weight(spoil: str, value: float) -> None:
    mean, cov, innovation, H, variance = first_update(np.random.default_rng(7), 828.0)
    (variance if spoil == "variance" else innovation)[1] = value
    others = [0, 2]
    spoilt = update(mean, cov, innovation, H, variance)
    without = update(mean, cov, innovation[others], H[others], variance[others])
    assert np.array_equal(spoilt[0], without[0])
    assert np.array_equal(spoilt[1], without[1])


def test_nothing_measured_changes_no_bit_beside_objects_that_were_measured() -> None:
    cases = [first_update(np.random.default_rng(seed), 828.0) for seed in (8, 9)]
    mean, cov, innovation, H, variance = (
        np.stack([case[part] for case in cases]) for part in range(5)
    )
    innovation[0], variance[0] = np.nan, np.inf
    posterior, posterior_cov = update(mean, cov, innovation, H, variance)
    assert np.array_equal(posterior[0], mean[0])
    assert np.array_equal(posterior_cov[0], cov[0])
    assert not np.array_equal(posterior[1], mean[1])


def test_rows_that_are_zero_throughout_measure_nothing() -> None:
    mean, cov, innovation, _, variance = first_update(np.random.default_rng(10), 30.0)
    posterior, posterior_cov = update(mean, cov, innovation, np.zeros((3, 3)), variance)
    assert np.array_equal(posterior, mean)
    assert np.array_equal(posterior_cov, cov)


def test_a_measurement_without_noise_is_taken_as_it_is() -> None:
    mean, cov, innovation, H, variance = first_update(np.random.default_rng(11), 30.0)
    variance[0] = 0.0
    posterior, posterior_cov = update(mean, cov, innovation, H, variance)
    assert posterior[0] == pytest.approx(mean[0] + innovation[0], rel=1e-14)
    assert abs(posterior_cov[0, 0]) < 1e-28
    assert np.all(np.isfinite(posterior_cov))


def test_unknown_objects_stay_unknown_and_spoil_no_others() -> None:
    mean, cov, innovation, H, variance = first_update(np.random.default_rng(12), 30.0)
    alone = update(mean, cov, innovation, H, variance)
    means, covs = np.stack([mean, mean * np.nan]), np.stack([cov, cov * np.nan])
    both = update(means, covs, np.stack([innovation] * 2), np.stack([H] * 2), variance)
    assert np.array_equal(both[0][0], alone[0])
    assert np.array_equal(both[1][0], alone[1])
    assert np.isnan(both[0][1]).all()


def test_propagate_is_the_matrix_product_plus_noise() -> None:
    rng = np.random.default_rng(13)
    root, G = rng.normal(size=(2, 5, 4, 3, 3))
    cov = root @ np.swapaxes(root, -1, -2)
    G[..., 2, :] = [0.0, 0.0, 1.0]
    G[..., 1, 0] = 0.0
    noise = np.diag([0.1, 0.2, 0.0])
    expected = np.einsum("...ij,...jk,...lk->...il", G, cov, G) + noise
    result = propagate(cov, G, noise)
    np.testing.assert_allclose(result, expected, rtol=1e-12, atol=1e-13)
    assert np.array_equal(result, np.swapaxes(result, -1, -2))
    varied = noise * np.arange(5.0)[:, None, None, None]
    expected = expected + varied - noise
    np.testing.assert_allclose(propagate(cov, G, varied), expected, rtol=1e-12, atol=1e-13)


def test_propagate_through_a_singular_step_leaves_the_noise() -> None:
    G = np.diag([2.0, 0.0])
    result = propagate(np.full((2, 2), 3.0), G, np.diag([1.0, 5.0]))
    np.testing.assert_array_equal(result, [[13.0, 0.0], [0.0, 5.0]])


@pytest.mark.parametrize(
    ("angle", "expected"),
    [
        (np.pi, np.pi),
        (-np.pi, np.pi),
        (0.0, 0.0),
        (3.0, 3.0),
        (-3.0, -3.0),
        (2 * np.pi, 0.0),
        (-2 * np.pi, 0.0),
        (1.5 * np.pi, -0.5 * np.pi),
        (7.0, 7.0 - 2 * np.pi),
        (-7.0, 2 * np.pi - 7.0),
    ],
)
def test_wrap_returns_the_same_direction_between_minus_pi_and_pi(
    angle: float, expected: float
) -> None:
    assert wrap(np.array([angle]))[0] == pytest.approx(expected, abs=1e-15)


def test_wrap_keeps_every_bit_within_and_passes_nan() -> None:
    inside = np.random.default_rng(14).uniform(-np.pi, np.pi, 1000)
    assert np.array_equal(wrap(inside), inside)
    assert np.isnan(wrap(np.array([np.nan]))[0])
