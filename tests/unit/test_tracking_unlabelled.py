"""Update of tracks by unlabelled detections, against the filter, a direct mixture and symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from echobeam.physics.polar import POLAR
from echobeam.tracking import filter as ekf
from echobeam.tracking.polar import PolarMeasurement
from echobeam.tracking.unlabelled import Scan, update
from echobeam.values import NOBODY, GaussianState, UavState

MODEL = PolarMeasurement(30e9)
UAV = UavState(np.array([0.0, 0.0, 100.0]), np.array([12.0, 0.0, -3.0]))
STD = np.array([2e-3, 2e-9, 300.0])
METHODS = ("nearest", "jpda", "mht")


def prior_of(angles, velocity=8.0, trials=1, hypotheses=1) -> GaussianState:
    """Tracks at some angles on the ground, one NaN for an empty column."""
    angle = np.array(angles, dtype=float)
    mean = np.stack([angle, 100.0 / np.sin(angle), velocity + 0.0 * angle], axis=-1)
    root = np.diag([1.5e-3, 0.4, 2.0]) @ np.array(
        [[1.0, 0.0, 0.0], [-0.6, 0.8, 0.0], [0.3, 0, 1.0]]
    )
    cov = np.broadcast_to(root @ root.T, (*mean.shape, 3)).copy()
    known = np.isfinite(angle)
    cov[~known] = np.nan
    lead = (trials, hypotheses)
    return GaussianState(
        *(np.broadcast_to(each, (*lead, *each.shape)).copy() for each in (mean, cov, known))
    )


def expected(angle, velocity=8.0):
    return MODEL.expected(np.array([angle, 100.0 / np.sin(angle), velocity]), UAV)


def scan_of(values, method="nearest", columns=1, hypotheses=1, probability=0.9, **changes) -> Scan:
    value = np.array(values, dtype=float).reshape(1, -1, 3)
    parts = {
        "value": value,
        "variance": np.broadcast_to(STD**2, value.shape).copy(),
        "valid": np.ones(value.shape[:-1], bool),
        "mirror": np.full_like(value, np.nan),
        "probability": np.full((1, hypotheses, columns), probability),
        "density": np.full(value.shape[:-1], 1e-1),
        "density_without_angle": 1e-3,
        "gate": 0.999,
        "method": method,
    }
    return Scan(**parts | changes)


def run(prior, scan, memory=None):
    return update(prior, memory, scan, MODEL, UAV, POLAR)


def noise(seed, count):
    return STD * np.random.default_rng(seed).standard_normal((count, 3))


@pytest.mark.parametrize("method", ["nearest", "mht"])
@pytest.mark.parametrize("seed", range(5))
def test_one_track_and_its_detection_are_the_filters_update(method, seed):
    """No false detection near, and none to be missed: the answer is the filter's in every bit."""
    prior = prior_of([1.1])
    value = expected(1.1) + noise(seed, 1)
    found = run(prior, scan_of(value, method))
    one = GaussianState(prior.mean[0], prior.cov[0], prior.known[0])
    own = ekf.update(one, value, STD[None] ** 2, MODEL, UAV, POLAR).state
    np.testing.assert_array_equal(found.state.mean[0], own.mean)
    np.testing.assert_array_equal(found.state.cov[0], own.cov)
    assert found.taken.tolist() == [[0]]
    assert found.free.tolist() == [[False]]


def test_a_certain_detection_is_the_filters_update_for_the_mixture_too():
    prior = prior_of([1.1])
    value = expected(1.1) + noise(0, 1)
    scan = scan_of(value, "jpda", probability=1.0, density=np.full((1, 1), 1e-12), gate=1.0)
    found = run(prior, scan)
    one = GaussianState(prior.mean[0], prior.cov[0], prior.known[0])
    own = ekf.update(one, value, STD[None] ** 2, MODEL, UAV, POLAR).state
    np.testing.assert_array_equal(found.state.mean[0], own.mean)
    np.testing.assert_array_equal(found.state.cov[0], own.cov)


