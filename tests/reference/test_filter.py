"""The filter against Stone Soup, a linear Kalman filter, its stated covariance and its bound.

The statistical tests draw truth and measurements from the filter's own models, with a fixed seed;
their bands are those of the chi-square distribution at 99.9 %.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import echobeam as eb
from echobeam.estimation.bound import posterior_bound
from echobeam.estimation.consistency import chi_square_band, nees, nis
from echobeam.estimation.gaussian import propagate, update, wrap
from echobeam.physics.polar import POLAR
from echobeam.tracking.evolution import Evolution, evolution_jacobian, evolve
from echobeam.tracking.measurement import measurement_jacobian, predict_measurement
from echobeam.tracking.polar import PolarMeasurement
from echobeam.values import GaussianState

from .. import forms
from ..forms import Echo, flying, initial_state

C = 299_792_458.0
CARRIER = 30e9
DURATION = 0.01
UAV = flying(15.0, -np.pi / 2)
PROCESS_STD = np.array([np.radians(0.02), 0.2, 0.5])
PAPER_NOISE = np.array([0.011, 1.9e-9, 1.5e4])
SHARP_NOISE = np.array([2e-3, 5e-10, 500.0])
CONFIDENCE = 0.999


def wrapped_innovation(mean: np.ndarray, echo: Echo) -> np.ndarray:
    model = PolarMeasurement(CARRIER)
    return model.residual(echo.value, model.expected(mean, UAV))


def plane_motion(state: np.ndarray, kind: Evolution) -> np.ndarray:
    """g(e) written out once more, in analytic functions: the examiner's own model."""
    theta, d, v = state
    down = UAV.speed * np.sin(UAV.heading) * DURATION
    along = v * DURATION - UAV.speed * np.cos(UAV.heading) * DURATION
    if kind == "paper":
        ahead = d + down * np.sin(theta) + along * np.cos(theta)
        return np.array([theta - (along * np.sin(theta) - down * np.cos(theta)) / ahead, ahead, v])
    x, depth = d * np.cos(theta) + along, d * np.sin(theta) + down
    return np.array([np.pi / 2 - np.arctan(x / depth), np.sqrt(x * x + depth * depth), v])


def radar(state: np.ndarray) -> np.ndarray:
    """h(e) written out once more."""
    theta, d, v = state
    closing = UAV.speed * np.cos(theta + UAV.heading) - v * np.cos(theta)
    return np.array([theta, 2 * d / C, 2 * CARRIER / C * closing])


def complex_step(function, state: np.ndarray) -> np.ndarray:
    columns = [function(state + 1e-30j * unit).imag / 1e-30 for unit in np.eye(3)]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("kind", ["paper", "exact"])
@pytest.mark.parametrize("start", [[1.31, 103.5, 30.0], [2.36, 141.4, -3.0]])
def test_ten_slots_agree_with_stone_soup(kind: Evolution, start: list[float]) -> None:
    pytest.importorskip("stonesoup")
    from stonesoup.models.base import GaussianModel
    from stonesoup.models.measurement.base import MeasurementModel
    from stonesoup.models.transition.base import TransitionModel
    from stonesoup.predictor.kalman import ExtendedKalmanPredictor
    from stonesoup.types.array import CovarianceMatrix, StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState as SoupState
    from stonesoup.updater.kalman import ExtendedKalmanUpdater

    def column(state) -> np.ndarray:
        return np.asarray(state.state_vector, dtype=float).ravel()

    class Motion(TransitionModel, GaussianModel):
        ndim_state = 3

        def function(self, state, noise=False, **kwargs):
            return StateVector(plane_motion(column(state), kind))

        def jacobian(self, state, **kwargs):
            return complex_step(lambda e: plane_motion(e, kind), column(state))

        def covar(self, **kwargs):
            return CovarianceMatrix(np.diag(PROCESS_STD**2))

    class Radar(MeasurementModel, GaussianModel):
        ndim_meas = 3

        def function(self, state, noise=False, **kwargs):
            return StateVector(radar(column(state)))

        def jacobian(self, state, **kwargs):
            return complex_step(radar, column(state))

        def covar(self, **kwargs):
            return CovarianceMatrix(np.diag(PAPER_NOISE**2))

    rng = np.random.default_rng(1)
    truth = np.array(start)
    first = Echo(radar(truth) + PAPER_NOISE * rng.normal(size=3), (4 * PAPER_NOISE) ** 2)
    ours = initial_state(first, UAV, CARRIER)
    theirs = SoupState(StateVector(ours.mean), CovarianceMatrix(ours.cov))
    predictor = ExtendedKalmanPredictor(Motion())
    model = Radar(ndim_state=3, mapping=(0, 1, 2))
    updater = ExtendedKalmanUpdater(model, use_joseph_cov=True)
    for _ in range(10):
        truth = plane_motion(truth, kind)
        value = radar(truth) + PAPER_NOISE * rng.normal(size=3)
        prior = forms.predict(ours, UAV, DURATION, PROCESS_STD, kind)
        soup_prior = predictor.predict(theirs)
        assert_same_belief(prior, soup_prior)
        ours = forms.update(prior, Echo(value, PAPER_NOISE**2), UAV, CARRIER)
        detection = Detection(StateVector(value), measurement_model=model)
        theirs = updater.update(SingleHypothesis(soup_prior, detection))
        assert_same_belief(ours, theirs)


