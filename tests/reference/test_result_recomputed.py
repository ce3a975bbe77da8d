"""A result's raw arrays put through the paper's equations, written out here once more.

Nothing of echobeam but the run itself is used: whoever doubts the numbers can do the same.
"""

import tomllib

import numpy as np
import pytest

import echobeam as eb

C = 299_792_458.0
RTOL = 1e-9


@pytest.fixture(scope="module", params=["paper-multi", "paper-long"])
def result(request):
    scenario = eb.load_scenario(request.param, {"frame.frames": 2, "trials": 4})
    return eb.simulate(
        scenario, schemes=["temporal", "pilot", "water-filling", "omni", "genie"], trials=4, seed=3
    )


def steering(theta, n):
    return np.exp(1j * np.pi * np.sin(theta)[..., None] * np.arange(n))


def beams(result, scheme):
    parts = result["beam"].sel(scheme=scheme)
    return parts.sel(part="re").values + 1j * parts.sel(part="im").values


def phase(result, scheme):
    return result["phase"].sel(scheme=scheme).values


@pytest.mark.parametrize("scheme", ["temporal", "pilot", "water-filling", "genie"])
def test_sinr_rate_and_echo_of_directional_slots(result, scheme):
    """Eqs. (8), (10), (12), (16) with alpha_0 = sigma_C^2 = sigma^2 = 1, G_m = 10."""
    at = phase(result, scheme) == "directional"
    truth = result["truth"].values[:, at]
    w = beams(result, scheme)[:, at]
    theta, d = truth[..., 0], truth[..., 1]
    gains = np.abs(np.einsum("...kn,...in->...ki", steering(theta, 30).conj(), w)) ** 2
    power = gains / d[..., None] ** 2
    signal = np.einsum("...kk->...k", power)
    sinr = signal / (power.sum(axis=-1) - signal + 1.0)
    found = result.sel(scheme=scheme).isel(slot=at)
    np.testing.assert_allclose(found["sinr"].values, sinr, rtol=RTOL, atol=1e-18)
    np.testing.assert_allclose(found["rate"].values, np.log2(1 + sinr), rtol=1e-7, atol=1e-15)
    beta = np.abs(120 + 120j) / d**2
    snr = 10 * beta**2 * gains.sum(axis=-1)
    np.testing.assert_allclose(found["radar_snr"].values, snr, rtol=RTOL)


@pytest.mark.parametrize("scheme", ["temporal", "omni", "pilot"])
def test_sinr_and_echo_of_omnidirectional_slots(result, scheme):
    """Eqs. (7), (14); a pilot carries no data."""
    at = phase(result, scheme) != "directional"
    d = result["truth"].values[:, at][..., 1]
    k = d.shape[-1]
    share = 1 / (d**2 * k)
    sinr = share / (share * (k - 1) + 1) * (scheme != "pilot")
    found = result.sel(scheme=scheme).isel(slot=at)
    np.testing.assert_allclose(found["sinr"].values, sinr, rtol=RTOL)
    np.testing.assert_allclose(found["radar_snr"].values, 10 * 28800 / d**4, rtol=RTOL)
    assert np.isnan(found["beam"].values).all()


def printed_bounds(snr, theta):
    """Eqs. (20)-(23) with the antenna spacing in (23), N_t = N_r = 30, half a wavelength."""
    xi2 = np.pi**2 * np.cos(theta) ** 2 * (30**2 - 1) / 12
    return np.stack(
        [1 / (snr * 900 * xi2), 1 / (snr * 900 * 8e7**2), 1 / (snr * 900 * 1e-5**2)], axis=-1
    )


@pytest.mark.parametrize("scheme", ["temporal", "water-filling", "omni"])
def test_nature_draws_with_the_printed_bounds_at_the_truth(result, scheme):
    found = result.sel(scheme=scheme)
    variance = found["true_var"].values
    bound = printed_bounds(found["radar_snr"].values, result["truth"].values[..., 0])
    measured = np.isfinite(found["measured"].values)
    assert measured.any()
    np.testing.assert_allclose(variance[measured], bound[measured], rtol=RTOL)
    assert np.isinf(variance[~measured]).all()