def direct_mixture(prior, values, P_D, density, gate):
    """Update of one or two tracks by all joint events, with SciPy's densities and NumPy's inverse.

    Bar-Shalom, Willett and Tian, Tracking and Data Fusion, 2011, 6.2: the events, their weights
    and the moments of the mixture are written out.
    """
    count = prior.mean.shape[-2]
    R = np.diag(STD**2)
    kalman, odds = [], np.zeros((count, len(values)))
    for c in range(count):
        m, P = prior.mean[0, 0, c], prior.cov[0, 0, c]
        z, H = MODEL.expected(m, UAV), MODEL.jacobian(m, UAV)
        S = H @ P @ H.T + R
        K = P @ H.T @ np.linalg.inv(S)
        own = [(m, P)]
        for d, value in enumerate(values):
            e = value - z
            if e @ np.linalg.solve(S, e) <= chi2.ppf(gate, 3):
                unit = np.diag(STD)  # SciPy inverts covariances of numbers near 1
                scaled = np.linalg.inv(unit) @ S @ np.linalg.inv(unit)
                pdf = multivariate_normal(np.zeros(3), scaled).pdf(e / STD) / np.prod(STD)
                odds[c, d] = P_D * pdf / density
            own.append((m + K @ e, (np.eye(3) - K @ H) @ P))
        kalman.append(own)
    weight = np.zeros((count, len(values) + 1))
    choices = range(-1, len(values))
    for one in choices:
        for other in choices if count == 2 else [-1]:
            if one == other != -1:
                continue
            event = [one, other][:count]
            product = np.prod(
                [1.0 - P_D * gate if d < 0 else odds[c, d] for c, d in enumerate(event)]
            )
            for c, d in enumerate(event):
                weight[c, d + 1] += product
    weight /= weight.sum(axis=1, keepdims=True)
    answers = []
    for c in range(count):
        mean = sum(w * m for w, (m, _) in zip(weight[c], kalman[c], strict=True))
        cov = sum(
            w * (P + np.outer(m - mean, m - mean))
            for w, (m, P) in zip(weight[c], kalman[c], strict=True)
        )
        answers.append((mean, cov))
    return answers, weight


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("angles", [[1.1], [1.1, 1.103]])
def test_the_mixture_is_that_of_all_joint_events(angles, seed):
    prior = prior_of(angles)
    values = np.concatenate(
        [expected(1.1) + noise(seed, 1), expected(1.102) + 2.0 * noise(seed + 50, 2)]
    )
    density = 0.02 / np.prod(STD)  # so that misses and false detections have a part
    scan = scan_of(
        values, "jpda", columns=len(angles), probability=0.8, density=np.full((1, 3), density)
    )
    found = run(prior, scan)
    answers, weight = direct_mixture(prior, values, 0.8, density, 0.999)
    assert weight.max() < 1.0
    for c, (mean, cov) in enumerate(answers):
        scale = np.sqrt(np.diag(cov))
        # Associations below 1e-6 are left out.
        np.testing.assert_allclose((found.state.mean[0, 0, c] - mean) / scale, 0.0, atol=1e-5)
        np.testing.assert_allclose(
            (found.state.cov[0, 0, c] - cov) / np.outer(scale, scale), 0.0, atol=1e-4
        )
    free = weight[:, 1:].sum(axis=0) < 0.5
    taken = set(found.taken[0].tolist())
    assert found.free[0].tolist() == [bool(free[d]) and d not in taken for d in range(3)]


@pytest.mark.parametrize("seed", range(8))
def test_one_hypothesis_is_the_nearest_neighbour(seed):
    prior = prior_of([1.1, 1.105, 1.5])
    values = np.concatenate([expected(angle) + noise(seed, 1) for angle in (1.102, 1.104, 1.3)])
    nearest = run(prior, scan_of(values, "nearest", columns=3))
    single = run(prior, scan_of(values, "mht", columns=3))
    np.testing.assert_array_equal(nearest.taken, single.taken)
    np.testing.assert_array_equal(nearest.free, single.free)
    np.testing.assert_array_equal(nearest.state.mean, single.state.mean)
    np.testing.assert_array_equal(nearest.state.cov, single.state.cov)


@pytest.mark.parametrize("method", METHODS)
def test_a_folded_detection_is_taken_on_the_side_of_the_track(method):
    """The angle below 90 degrees is a track's at 120 degrees, with its own innovation."""
    behind = 2.1
    prior = prior_of([behind])
    true_value = expected(behind) + noise(1, 1)
    folded = true_value.copy()
    folded[:, 0] = np.pi - folded[:, 0]
    mirror = true_value[None]
    found = run(prior, scan_of(folded, method, mirror=mirror))
    told = run(prior, scan_of(true_value, method))
    np.testing.assert_allclose(found.state.mean, told.state.mean, rtol=1e-12)
    np.testing.assert_allclose(found.state.cov, told.state.cov, rtol=1e-9)
    assert found.taken.tolist() == [[0]]
    blind = run(prior, scan_of(folded, method))
    assert blind.taken.tolist() == [[NOBODY]]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(4))
