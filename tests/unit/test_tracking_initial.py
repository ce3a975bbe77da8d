"""The first state against the inverse of the measurement at high precision, and its edges."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from echobeam.tracking.initial import VELOCITY_STD_BOUND
from echobeam.tracking.measurement import measurement_jacobian, predict_measurement
from echobeam.values import GaussianState

from ..forms import Echo, flying, initial_state

CARRIER = 30e9
UAV = flying(15.0, -np.pi / 2)
STD = np.array([0.06, 1.03e-8, 8.3e4])
TRUTH = np.array([[1.05, 115.0, 30.0], [2.4, 141.0, -3.0]])


def measured(state: np.ndarray, std: np.ndarray = STD) -> Echo:
    value = predict_measurement(state, UAV.speed, UAV.heading, CARRIER)
    return Echo(value, np.broadcast_to(std**2, value.shape).copy())


def altered(
    radar: Echo,
    value: dict[tuple[int, ...], float] | None = None,
    variance: dict[tuple[int, ...], float] | None = None,
) -> Echo:
    """The same measurement with some entries replaced."""
    values, variances = radar.value.copy(), radar.variance.copy()
    for array, changes in ((values, value or {}), (variances, variance or {})):
        for where, number in changes.items():
            array[where] = number
    return Echo(values, variances)


def test_a_measurement_without_error_gives_the_state_back() -> None:
    state = initial_state(measured(TRUTH), UAV, CARRIER)
    np.testing.assert_allclose(state.mean, TRUTH, rtol=1e-12)
    assert state.known.all()


def test_covariance_is_the_propagated_error_of_the_measurement() -> None:
    state = initial_state(measured(TRUTH), UAV, CARRIER)
    H = measurement_jacobian(TRUTH, UAV.speed, UAV.heading, CARRIER)
    for k in range(2):
        with mpmath.workdps(50):
            inverse = mpmath.matrix(H[k].tolist()) ** -1
            expected = inverse * mpmath.diag([float(s) ** 2 for s in STD]) * inverse.T
            expected = np.array(expected.tolist(), dtype=object).astype(float)
        np.testing.assert_allclose(state.cov[k], expected, rtol=1e-10)
    np.testing.assert_array_equal(state.cov, np.swapaxes(state.cov, -1, -2))


def test_velocity_of_the_papers_first_slot_is_hardly_known() -> None:
    # Ledger, Note 2: 8.3e4 Hz are 414 m/s along the line of sight, 828 m/s along the road.
    state = initial_state(measured(np.array([np.pi / 3, 115.47, 30.0])), UAV, CARRIER)
    assert np.sqrt(state.cov[2, 2]) == pytest.approx(829.0, abs=2.0)


@pytest.mark.parametrize(
    ("part", "component", "number"),
    [
        *(("value", 0, angle) for angle in (0.0, np.pi, -0.2, np.nan)),
        *(("value", 1, delay) for delay in (0.0, -1e-9, np.nan)),
        *(("variance", component, gone) for component in (0, 1) for gone in (np.inf, np.nan)),
    ],
)
@pytest.mark.parametrize("velocity_std", [None, 30.0])
def test_an_unphysical_first_measurement_leaves_the_object_unknown(
    part: str, component: int, number: float, velocity_std: float | None
) -> None:
    radar = altered(measured(TRUTH), **{part: {(0, component): number}})
    state = initial_state(radar, UAV, CARRIER, velocity_std)
    np.testing.assert_array_equal(state.known, [False, True])
    assert np.isnan(state.mean[0]).all()
    assert np.isnan(state.cov[0]).all()
    assert np.isfinite(state.cov[1]).all()


def without_doppler() -> Echo:
    return altered(measured(TRUTH[0]), {(2,): np.nan}, {(2,): np.inf})


@pytest.mark.parametrize(
    "radar",
    [
        without_doppler(),
        altered(measured(TRUTH[0]), {(2,): np.nan}),
        measured(np.array([np.pi / 2, 100.0, 20.0])),
    ],
    ids=["none", "no number", "90 degrees"],
)
def test_a_doppler_that_says_nothing_of_the_velocity_leaves_it_open(radar: Echo) -> None:
    state = initial_state(radar, UAV, CARRIER)
    assert state.known
    assert state.mean[2] == 0.0
    assert state.cov[2, 2] == VELOCITY_STD_BOUND**2
    assert state.cov[0, 2] == 0.0


def test_the_bound_on_the_velocity_is_where_the_inverted_error_reaches_it() -> None:
    doppler_per_speed = 2 * CARRIER / 299_792_458.0
    limit = STD[2] / (doppler_per_speed * VELOCITY_STD_BOUND)  # cos(theta) of a bare Doppler
    tiny_angle = np.array([1e-9, STD[1], STD[2]])
    for factor, inverted in ((1.01, True), (0.99, False)):
        state = np.array([np.arccos(factor * limit), 100.0, 20.0])
        result = initial_state(measured(state, tiny_angle), UAV, CARRIER)
        assert (result.mean[2] != 0.0) == inverted
        assert result.cov[2, 2] <= VELOCITY_STD_BOUND**2


def information_form(radar: Echo, velocity_std: float) -> GaussianState:
    """Fuse measurement and prior by adding information, linearised at v = 0."""
    start = np.array([radar.value[0], 0.5 * 299_792_458.0 * radar.value[1], 0.0])
    H = measurement_jacobian(start, UAV.speed, UAV.heading, CARRIER)
    offset = radar.value - predict_measurement(start, UAV.speed, UAV.heading, CARRIER)
    with mpmath.workdps(50):
        rows = mpmath.matrix(H.tolist())
        weight = mpmath.diag([1 / mpmath.mpf(float(v)) for v in radar.variance])
        information = rows.T * weight * rows + mpmath.diag(
            [0, 0, 1 / mpmath.mpf(velocity_std) ** 2]
        )
        shift = information**-1 * rows.T * weight * mpmath.matrix(offset.tolist())
        cov = np.array((information**-1).tolist(), dtype=object).astype(float)
        return GaussianState(start + np.array([float(x) for x in shift]), cov, np.array(True))


@pytest.mark.parametrize("doppler_std", [8.3e4, 500.0, 5.0])
@pytest.mark.parametrize("theta", [0.4, 1.05, 1.56, np.pi / 2, 2.7])
def test_a_prior_on_the_velocity_is_fused_as_information(theta: float, doppler_std: float) -> None:
    radar = measured(np.array([theta, 115.0, 30.0]), np.array([0.02, 1e-8, doppler_std]))
    radar = altered(radar, {(2,): radar.value[2] + 0.7 * doppler_std})
    state, expected = initial_state(radar, UAV, CARRIER, 30.0), information_form(radar, 30.0)
    np.testing.assert_allclose(state.mean, expected.mean, rtol=1e-9, atol=1e-11)
    std = np.sqrt(np.diag(expected.cov))
    np.testing.assert_allclose(state.cov / np.outer(std, std), expected.cov / np.outer(std, std))


def test_a_prior_keeps_the_velocity_sane_and_the_rest_as_measured() -> None:
    radar = Echo(measured(TRUTH).value + STD * [0, 0, 1], measured(TRUTH).variance)
    with_prior, without = (initial_state(radar, UAV, CARRIER, prior) for prior in (30.0, None))
    assert np.all(np.abs(without.mean[:, 2]) > 400)
    assert np.all(np.abs(with_prior.mean[:, 2]) < 5)
    np.testing.assert_allclose(with_prior.mean[:, :2], without.mean[:, :2], rtol=0.01)
    assert np.all(with_prior.cov[:, 2, 2] < 30.0**2)


def test_a_prior_stands_alone_where_no_doppler_was_measured() -> None:
    state = initial_state(without_doppler(), UAV, CARRIER, 30.0)
    assert state.mean[2] == 0.0
    np.testing.assert_allclose(
        np.diag(state.cov), [STD[0] ** 2, (0.5 * 299_792_458.0 * STD[1]) ** 2, 900.0]
    )


def test_no_objects_are_no_trouble() -> None:
    nothing = Echo(np.empty((4, 0, 3)), np.empty((4, 0, 3)))
    for prior in (None, 30.0):
        assert initial_state(nothing, UAV, CARRIER, prior).mean.shape == (4, 0, 3)