def assert_same_belief(ours: GaussianState, theirs) -> None:
    mean, cov = (np.asarray(a, dtype=float) for a in (theirs.state_vector, theirs.covar))
    np.testing.assert_allclose(ours.mean, mean.ravel(), rtol=1e-9)
    std = np.sqrt(np.diag(cov))
    np.testing.assert_allclose(
        ours.cov / np.outer(std, std), cov / np.outer(std, std), rtol=1e-9, atol=1e-9
    )


def test_linear_case_agrees_with_a_regression_on_all_measurements() -> None:
    # Constant state, scalar measurements along random rows: the posterior is least squares.
    rng = np.random.default_rng(2)
    H, variance = rng.normal(size=(40, 3)), rng.uniform(0.5, 2.0, 40)
    value = H @ [1.0, -2.0, 0.5] + np.sqrt(variance) * rng.normal(size=40)
    mean, cov = np.zeros(3), np.diag([1e3, 1e3, 1e3])
    for h, z, r in zip(H, value, variance, strict=True):
        cov = propagate(cov, np.eye(3), np.zeros((3, 3)))
        mean, cov = update(mean, cov, np.array([z - h @ mean]), h[None], np.array([r]))
    information = H.T @ (H / variance[:, None]) + np.eye(3) / 1e3
    np.testing.assert_allclose(cov, np.linalg.inv(information), rtol=1e-10)
    np.testing.assert_allclose(mean, np.linalg.solve(information, H.T @ (value / variance)))


def test_linear_case_settles_at_the_solution_of_the_riccati_equation() -> None:
    linalg = pytest.importorskip("scipy.linalg")
    rng = np.random.default_rng(3)
    G = np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.1], [0.0, 0.0, 0.9]])
    H, Q, R = rng.normal(size=(2, 3)), np.diag([0.01, 0.02, 0.03]), np.array([0.5, 0.8])
    prior = np.eye(3)
    for _ in range(400):
        _, cov = update(np.zeros(3), prior, np.zeros(2), H, R)
        prior = propagate(cov, G, Q)
    expected = linalg.solve_discrete_are(G.T, H.T, Q, np.diag(R))
    np.testing.assert_allclose(prior, expected, rtol=1e-9, atol=1e-12)


@dataclass(frozen=True)
class Runs:
    """Tracks of many trials on models that the filter shares; leading axes slot, trial."""

    truth: np.ndarray
    priors: list[GaussianState]
    posteriors: list[GaussianState]
    radar: list[Echo]


def run_matched(
    believed_std: np.ndarray, kind: Evolution, trials: int = 600, slots: int = 12, seed: int = 4
) -> Runs:
    """Draw truth with process noise and measurements, and track them."""
    rng = np.random.default_rng(seed)
    start = np.array([[1.31, 103.5, 30.0], [2.36, 141.4, -3.0]])
    truth = np.broadcast_to(start, (trials, 2, 3))
    runs = Runs(np.empty((slots, trials, 2, 3)), [], [], [])
    for slot in range(slots):
        if slot:
            truth = evolve(truth, UAV.speed, UAV.heading, DURATION, kind)
            truth = truth + PROCESS_STD * rng.normal(size=truth.shape)
        value = predict_measurement(truth, UAV.speed, UAV.heading, CARRIER)
        value = value + SHARP_NOISE * rng.normal(size=truth.shape)
        echo = Echo(value, np.broadcast_to(SHARP_NOISE**2, value.shape))
        if slot:
            prior = forms.predict(runs.posteriors[-1], UAV, DURATION, believed_std, kind)
            posterior = forms.update(prior, echo, UAV, CARRIER)
        else:
            prior = posterior = initial_state(echo, UAV, CARRIER)
        assert posterior.known.all()
        runs.truth[slot] = truth
        runs.priors.append(prior)
        runs.posteriors.append(posterior)
        runs.radar.append(echo)
    return runs


