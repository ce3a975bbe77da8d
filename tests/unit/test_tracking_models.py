"""Models against geometry and complex steps, and the filter on a toy model against Kalman's.

Likelihoods are SciPy's; the toy has four states, two measurements and no angle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from echobeam.physics.polar import POLAR
from echobeam.tracking.evolution import Evolution
from echobeam.tracking.filter import predict, update
from echobeam.tracking.models import MeasurementModel, MotionModel
from echobeam.tracking.polar import PolarMeasurement, PolarMotion
from echobeam.values import GaussianState, StateSpace, UavState

from ..forms import flying
from ..road import RoadMeasurement, RoadMotion

UAV = flying(15.0, -np.pi / 2)
PLANE = StateSpace(
    names=("x", "y", "v_x", "v_y"),
    units=("m", "m", "m/s", "m/s"),
    angles=(),
    valid=lambda state: state[..., 0] < 1e3,
)


@dataclass(frozen=True)
class PlaneMotion:
    """Constant velocity in a plane."""

    space = PLANE
    F = np.eye(4) + 0.5 * np.eye(4, k=2)

    def step(self, state, uav):
        return state @ self.F.T

    def jacobian(self, state, uav):
        return np.broadcast_to(self.F, (*state.shape, 4))

    def noise(self):
        return np.diag([0.1, 0.2, 0.3, 0.4])


@dataclass(frozen=True)
class TwoSums:
    """Two linear measurements of four states."""

    names = ("a", "b")
    H = np.array([[1.0, 0.5, 0.0, 0.2], [0.0, 1.0, -0.3, 0.0]])

    def expected(self, state, uav):
        return state @ self.H.T

    def jacobian(self, state, uav):
        return np.broadcast_to(self.H, (*state.shape[:-1], 2, 4))

    def residual(self, value, expected):
        return value - expected


def test_a_filter_of_four_states_and_two_measurements_is_kalmans() -> None:
    """Against the textbook's matrices; nothing counts on three components or an angle."""
    rng = np.random.default_rng(0)
    root = rng.normal(size=(5, 3, 4, 4))
    state = GaussianState(
        rng.normal(size=(5, 3, 4)),
        root @ np.swapaxes(root, -1, -2) + np.eye(4),
        np.ones((5, 3), bool),
    )
    prior = predict(state, PlaneMotion(), UAV)
    F, H = PlaneMotion.F, TwoSums.H
    P = F @ state.cov @ F.T + PlaneMotion().noise()
    np.testing.assert_allclose(prior.mean, state.mean @ F.T, rtol=1e-12)
    np.testing.assert_allclose(prior.cov, P, rtol=1e-12)
    value, variance = 10 * rng.normal(size=(5, 3, 2)), rng.uniform(0.5, 2.0, (5, 3, 2))
    found = update(prior, value, variance, TwoSums(), UAV, PLANE)
    S = H @ P @ H.T + variance[..., None] * np.eye(2)
    gain = P @ H.T @ np.linalg.inv(S)
    innovation = value - prior.mean @ H.T
    mean = prior.mean + np.einsum("...ij,...j->...i", gain, innovation)
    assert np.abs(innovation).max(axis=(0, 1)).min() > 2 * np.pi  # no component is an angle
    np.testing.assert_allclose(found.state.mean, mean, rtol=1e-10)
    np.testing.assert_allclose(found.state.cov, (np.eye(4) - gain @ H) @ P, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.innovation, innovation, rtol=1e-12)
    np.testing.assert_allclose(found.innovation_cov, S, rtol=1e-12)
    expected = [
        [multivariate_normal(cov=S[t, k]).logpdf(innovation[t, k]) for k in range(3)]
        for t in range(5)
    ]
    np.testing.assert_allclose(found.log_likelihood, expected, rtol=1e-10)


def test_an_unknown_object_has_no_innovation_and_spoils_no_other_likelihood() -> None:
    mean = np.array([[1.1, 110.0, 20.0], [np.nan] * 3])
    cov = np.stack([np.diag([1e-4, 1.0, 400.0]), np.full((3, 3), np.nan)])
    model = PolarMeasurement(30e9)
    value = np.tile(model.expected(mean[0], UAV) + np.array([0.01, 1e-9, 1e3]), (2, 1))
    variance = np.broadcast_to(np.square([0.01, 1e-9, 2e3]), (2, 3))
    both = update(
        GaussianState(mean, cov, np.array([True, False])), value, variance, model, UAV, POLAR
    )
    alone = update(
        GaussianState(mean[:1], cov[:1], np.array([True])),
        value[:1],
        variance[:1],
        model,
        UAV,
        POLAR,
    )
    np.testing.assert_array_equal(both.log_likelihood, [alone.log_likelihood[0], 0.0])
    assert np.isnan(both.innovation[1]).all()
    assert np.isnan(both.innovation_cov[1]).all()
    np.testing.assert_array_equal(both.innovation_cov[0], alone.innovation_cov[0])