def test_the_order_of_detections_does_not_matter(method, seed):
    hypotheses = 3 if method == "mht" else 1
    prior = prior_of([1.1, 1.104, 1.5], hypotheses=hypotheses)
    values = np.concatenate(
        [expected(angle) + noise(seed, 1) for angle in (1.5, 1.104, 1.1, 1.102, 0.7)]
    )
    order = np.random.default_rng(seed).permutation(len(values))
    one, other = (
        run(prior, scan_of(each, method, columns=3, hypotheses=hypotheses))
        for each in (values, values[order])
    )
    np.testing.assert_allclose(one.state.mean[0, 0], other.state.mean[0, 0], rtol=1e-9)
    np.testing.assert_allclose(one.state.cov[0, 0], other.state.cov[0, 0], rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(one.free[0][order], other.free[0])
    back = np.append(order, NOBODY)  # of -1: -1
    np.testing.assert_array_equal(one.taken, back[other.taken])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("columns", ["none", "not valid", "outside every gate"])
def test_without_detections_the_prior_stays_in_every_bit(method, columns):
    hypotheses = 2 if method == "mht" else 1
    prior = prior_of([1.1, np.nan, 1.5], hypotheses=hypotheses)
    values = np.empty((0, 3)) if columns == "none" else expected(0.5)[None]
    scan = scan_of(values, method, columns=3, hypotheses=hypotheses)
    if columns == "not valid":
        nan = np.full_like(scan.value, np.nan)
        scan = replace(scan, value=nan, variance=nan * 0 + np.inf, valid=~scan.valid)
    found = run(prior, scan)
    np.testing.assert_array_equal(found.state.mean[:, 0], prior.mean[:, 0])
    np.testing.assert_array_equal(found.state.cov[:, 0], prior.cov[:, 0])
    np.testing.assert_array_equal(found.state.known[:, 0], prior.known[:, 0])
    assert (found.taken == NOBODY).all()
    assert (found.free == (columns == "outside every gate")).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_batch_is_its_trials_one_by_one(method):
    """Over two slots, so that hypotheses have a past."""
    rng = np.random.default_rng(5)
    trials, hypotheses = 6, 3 if method == "mht" else 1
    angles = np.array([1.1, 1.103, np.nan])
    prior = prior_of(angles, trials=trials, hypotheses=hypotheses)
    scans = []
    for _ in range(2):
        value = expected(1.1015) + 1.5 * STD * rng.standard_normal((trials, 4, 3))
        valid = rng.random((trials, 4)) < 0.7
        scans.append(
            Scan(
                value=np.where(valid[..., None], value, np.nan),
                variance=np.where(valid[..., None], STD**2, np.inf),
                valid=valid,
                mirror=np.full_like(value, np.nan),
                probability=np.full((trials, hypotheses, 3), 0.8),
                density=np.full((trials, 4), 1e-2 / np.prod(STD)),
                density_without_angle=1e-2 / np.prod(STD[1:]),
                gate=0.999,
                method=method,
                scans=2,
            )
        )

    def both(rows):
        start = GaussianState(prior.mean[rows], prior.cov[rows], prior.known[rows])
        memory, after = None, []
        for scan in scans:
            arrays = ("value", "variance", "valid", "mirror", "probability", "density")
            mine = replace(scan, **{name: getattr(scan, name)[rows] for name in arrays})
            found = run(start, mine, memory)
            start, memory = found.state, found.memory
            after.append(found)
        return after

    together = both(slice(None))
    for trial in range(trials):
        for one, other in zip(together, both(slice(trial, trial + 1)), strict=True):
            np.testing.assert_array_equal(one.taken[trial], other.taken[0])
            np.testing.assert_array_equal(one.free[trial], other.free[0])
            for name in ("mean", "cov"):
                np.testing.assert_allclose(
                    getattr(one.state, name)[trial, 0], getattr(other.state, name)[0, 0], rtol=1e-9
                )


@pytest.mark.parametrize("method", METHODS)
def test_empty_columns_stay_empty_and_take_nothing(method):
    hypotheses = 2 if method == "mht" else 1
    prior = prior_of([np.nan, np.nan], hypotheses=hypotheses)
    found = run(prior, scan_of(expected(1.1), method, columns=2, hypotheses=hypotheses))
    assert not found.state.known.any()
    assert found.taken.tolist() == [[NOBODY, NOBODY]]
    assert found.free.tolist() == [[True]]


@pytest.mark.parametrize("method", ["nearest", "mht"])
def test_near_the_fold_neither_side_is_taken_but_delay_and_doppler(method):
    """Both sides of 90 degrees are within the innovation: the angle is as if not measured."""
    prior = prior_of([0.5 * np.pi + 1e-3])
    folded = expected(0.5 * np.pi - 5e-4) + noise(2, 1) * [0.0, 1.0, 1.0]
    mirror = folded.copy()
    mirror[:, 0] = np.pi - mirror[:, 0]
    found = run(prior, scan_of(folded, method, mirror=mirror[None]))
    one = GaussianState(prior.mean[0], prior.cov[0], prior.known[0])
    variance = np.array([[np.inf, STD[1] ** 2, STD[2] ** 2]])
    own = ekf.update(one, folded, variance, MODEL, UAV, POLAR).state
    np.testing.assert_array_equal(found.state.mean[0], own.mean)
    np.testing.assert_array_equal(found.state.cov[0], own.cov)
    assert found.taken.tolist() == [[0]]


def test_a_variance_at_the_prediction_goes_before_the_stated_one():
    prior = prior_of([1.1])
    value = expected(1.1) + noise(3, 1)
    variance = 4.0 * STD**2
    found = run(prior, scan_of(value, predicted_variance=variance[None, None, None, None]))
    one = GaussianState(prior.mean[0], prior.cov[0], prior.known[0])
    own = ekf.update(one, value, variance[None], MODEL, UAV, POLAR).state
    np.testing.assert_array_equal(found.state.mean[0], own.mean)
    missing = scan_of(value, predicted_variance=variance[None, None, None, None],
                      variance=np.full((1, 1, 3), np.inf))  # fmt: skip
    assert run(prior, missing).taken.tolist() == [[NOBODY]]