def last_nees(runs: Runs) -> float:
    last = runs.posteriors[-1]
    return float(np.mean(nees(last.mean - runs.truth[-1], last.cov, POLAR.angles)))


def last_nis(runs: Runs) -> float:
    prior, echo = runs.priors[-1], runs.radar[-1]
    H = measurement_jacobian(prior.mean, UAV.speed, UAV.heading, CARRIER)
    innovation = wrapped_innovation(prior.mean, echo)
    return float(np.mean(nis(innovation, prior.cov, H, echo.variance, POLAR.angles)))


@pytest.mark.parametrize("kind", ["paper", "exact"])
def test_normalised_errors_lie_in_their_bands_when_the_models_match(kind: Evolution) -> None:
    runs = run_matched(PROCESS_STD, kind)
    low, high = chi_square_band(3, 1200, CONFIDENCE)
    assert low < last_nees(runs) < high
    assert low < last_nis(runs) < high


def test_normalised_errors_leave_their_bands_when_the_filter_believes_in_a_hundredth_of_q() -> None:
    runs = run_matched(PROCESS_STD / 10, "paper")
    _, high = chi_square_band(3, 1200, CONFIDENCE)
    assert last_nees(runs) > high
    assert last_nis(runs) > high


def test_first_state_is_as_uncertain_as_it_says() -> None:
    runs = run_matched(PROCESS_STD, "paper", trials=2000, slots=1)
    low, high = chi_square_band(3, 4000, CONFIDENCE)
    assert low < last_nees(runs) < high


def test_errors_reach_the_posterior_bound_and_never_beat_it() -> None:
    trials, slots = 2000, 12
    runs = run_matched(PROCESS_STD, "exact", trials=trials, slots=slots, seed=5)
    truth = np.swapaxes(runs.truth, 0, 1)
    G = evolution_jacobian(truth[:, :-1], UAV.speed, UAV.heading, DURATION, "exact")
    H = measurement_jacobian(truth, UAV.speed, UAV.heading, CARRIER)
    variance = np.broadcast_to(SHARP_NOISE**2, truth.shape)
    bound = posterior_bound(G, np.diag(PROCESS_STD**2), H, variance)
    error = np.stack([state.mean for state in runs.posteriors], axis=1) - truth
    error[..., 0] = wrap(error[..., 0])
    ratio = np.mean(error**2, axis=0) / np.diagonal(bound, axis1=-2, axis2=-1)
    # 72 ratios are examined together: each gets its share of the 0.1 %.
    low, high = chi_square_band(1, trials, 1 - (1 - CONFIDENCE) / ratio.size)
    assert np.all(ratio > low)
    assert np.all(ratio < high * 1.02)  # a linearised filter may lose a little


@pytest.mark.slow
@pytest.mark.parametrize(
    ("setting", "honest"),
    [
        pytest.param("radio.power=1", False, id="velocity known to 1300 m/s"),
        pytest.param("radio.power=1000", True, id="velocity known to 40 m/s"),
        pytest.param("filter.velocity_prior=30 m/s", True, id="prior of 30 m/s"),
    ],
)
def test_the_paper_is_overconfident_only_where_the_first_velocity_is_next_to_unknown(
    setting: str, honest: bool
) -> None:
    """The object at 75 degrees in slot 2: one prediction over a velocity from a single Doppler."""
    # the variance is known, so that the linearisation alone is examined
    changes = [setting, "radar.variance=known", "frame.slots_per_frame=2"]
    scenario = eb.load_scenario("paper-multi", overrides=changes)
    result = eb.simulate(scenario, schemes=["temporal"], trials=400, seed=0)
    second = result.isel(scheme=0, slot=1, object=0)
    error = (second["estimated"] - second["truth"]).to_numpy()
    mean = float(np.mean(nees(error, second["estimated_cov"].to_numpy(), POLAR.angles)))
    low, high = chi_square_band(3, 400, CONFIDENCE)
    assert (low < mean < high) is honest