def test_the_innovation_covariance_is_symmetric_in_every_bit() -> None:
    rng = np.random.default_rng(7)
    root = rng.normal(size=(20, 3, 4))
    cov = root @ np.swapaxes(root, -1, -2)
    prior = GaussianState(
        rng.uniform([0.3, 50, -40], [2.8, 200, 40], (20, 3)),
        0.5 * (cov + np.swapaxes(cov, -1, -2)),
        np.ones(20, bool),
    )
    value, variance = rng.normal(size=(20, 3)), rng.uniform(1, 2, (20, 3))
    S = update(prior, value, variance, PolarMeasurement(30e9), UAV, POLAR).innovation_cov
    assert np.array_equal(S, np.swapaxes(S, -1, -2))


def test_a_state_that_the_model_calls_impossible_ends_the_track() -> None:
    mean = np.array([[999.0, 0.0, 4.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    state = GaussianState(mean, np.tile(np.eye(4), (2, 1, 1)), np.ones(2, bool))
    np.testing.assert_array_equal(predict(state, PlaneMotion(), UAV).known, [False, True])


@pytest.mark.parametrize("gone", [(np.nan, np.inf), (np.nan, 1e-4), (0.1, np.inf), (0.1, np.nan)])
@pytest.mark.parametrize("missing", [(), (0,), (1,), (2,), (0, 2), (0, 1, 2)])
def test_the_likelihood_is_the_density_of_what_was_measured(
    missing: tuple[int, ...], gone: tuple[float, float]
) -> None:
    rng = np.random.default_rng(len(missing))
    mean = np.array([1.1, 110.0, 20.0])
    std = np.array([0.01, 1.0, 20.0])
    correlation = np.array([[1.0, 0.3, -0.2], [0.3, 1.0, 0.1], [-0.2, 0.1, 1.0]])
    prior = GaussianState(mean[None], (correlation * np.outer(std, std))[None], np.array([True]))
    model = PolarMeasurement(30e9)
    noise = np.array([0.01, 1e-9, 2e3])
    expected, H = model.expected(mean, UAV), model.jacobian(mean[None], UAV)[0]
    value = expected + noise * rng.normal(size=3)
    variance = noise**2
    value[list(missing)], variance[list(missing)] = gone
    found = update(prior, value[None], variance[None], model, UAV, POLAR)
    used = [m for m in range(3) if m not in missing]
    S = (H @ prior.cov[0] @ H.T + np.diag(noise**2))[np.ix_(used, used)]
    known = 0.0
    if used:
        scale = np.sqrt(np.diag(S))  # densities in units of one, for SciPy's sake
        scaled = multivariate_normal(cov=S / np.outer(scale, scale))
        known = scaled.logpdf((value - expected)[used] / scale) - np.log(scale).sum()
    assert found.log_likelihood[0] == pytest.approx(known, rel=1e-9, abs=1e-12)
    np.testing.assert_allclose(found.innovation_cov[0][np.ix_(used, used)], S, rtol=1e-9)
    assert np.isinf(np.diag(found.innovation_cov[0])[list(missing)]).all()


C = 299_792_458.0
CARRIER = 30e9
Step = Callable[[np.ndarray], np.ndarray]


def paper_step(duration: float, speed: float, heading: float) -> Step:
    """g(e) of Eq. (35) with the corrected signs, written out once more."""

    def step(state: np.ndarray) -> np.ndarray:
        theta, d, v = state
        down = speed * np.sin(heading) * duration
        along = (v - speed * np.cos(heading)) * duration
        ahead = d + down * np.sin(theta) + along * np.cos(theta)
        return np.stack([theta - (along * np.sin(theta) - down * np.cos(theta)) / ahead, ahead, v])

    return step


def exact_step(duration: float, speed: float, heading: float) -> Step:
    """Motion in the plane in analytic functions; for objects that stay below the UAV."""

    def step(state: np.ndarray) -> np.ndarray:
        theta, d, v = state
        x = d * np.cos(theta) + (v - speed * np.cos(heading)) * duration
        depth = d * np.sin(theta) + speed * np.sin(heading) * duration
        return np.stack([np.pi / 2 - np.arctan(x / depth), np.sqrt(x * x + depth * depth), v])

    return step


def sight(
    x: np.ndarray, depth: np.ndarray, v: np.ndarray, velocity: np.ndarray
) -> list[np.ndarray]:
    """Angle, delay and Doppler of a point x ahead and some depth below, from scalar products."""
    d = np.sqrt(x * x + depth * depth)
    range_rate = (x * (v - velocity[0]) + depth * velocity[2]) / d
    return [np.pi / 2 - np.arctan(x / depth), 2 * d / C, -2 * CARRIER / C * range_rate]


def polar_echo(uav: UavState) -> Step:
    """h(e) of Eq. (24)."""

    def echo(state: np.ndarray) -> np.ndarray:
        theta, d, v = state
        return np.stack(sight(d * np.cos(theta), d * np.sin(theta), v, uav.velocity))

    return echo


def road_echo(uav: UavState) -> Step:
    """The same of a position on the road."""

    def echo(state: np.ndarray) -> np.ndarray:
        return np.stack(sight(state[0] - uav.position[0], uav.position[2], state[1], uav.velocity))

    return echo


def assert_is(
    found: tuple[np.ndarray, np.ndarray], function: Step, state: np.ndarray, size: np.ndarray
) -> None:
    """Compare a model's value and Jacobian with a function and its complex steps.

    ``size`` is that of an ordinary change of each component of the result.
    """
    value, jacobian = found
    columns = [function(state + 1e-30j * unit).imag / 1e-30 for unit in np.eye(len(state))]
    derivative = np.stack(columns, axis=-1)
    np.testing.assert_allclose(value / size, function(state) / size, rtol=1e-11, atol=1e-9)
    tolerance = 1e-11 * np.abs(derivative).max(axis=-1, keepdims=True) + 1e-13 * size[:, None]
    assert np.all(np.abs(jacobian - derivative) <= tolerance)


polar_states = st.builds(
    lambda *e: np.array(e), st.floats(0.1, 3.0), st.floats(30.0, 300.0), st.floats(-40.0, 40.0)
)
road_states = st.builds(lambda *e: np.array(e), st.floats(-500.0, 500.0), st.floats(-40.0, 40.0))
speeds, headings = st.floats(0.0, 30.0), st.floats(-np.pi, np.pi)
ORDINARY = np.array([1.0, 1.0, 1.0])
ORDINARY_ECHO = np.array([1.0, 1e-9, 1e3])


@given(polar_states, speeds, headings, st.sampled_from(["paper", "exact"]))
def test_polar_motion_is_its_equations_and_its_jacobian_their_derivative(
    state: np.ndarray, speed: float, heading: float, kind: Evolution
) -> None:
    uav, motion = flying(speed, heading), PolarMotion(0.02, 0.0, 0.0, 0.0, kind)
    found = motion.step(state, uav), motion.jacobian(state, uav)
    step = {"paper": paper_step, "exact": exact_step}[kind](0.02, speed, heading)
    assert_is(found, step, state, ORDINARY)


@given(polar_states, speeds, headings)
def test_polar_measurement_is_geometry_and_its_jacobian_the_derivative(
    state: np.ndarray, speed: float, heading: float
) -> None:
    uav, radar = flying(speed, heading), PolarMeasurement(CARRIER)
    found = radar.expected(state, uav), radar.jacobian(state, uav)
    assert_is(found, polar_echo(uav), state, ORDINARY_ECHO)


@given(road_states, speeds, headings, st.floats(10.0, 200.0), st.floats(-300.0, 300.0))
def test_road_measurement_is_geometry_and_its_jacobian_the_derivative(
    state: np.ndarray, speed: float, heading: float, height: float, along: float
) -> None:
    velocity = flying(speed, heading).velocity
    uav, radar = UavState(np.array([along, 0.0, height]), velocity), RoadMeasurement(CARRIER)
    found = radar.expected(state, uav), radar.jacobian(state, uav)
    assert_is(found, road_echo(uav), state, ORDINARY_ECHO)


@given(road_states)
def test_road_motion_is_linear_and_its_jacobian_the_matrix(state: np.ndarray) -> None:
    motion = RoadMotion(0.5, 0.0, 0.0)
    found = motion.step(state, UAV), motion.jacobian(state, UAV)
    assert_is(found, lambda e: np.stack([e[0] + 0.5 * e[1], e[1]]), state, ORDINARY[:2])


@pytest.mark.parametrize(
    ("motion", "stds"),
    [
        (PolarMotion(0.01, 1e-3, 0.2, 0.5), [1e-3, 0.2, 0.5]),
        (RoadMotion(0.01, 0.05, 0.5), [0.05, 0.5]),
    ],
)
def test_process_noise_is_independent_in_each_component(
    motion: MotionModel, stds: list[float]
) -> None:
    np.testing.assert_allclose(motion.noise(), np.diag(np.square(stds)), rtol=1e-15)
    assert motion.space.size == len(stds)


@pytest.mark.parametrize("model", [PolarMeasurement(CARRIER), RoadMeasurement(CARRIER)])
def test_a_residual_takes_the_short_way_round(model: MeasurementModel) -> None:
    residual = model.residual(np.array([-3.1, 0.0, 0.0]), np.array([3.1, 0.0, 0.0]))
    assert residual[0] == pytest.approx(2 * np.pi - 6.2)