@pytest.mark.parametrize("scheme", ["temporal", "water-filling", "omni"])
def test_a_scheme_is_given_the_bounds_at_its_own_prediction_and_beams(result, scheme):
    """At the prior where there is one, at the measured angle and distance where there is none."""
    found = result.sel(scheme=scheme)
    variance, value = found["measured_var"].values, found["measured"].values
    prior = found["predicted"].values
    known = np.isfinite(prior[..., 0])
    theta = np.where(known, prior[..., 0], value[..., 0])
    d = np.where(known, prior[..., 1], C * value[..., 1] / 2)
    omni = (found["mode"].values == 0)[..., None]
    w = np.nan_to_num(beams(result, scheme))
    gains = np.abs(np.einsum("...kn,...in->...ki", steering(theta, 30).conj(), w)) ** 2
    power = np.where(omni, 1.0, gains.sum(axis=-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = printed_bounds(10 * 28800 / d**4 * power, theta)
    measured = np.isfinite(value)
    np.testing.assert_allclose(variance[measured], bound[measured], rtol=1e-8)
    assert np.isinf(variance[~measured]).all()
    assert not np.allclose(variance[measured], found["true_var"].values[measured], rtol=1e-6)


def test_with_the_known_variance_a_scheme_is_given_that_of_nature():
    scenario = eb.load_scenario("paper-multi", {"radar.variance": "known"})
    known = eb.simulate(scenario, schemes=["water-filling"], trials=3, seed=3)
    np.testing.assert_array_equal(known["measured_var"].values, known["true_var"].values)
    assert np.isfinite(known["true_var"].values).any()


@pytest.mark.parametrize("scheme", ["temporal", "water-filling"])
def test_filter_steps(result, scheme):
    """Eqs. (32), (42) corrected, (43)-(49), from one stored slot to the next."""
    found = result.sel(scheme=scheme)
    mean, cov = found["estimated"].values, found["estimated_cov"].values
    prior, prior_cov = found["predicted"].values, found["predicted_cov"].values
    dt, vu, thu = 0.01, 15.0, -np.pi / 2
    q_s = np.diag([np.deg2rad(0.02) ** 2, 0.2**2, 0.5**2])
    for slot in range(1, mean.shape[1]):
        g, jacobian = evolution(mean[:, slot - 1], vu, thu, dt)
        same_or_given_up(prior[:, slot], g)
        expected = jacobian @ cov[:, slot - 1] @ np.swapaxes(jacobian, -1, -2) + q_s
        close(prior_cov[:, slot], expected, prior[:, slot])
        if phase(result, scheme)[slot] == "omni":
            kept = np.isfinite(prior[:, slot, :, 0])  # a lost object is detected anew
            np.testing.assert_array_equal(mean[:, slot][kept], prior[:, slot][kept])
            continue
        h, H = measurement(prior[:, slot], vu, thu)
        variance = found["measured_var"].values[:, slot]  # infinite where nothing was measured
        R = np.where(np.eye(3) == 1.0, variance[..., None], 0.0)
        P = prior_cov[:, slot]
        scale = 1 / np.sqrt(variance)  # for the inverse's sake
        S = (H @ P @ np.swapaxes(H, -1, -2) + R) * scale[..., None] * scale[..., None, :]
        gain = (P @ np.swapaxes(H, -1, -2) * scale[..., None, :]) @ np.linalg.inv(S)
        gain = gain * scale[..., None, :]
        innovation = found["measured"].values[:, slot] - h
        innovation[..., 0] = np.arctan2(np.sin(innovation[..., 0]), np.cos(innovation[..., 0]))
        updated = prior[:, slot] + np.einsum("...ij,...j->...i", gain, innovation)
        same_or_given_up(mean[:, slot], updated)
        close(cov[:, slot], (np.eye(3) - gain @ H) @ P, mean[:, slot])


def same_or_given_up(found, expected):
    """Compare states; a track is given up where, and only where, no object can have its state."""
    theta, d = expected[..., 0], expected[..., 1]
    possible = (theta > 0) & (theta < np.pi) & (d > 0)
    np.testing.assert_array_equal(np.isfinite(found[..., 0]), possible)
    assert possible.mean() > 0.8
    np.testing.assert_allclose(found[possible], expected[possible], rtol=RTOL)


def close(found, expected, state=None):
    """Compare covariances at 1e-9 of sqrt(P_ii P_jj), where there is a state."""
    if state is not None:
        kept = np.isfinite(state[..., 0])
        found, expected = found[kept], expected[kept]
    deviation = np.sqrt(np.einsum("...ii->...i", expected))
    scale = deviation[..., None] * deviation[..., None, :]
    assert np.max(np.abs(found - expected) / scale) < RTOL


def evolution(e, vu, thu, dt):
    theta, d, v = np.moveaxis(e, -1, 0)
    one, two = vu * np.sin(thu) * dt, v * dt - vu * np.cos(thu) * dt
    p = one * np.sin(theta) + two * np.cos(theta)
    q = two * np.sin(theta) - one * np.cos(theta)
    g = np.stack([theta - q / (d + p), d + p, v], axis=-1)
    zero, unit = np.zeros_like(theta), np.ones_like(theta)
    rows = [
        [1 - (p * d + one**2 + two**2) / (d + p) ** 2, q / (d + p) ** 2,
         -(d * np.sin(theta) + one) * dt / (d + p) ** 2],
        [one * np.cos(theta) - two * np.sin(theta), unit, dt * np.cos(theta)],
        [zero, zero, unit],
    ]  # fmt: skip
    return g, np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def measurement(e, vu, thu, fc=30e9):
    theta, d, v = np.moveaxis(e, -1, 0)
    mu = -2 * (v * np.cos(theta) - vu * np.cos(theta + thu)) * fc / C
    h = np.stack([theta, 2 * d / C, mu], axis=-1)
    zero, unit = np.zeros_like(theta), np.ones_like(theta)
    rows = [
        [unit, zero, zero],
        [zero, unit * 2 / C, zero],
        [2 * fc * (v * np.sin(theta) - vu * np.sin(theta + thu)) / C, zero,
         -2 * fc * np.cos(theta) / C],
    ]  # fmt: skip
    return h, np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def test_the_truth_moves_by_exact_geometry(result):
    """Positions on the road and the height, from the states alone."""
    truth, time = result["truth"].values, result["time"].values
    x = truth[..., 1] * np.cos(truth[..., 0])
    height = truth[..., 1] * np.sin(truth[..., 0])
    np.testing.assert_allclose(
        height,
        np.broadcast_to((100 - 15 * time)[:, None], x.shape[1:])[None].repeat(4, 0),
        rtol=1e-12,
    )
    start, v, a = np.array([100 / np.tan(np.deg2rad(75)), -100.0]), [30, -3], [-5, 1]
    for k in range(2):
        np.testing.assert_allclose(
            x[0, :, k], start[k] + v[k] * time + a[k] * time**2 / 2, rtol=1e-10
        )


def test_the_first_state_is_the_first_measurement(result):
    """Note 2, with MSE_0 = H^-1 Q_m H^-T."""
    found = result.sel(scheme="temporal").isel(slot=0)
    theta, tau, mu = np.moveaxis(found["measured"].values, -1, 0)
    v = (15 * np.cos(theta - np.pi / 2) - C * mu / (2 * 30e9)) / np.cos(theta)
    np.testing.assert_allclose(
        found["estimated"].values, np.stack([theta, C * tau / 2, v], axis=-1), rtol=RTOL
    )
    _, H = measurement(found["estimated"].values, 15.0, -np.pi / 2)
    inverse = np.linalg.inv(H)
    R = found["measured_var"].values[..., None] * np.eye(3)
    close(found["estimated_cov"].values, inverse @ R @ np.swapaxes(inverse, -1, -2))


def test_the_scenario_inside_runs_again(result):
    document = tomllib.loads(result.attrs["scenario"])
    again = eb.Scenario.model_validate(document)
    assert eb.simulate(again, schemes=["water-filling"], trials=1, seed=3)["rate"].shape[1] == 1
